"""Map files as people have them, made here and read by a second reader of its own.

The second reader takes pixels one by one through Pillow's `getpixel` on an RGBA image, and follows
the text of Nav2's `map_io` and of ROS 1's `map_server`.
"""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from PIL import Image

from engine.files.finding import FileError
from hw.geometry import Pose2
from states.maps.occupancy import FREE, OCCUPIED, OccupancyMap, load_map
from states.maps.rooms import SPECK_AREA, SPECK_SIDE, load_floor, tidied
from tests.repeats import examples

GREYS = (0, 50, 89, 90, 128, 205, 206, 254, 255)
KEYS = {"resolution": 0.05, "origin": "[-1.0, -2.0, 0.3]", "negate": 0, "mode": "trinary"}


def as_rgba(greys, rng):
    """An image of these greys whose pixels are partly transparent."""
    alpha = rng.choice([0, 128, 255, 255, 255], greys.shape)
    return Image.fromarray(np.stack([greys, greys, greys, alpha], -1).astype(np.uint8), "RGBA")


def clear_palette(image):
    """Sixteen greys in a palette, the third of which is transparent."""
    made = Image.fromarray(np.asarray(image)[..., 0] // 16, "P")
    made.putpalette([16 * (i // 3) for i in range(48)])
    made.info["transparency"] = 3
    return made


FORMS = {
    "l.png": lambda image: image.convert("L"),
    "la.png": lambda image: image.convert("LA"),
    "rgb.png": lambda image: image.convert("RGB"),
    "rgba.png": lambda image: image,
    "bits.png": lambda image: image.convert("L").point(lambda grey: 255 * (grey > 127), "1"),
    "palette.png": clear_palette,
    "deep.png": lambda image: Image.fromarray(np.asarray(image)[..., 0].astype(np.uint16) * 257),
    "l.bmp": lambda image: image.convert("L"),
    "rgb.bmp": lambda image: image.convert("RGB"),
    "l.pgm": lambda image: image.convert("L"),
}


def write(folder, image, name="map.png", occupied=0.65, free=0.196, **changes):
    """A map file beside an image; `image` None: the image is there already."""
    if image is not None:
        clear = {k: v for k, v in image.info.items() if k == "transparency"}
        image.save(folder / name, **clear)
    keys = {"image": name, **KEYS, "occupied_thresh": occupied, "free_thresh": free, **changes}
    text = "".join(f"{key}: {value}\n" for key, value in keys.items() if value is not None)
    (folder / "map.yaml").write_text(text)
    return folder / "map.yaml"


def read_again(path, mode, negate, occupied_from, free_to, convention):
    """The values of an image, top row first, pixel by pixel."""
    with Image.open(path) as opened:
        deep = opened.mode.startswith("I;16")
        image = Image.eval(opened, lambda v: v / 256).convert("L") if deep else opened
        image = image.convert("RGBA")
    rows = []
    for y in range(image.height):
        row = []
        for x in range(image.width):
            red, green, blue, alpha = image.getpixel((x, y))
            grey = (red + green + blue) / 3
            grey = 255 - grey if negate else grey
            occ = (255 - grey) / 255
            above = occ >= occupied_from if convention == "nav2" else occ > occupied_from
            below = occ <= free_to if convention == "nav2" else occ < free_to
            ratio = (occ - free_to) / (occupied_from - free_to)
            if mode == "raw":
                value = -1 if grey > (100 if convention == "nav2" else 254) else round(grey)
            elif alpha < 255:
                value = -1
            elif above:
                value = 100
            elif below:
                value = 0
            elif mode == "trinary":
                value = -1
            else:
                value = round(100 * ratio) if convention == "nav2" else int(99 * ratio)
            row.append(value)
        rows.append(row)
    return rows


@settings(max_examples=examples(120), deadline=None)
@given(
    form=st.sampled_from(sorted(FORMS)),
    mode=st.sampled_from(["trinary", "scale", "raw"]),
    negate=st.booleans(),
    thresholds=st.sampled_from([(0.65, 0.196), (0.65, 0.25), (1.0, 0.0), (0.5, 0.49), (0.9, 0.1)]),
    convention=st.sampled_from(["ros1", "nav2"]),
    seed=st.integers(0, 9),
)
def test_every_kind_of_image_is_read_as_by_a_second_reader(
    tmp_path_factory, form, mode, negate, thresholds, convention, seed
):
    folder = tmp_path_factory.mktemp("map")
    rng = np.random.default_rng(seed)
    image = FORMS[form](as_rgba(rng.choice(GREYS, (5, 7)), rng))
    path = write(folder, image, form, *thresholds, mode=mode, negate=int(negate))
    wanted = read_again(folder / form, mode, negate, *thresholds, convention)
    found = load_map(path, convention)
    assert found.values[::-1].tolist() == wanted
    assert found.map_from_corner == Pose2(-1.0, -2.0, 0.3)


def test_a_grey_and_a_palette_image_with_one_clear_grey_are_unknown_there(tmp_path):
    for dtype in (np.uint8, np.uint16):
        clear = 7 if dtype is np.uint8 else 7 * 257
        image = Image.fromarray(np.array([[clear, 0], [0, clear]], dtype))
        image.save(tmp_path / "map.png", transparency=clear)
        values = load_map(write(tmp_path, None)).values
        assert values.tolist() == [[100, -1], [-1, 100]]


def test_an_image_is_found_beside_by_its_whole_path_and_below_a_home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "maps").mkdir()
    image = Image.fromarray(np.array([[0, 254]], np.uint8))
    image.save(tmp_path / "maps" / "lab.png")
    for name in ("maps/lab.png", tmp_path / "maps" / "lab.png", "~/maps/lab.png"):
        assert load_map(write(tmp_path, None, name)).values.tolist() == [[100, 0]]
    with pytest.raises(FileError, match="below a home that is not known"):
        load_map(write(tmp_path, None, "~nobody-at-all/lab.png"))


def grey_image(folder, name, **options):
    Image.fromarray(np.full((40, 40), 254, np.uint8)).save(folder / name, **options)


def damaged(folder, name):
    grey_image(folder, name)
    data = (folder / name).read_bytes()
    (folder / name).write_bytes(data[: len(data) // 2])


REFUSED = {
    "jpeg": (lambda d: grey_image(d, "map.png", format="JPEG"), {}, "is a JPEG, whose compression"),
    "gif": (lambda d: grey_image(d, "map.png", format="GIF"), {}, "neither PGM .P5, P2., PNG nor"),
    "empty": (lambda d: (d / "map.png").write_bytes(b""), {}, "is empty"),
    "missing": (lambda d: None, {}, "map.png"),
    "no picture": (lambda d: (d / "map.png").mkdir(), {}, "map.png"),
    "half a BMP": (lambda d: damaged(d, "map.bmp"), {"name": "map.bmp"}, "is damaged|truncated"),
    "giant BMP": (
        lambda d: (d / "map.png").write_bytes(
            b"BM" + bytes(8) + (54).to_bytes(4, "little") + (40).to_bytes(4, "little")
            + (60000).to_bytes(4, "little") * 2 + bytes([1, 0, 8, 0]) + bytes(24)
        ),
        {}, "too many pixels",
    ),
    "giant PGM": (
        lambda d: (d / "map.png").write_bytes(b"P5 60000 60000 255\n"), {}, "too many pixels"
    ),
    "no rows": (lambda d: (d / "map.png").write_bytes(b"P5 0 0 255\n"), {}, "width and height"),
    "swapped": (None, {"occupied": 0.196, "free": 0.65}, "must be below occupied_thresh"),
    "equal": (None, {"occupied": 0.5, "free": 0.5}, "must be below occupied_thresh"),
    "out of range": (None, {"occupied": 65}, "occupied_thresh"),
    "resolution 0": (None, {"resolution": 0}, "resolution"),
    "negative": (None, {"resolution": -0.05}, "resolution"),
    "huge": (None, {"resolution": 1e9}, "resolution"),
    "not a number": (None, {"resolution": ".nan"}, "resolution"),
    "long map": (None, {"resolution": 9.9, "name": "long.png"}, "at most 1000 m"),
    "short origin": (None, {"origin": "[1.0, 2.0]"}, "origin"),
    "mode": (None, {"mode": "Scale"}, "scale"),
    "negate": (None, {"negate": 2}, "needs 0 or 1"),
    "no image": (None, {"name": None}, "image"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_with_a_sentence(tmp_path, name):
    make, changes, sentence = REFUSED[name]
    grey_image(tmp_path, "map.png") if make is None else make(tmp_path)
    Image.fromarray(np.full((1, 200), 254, np.uint8)).save(tmp_path / "long.png")
    with pytest.raises(FileError, match=sentence):
        load_map(write(tmp_path, None, **changes))


TRINARY = np.array([[0, 205, 254], [0, 254, 254]], np.uint8)


@pytest.mark.parametrize(
    ("mode", "negate", "told"),
    [
        ("scale", 0, "mode scale reads map_saver's grey for unknown as free (1 cells)"),
        ("scale", 1, "mode scale reads map_saver's grey for unknown as free (1 cells)"),
        ("raw", 0, "mode raw takes greys as values"),
        ("trinary", 0, None),
    ],
)
def test_a_mode_that_loses_what_is_unknown_is_told(tmp_path, mode, negate, told):
    pixels = 255 - TRINARY if negate else TRINARY
    map_ = load_map(write(tmp_path, Image.fromarray(pixels), mode=mode, negate=negate))
    assert [remark.startswith(told or "-") for remark in map_.remarks].count(True) == bool(told)
    assert told is not None or map_.remarks == ()


def test_a_picture_of_degrees_of_occupancy_is_not_told_off(tmp_path):
    ramp = Image.fromarray(np.arange(256, dtype=np.uint8).reshape(16, 16))
    assert load_map(write(tmp_path, ramp, mode="scale", occupied=0.9, free=0.1)).remarks == ()


def floor_with(size, *posts, side=6.0):
    """A floor of square cells, m, with posts: row, column, rows, columns in cells."""
    count = round(side / size)
    values = np.full((count, count), FREE, np.int16)
    for row, column, rows, columns in posts:
        values[row : row + rows, column : column + columns] = OCCUPIED
    return OccupancyMap(values, size, Pose2(0.0, 0.0))


@pytest.mark.parametrize("size", [0.01, 0.02, 0.05, 0.1, 0.25])
def test_specks_are_measured_in_metres_whatever_a_cell_is(size):
    """A post of 0.2 m stays; one below the size of a speck goes where cells can show it."""
    wide = max(1, round(0.2 / size))
    post = (10, 10, wide, wide)
    kept = tidied(floor_with(size, post))
    assert (kept.values[10 : 10 + wide, 10 : 10 + wide] == OCCUPIED).all()
    assert kept.remarks == ()
    line = max(1, round(0.5 / size))
    assert (tidied(floor_with(size, (10, 5, 1, line))).values == OCCUPIED).sum() == line
    fine = max(1, round(0.05 / size))
    is_speck = (fine * size) ** 2 < SPECK_AREA - 1e-9 and fine * size <= SPECK_SIDE
    small = tidied(floor_with(size, (12, 12, fine, fine)))
    assert (small.values == OCCUPIED).any() == (not is_speck)
    assert bool(small.remarks) == is_speck


def test_specks_and_loose_pieces_are_counted_and_placed(tmp_path):
    pixels = np.full((60, 80), 254, np.uint8)
    pixels[50, 10] = pixels[40, 20:22] = 0  # from the top; places count from below
    pixels[:20, 60:] = 0
    pixels[5:10, 65:75] = 254
    path = write(tmp_path, Image.fromarray(pixels), origin="[0, 0, 0]")
    remarks = load_floor(path).remarks
    assert "2 specks of at most 0.1 m left out, at (0.53, 0.48), (1.03, 0.98)" in remarks
    assert any(remark.startswith("0.13 m2 of free floor left out") for remark in remarks)


def test_a_map_without_free_cells_is_no_floor(tmp_path):
    path = write(tmp_path, Image.fromarray(np.zeros((4, 4), np.uint8)))
    assert load_map(path).values.max() == OCCUPIED
    with pytest.raises(FileError, match="no cell of the map is free"):
        load_floor(path)
