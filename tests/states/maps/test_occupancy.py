import math
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from engine.files.finding import FileError
from hw.geometry import Pose2
from states.maps.images import read_image, write_image
from states.maps.occupancy import OccupancyMap, load_map, pixel_values, save_map

DATA = Path(__file__).resolve().parents[4] / "shared/data/maps"
YAML = {
    "image": "map.pgm",
    "resolution": 0.05,
    "origin": "[-1.0, -2.0, 0.0]",
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def write_map(folder, pixels, suffix=".pgm", **changes):
    write_image(folder / f"map{suffix}", np.asarray(pixels, np.uint8))
    keys = {**YAML, "image": f"map{suffix}", **changes}
    text = "".join(f"{key}: {value}\n" for key, value in keys.items() if value is not None)
    (folder / "map.yaml").write_text(text)
    return folder / "map.yaml"


def meaning(grey, convention="ros1", mode="trinary", occupied=0.65, free=0.196, negate=False):
    pixels = np.array([[[grey]]], np.uint8)
    return int(pixel_values(pixels, mode, (occupied, free), negate, convention)[0, 0])


@pytest.mark.parametrize("convention", ["ros1", "nav2"])
@pytest.mark.parametrize(("grey", "value"), [(0, 100), (205, -1), (254, 0), (255, 0), (128, -1)])
def test_map_savers_greys_mean_occupied_unknown_and_free(grey, value, convention):
    assert meaning(grey, convention) == value


@pytest.mark.parametrize("convention", ["ros1", "nav2"])
def test_a_careless_free_threshold_reads_unknown_as_free(convention):
    assert meaning(205, convention, free=0.25) == 0


def test_on_a_threshold_ros1_says_between_and_nav2_says_beyond():
    assert meaning(51, "ros1", occupied=0.8) == -1
    assert meaning(51, "nav2", occupied=0.8) == 100
    assert meaning(204, "ros1", free=0.2) == -1
    assert meaning(204, "nav2", free=0.2) == 0


def test_negate_turns_dark_into_free():
    assert meaning(0, negate=True) == 0
    assert meaning(255, negate=True) == 100
    assert meaning(50, negate=True) == -1


def test_scale_gives_99_steps_in_ros1_and_100_rounded_ones_in_nav2():
    middle = 255 - round(255 * 0.5)
    assert meaning(middle, "ros1", "scale", 0.9, 0.1) == math.trunc(99 * (127 / 255 - 0.1) / 0.8)
    assert meaning(middle, "nav2", "scale", 0.9, 0.1) == round(100 * (127 / 255 - 0.1) / 0.8)
    assert meaning(0, "ros1", "scale") == 100
    assert meaning(255, "nav2", "scale") == 0


def test_raw_gives_the_pixel_itself():
    assert [meaning(grey, "ros1", "raw") for grey in (0, 100, 205, 255)] == [0, 100, 205, -1]
    assert [meaning(grey, "nav2", "raw") for grey in (0, 100, 101, 255)] == [0, 100, -1, -1]


@pytest.mark.parametrize("convention", ["ros1", "nav2"])
@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_pixels_that_are_not_opaque_are_unknown(mode, convention):
    pixels = np.array([[[255, 0], [0, 0], [0, 254], [255, 255], [0, 255]]], np.uint8)
    values = pixel_values(pixels, mode, (0.65, 0.196), False, convention)
    assert values.tolist() == [[-1, -1, -1, 0, 100]]


def test_colours_are_averaged():
    pixels = np.array([[[255, 0, 0], [255, 255, 249]]], np.uint8)
    values = pixel_values(pixels, "trinary", (0.65, 0.196), False, "ros1")
    assert values.tolist() == [[100, 0]]


def test_the_top_row_of_the_image_is_the_last_row_of_the_map(tmp_path):
    map_ = load_map(write_map(tmp_path, [[[0], [0]], [[254], [205]]]))
    assert map_.values.tolist() == [[0, -1], [100, 100]]
    assert map_.resolution == 0.05
    assert map_.center(0, 0) == pytest.approx((-0.975, -1.975))
    assert map_.cell(-0.93, -1.93) == (1, 1)


def test_an_origin_with_yaw_turns_the_image_about_its_lower_left_corner(tmp_path):
    path = write_map(
        tmp_path, np.zeros((1, 4, 1)), resolution=1.0, origin="[2.0, 1.0, 1.5707963267948966]"
    )
    map_ = load_map(path)
    assert map_.center(0, 3) == pytest.approx((1.5, 4.5))
    assert map_.cell(1.5, 4.5) == (0, 3)
    assert map_.cell(2.5, 1.5) is None
    assert map_.cell(math.nan, 1.5) is None


maps = hnp.arrays(
    np.int16,
    hnp.array_shapes(min_dims=2, max_dims=2, max_side=9),
    elements=st.sampled_from([-1, 0, 100]),
)
degrees = hnp.arrays(
    np.int16, hnp.array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.integers(-1, 100)
)
origins = st.builds(Pose2, st.floats(-99, 99), st.floats(-99, 99), st.floats(-3.1, 3.1))


@settings(deadline=None, max_examples=30)
@given(values=maps, origin=origins)
@pytest.mark.parametrize("convention", ["ros1", "nav2"])
def test_a_trinary_map_comes_back_as_it_was_written(tmp_path_factory, values, origin, convention):
    path = tmp_path_factory.mktemp("map") / "room.yaml"
    save_map(OccupancyMap(values, 0.05, origin), path)
    back = load_map(path, convention)
    assert np.array_equal(back.values, values)
    assert (back.resolution, back.map_from_corner) == (0.05, origin)


@settings(deadline=None, max_examples=30)
@given(values=degrees)
@pytest.mark.parametrize("mode", ["scale", "raw"])
def test_degrees_of_occupancy_come_back_as_they_were_written(tmp_path_factory, values, mode):
    path = tmp_path_factory.mktemp("map") / "room.yaml"
    save_map(OccupancyMap(values, 0.05, Pose2(0.0, 0.0)), path, mode)
    assert np.array_equal(load_map(path, "nav2").values, values)


def test_raw_maps_come_back_in_ros1_too(tmp_path):
    values = np.array([[-1, 0, 50, 205]], np.int16)
    save_map(OccupancyMap(values, 0.05, Pose2(0.0, 0.0)), tmp_path / "room.yaml", "raw")
    assert load_map(tmp_path / "room.yaml").values.tolist() == values.tolist()


@pytest.mark.parametrize("key", list(YAML))
def test_a_missing_key_is_named_with_the_file(tmp_path, key):
    path = write_map(tmp_path, np.zeros((2, 2, 1)), **{key: None})
    with pytest.raises(FileError, match=rf"map\.yaml:1:1: the key '{key}' is missing"):
        load_map(path)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("resolution", "0", "0 is out of range, 0.001 to 10 m"),
        ("resolution", "-0.05", "out of range, 0.001 to 10 m"),
        ("resolution", "1e9", "0.001 to 10 m is allowed"),
        ("resolution", "1e-12", "0.001 to 10 m is allowed"),
        ("resolution", ".inf", "is not a length"),
        ("resolution", "fine", "is not a length"),
        ("origin", "[0, 0]", "needs 3 values, has 2"),
        ("origin", "[0, 0, .nan]", "origin"),
        ("free_thresh", "0.7", "must be below occupied_thresh"),
        ("occupied_thresh", "65", "out of range"),
        ("negate", "2", "needs 0 or 1"),
        ("mode", "trinery", "did you mean 'trinary'"),
    ],
)
def test_a_wrong_value_is_named_with_its_line(tmp_path, key, value, message):
    path = write_map(tmp_path, np.zeros((2, 2, 1)), **{key: value})
    with pytest.raises(FileError, match=rf"map\.yaml:\d+:\d+: .*{message}"):
        load_map(path)


def test_a_missing_image_is_named(tmp_path):
    path = write_map(tmp_path, np.zeros((2, 2, 1)), image="gone.pgm")
    with pytest.raises(FileError, match=r"gone\.pgm: cannot be read: No such file"):
        load_map(path)


def test_a_missing_yaml_is_named(tmp_path):
    with pytest.raises(FileError, match=r"none\.yaml: cannot be read"):
        load_map(tmp_path / "none.yaml")


def test_an_image_that_is_cut_off_is_named(tmp_path):
    path = write_map(tmp_path, np.zeros((3, 4, 1)))
    image = tmp_path / "map.pgm"
    image.write_bytes(image.read_bytes()[:-1])
    with pytest.raises(FileError, match=r"map\.pgm: is cut off: 11 of 12 pixels, for 4 x 3 pixels"):
        load_map(path)


def test_a_map_longer_than_a_kilometre_is_refused(tmp_path):
    path = write_map(tmp_path, np.zeros((1, 101, 1)), resolution=10)
    with pytest.raises(FileError, match="makes the map 1010 m long; at most 1000 m"):
        load_map(path)


def png(size, lines, palette=b"", interlaced=0):
    """A PNG, grey or with a palette, that says it has this size."""

    def chunk(name, body):
        return (
            struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        )

    head = struct.pack(">IIBBBBB", *size, 8, 3 if palette else 0, 0, 0, interlaced)
    packed = zlib.compress(b"".join(b"\0" + line for line in lines))
    colours = chunk(b"PLTE", palette) if palette else b""
    parts = (chunk(b"IHDR", head), colours, chunk(b"IDAT", packed), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"P5\n2 2\n255\n\1\2\3\4\5", "holds more than its 2 x 2 pixels"),
        (b"P2\n2 2\n255\n1 2 3 4 5", "holds more than its 2 x 2 pixels"),
        (b"P2\n2 2\n255\n1 2 3", "is cut off: 3 of 4 pixels, for 2 x 2 pixels"),
        (png((2, 2), [b"\1\2"] * 3), "holds more than its 2 x 2 pixels"),
        (png((2, 2), [b"\1\2"]), "is cut off: 3 of 6 bytes"),
        (png((2**31 - 1, 2**31 - 1), [b"\1"]), "too many pixels; at most 89478485"),
    ],
)
def test_an_image_of_another_size_than_it_says_is_refused(tmp_path, data, message):
    (tmp_path / "map.pgm").write_bytes(data)
    with pytest.raises(FileError, match=message):
        read_image(tmp_path / "map.pgm")


def test_an_image_of_the_size_it_says_is_read_with_a_line_end_after_it(tmp_path):
    for data in (png((2, 2), [b"\1\2"] * 2), b"P5\n2 2\n255\n\1\2\1\2\n"):
        (tmp_path / "map.pgm").write_bytes(data)
        assert read_image(tmp_path / "map.pgm")[..., 0].tolist() == [[1, 2], [1, 2]]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is empty"),
        (b"P6\n1 1\n255\n\0\0\0", "neither PGM"),
        (b"P5\n0 4\n255\n", "no valid header with a width and height of at least 1"),
        (b"P5\n4\n", "damaged: Reached EOF while reading header"),
        (b"P5\n-4 4\n255\n", "no valid header"),
        (b"P5\n4 4\n0\n", "damaged: maxval must be greater than 0"),
        (b"P5\n99999 99999\n255\n", "too many pixels; at most 89478485"),
        (b"P5\n10000 9000\n255\n", "too many pixels; at most 89478485"),
        (b"P2\n1 2\n255\n1 x", "damaged: invalid literal for int"),
        (b"P2\n1 2\n255\n1 256", "damaged: Channel value too large"),
        (b"P5\n# no end", "damaged: Reached EOF while reading header"),
        (b"\x89PNG\r\n\x1a\n", "no valid header"),
    ],
)
def test_a_file_that_is_no_map_image_is_refused(tmp_path, data, message):
    (tmp_path / "map.pgm").write_bytes(data)
    with pytest.raises(FileError, match=message):
        read_image(tmp_path / "map.pgm")


def test_pgm_comments_text_form_and_other_depths_are_read(tmp_path):
    image = tmp_path / "map.pgm"
    image.write_bytes(b"P5 # made by hand\n2 # wide\n1\n255\n\x00\xcd")
    assert read_image(image)[..., 0].tolist() == [[0, 205]]
    image.write_bytes(b"P2\n2 1\n100\n0 50\n")
    assert read_image(image)[..., 0].tolist() == [[0, 128]]
    image.write_bytes(b"P5\n2 1\n65535\n\x00\x00\xcd\xcd")
    assert read_image(image)[..., 0].tolist() == [[0, 205]]


@settings(deadline=None, max_examples=40)
@given(
    pixels=hnp.arrays(
        np.uint8,
        st.tuples(st.integers(1, 7), st.integers(1, 7), st.sampled_from([1, 2, 3, 4])),
    )
)
def test_pixels_come_back_as_they_were_written_whatever_the_channels(tmp_path_factory, pixels):
    path = tmp_path_factory.mktemp("image") / "map.png"
    write_image(path, pixels)
    theirs = np.asarray(Image.open(path)).reshape(pixels.shape)
    assert np.array_equal(theirs, pixels)
    picture = Image.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)
    picture.save(path, optimize=True)  # chooses filters
    assert np.array_equal(read_image(path), pixels)


def test_png_filters_palettes_and_depths_are_read(tmp_path):
    path = tmp_path / "map.png"
    noise = np.random.default_rng(3).integers(0, 255, (40, 60, 3)).cumsum(axis=1).astype(np.uint8)
    Image.fromarray(noise).save(path)
    assert np.array_equal(read_image(path), noise)
    grey = Image.fromarray(noise[..., 0])
    for mode in ("1", "P"):
        grey.convert(mode).save(path)
        expected = np.asarray(grey.convert(mode).convert("L"))
        assert np.array_equal(read_image(path)[..., 0], expected)
    Image.fromarray(np.array([[0, 52685]], np.uint16)).save(path)
    assert read_image(path)[..., 0].tolist() == [[0, 205]]


def test_a_damaged_png_is_refused(tmp_path):
    path = tmp_path / "map.png"
    write_image(path, np.zeros((5, 5, 1), np.uint8))
    data = bytearray(path.read_bytes())
    data[45] ^= 1
    path.write_bytes(bytes(data))
    with pytest.raises(FileError, match=r"map\.png: is damaged: .*checksum"):
        read_image(path)
    path.write_bytes(bytes(data[:-20]))
    with pytest.raises(FileError, match=r"map\.png: is damaged: .*(checksum|Truncated)"):
        read_image(path)


def test_a_colour_that_is_not_in_the_palette_is_refused(tmp_path):
    path, palette = tmp_path / "map.png", bytes([7, 7, 7, 9, 9, 9])
    path.write_bytes(png((2, 1), [b"\0\1"], palette))
    assert read_image(path).tolist() == [[[7, 7, 7], [9, 9, 9]]]
    path.write_bytes(png((2, 1), [b"\0\2"], palette))
    with pytest.raises(FileError, match="damaged: it has colours that are not in its palette"):
        read_image(path)


def test_an_interlaced_png_is_refused(tmp_path):
    path = tmp_path / "map.png"
    path.write_bytes(png((2, 1), [b"\1\2"], interlaced=1))
    with pytest.raises(FileError, match="interlaced PNG; save it without interlacing"):
        read_image(path)


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "map.pgm")
    with pytest.raises(FileError, match="no regular file"):
        read_image(tmp_path / "map.pgm")


def test_remarks_name_what_a_person_should_look_at(tmp_path):
    free_walls = load_map(write_map(tmp_path, np.full((4, 4, 1), 205), free_thresh=0.25))
    assert any("0.196 keeps it unknown" in remark for remark in free_walls.remarks)
    assert any("no cell is occupied" in remark for remark in free_walls.remarks)
    greys = load_map(write_map(tmp_path, np.full((4, 4, 1), 150)))
    assert any("neither free nor occupied" in remark for remark in greys.remarks)
    good = load_map(write_map(tmp_path, [[[0], [254]]]))
    assert good.remarks == ()


def test_values_cannot_be_changed(tmp_path):
    map_ = load_map(write_map(tmp_path, [[[0], [254]]]))
    with pytest.raises(ValueError, match="read-only"):
        map_.values[0, 0] = 3


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no real maps in {os.fspath(DATA)}")
@pytest.mark.parametrize("name", ["ipa-apartment", "ipa-kitchen", "lse_arena", "utexas_gdc_1s"])
def test_real_maps_are_read_as_pillow_reads_their_pixels(name):
    map_ = load_map(DATA / f"{name}.yaml")
    grey = np.asarray(Image.open(DATA / f"{name}.pgm").convert("L"), np.float64)[::-1]
    share = (255.0 - grey) / 255.0
    expected = np.where(share > 0.65, 100, np.where(share < 0.196, 0, -1))
    assert np.array_equal(map_.values, expected)
    assert map_.area() > 5.0
