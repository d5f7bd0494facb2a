import math
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from engine.files.finding import FileError
from hw.people.recorded.walk_file import Recording, read_recording
from hw.people.user import open_user
from hw.scene.scene import load_scene
from tests.hw.people.walks import shared

TUM = "# stamp tx ty tz qx qy qz qw\n" + "".join(
    f"{1520530962.0 + 0.1 * i:.5f} {0.1 * i:.3f} 0.0 1.2 0 0 0 1\n" for i in range(20)
)
CSV = "id,t,x,y\n1,0.0,0.0,0.0\n1,0.1,0.1,0.0\n2,0.0,5.0,5.0\n2,0.1,5.0,5.1\n"


def write(tmp_path, text, name="walk.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def straight(step_s=0.1, speed=1.0, rows=50):
    stamps = tuple(round(i * step_s * 1e9) for i in range(rows))
    return Recording("walk", stamps, tuple(speed * s * 1e-9 for s in stamps), (0.0,) * rows)


def test_a_tum_file_starts_at_zero_and_keeps_its_metres(tmp_path):
    walk = read_recording(write(tmp_path, TUM, "walk.txt"))
    assert walk.stamps_ns[0] == 0
    assert walk.stamps_ns[-1] == pytest.approx(1.9e9, abs=1e3)
    assert (walk.xs[3], walk.ys[3]) == (0.3, 0.0)


@pytest.mark.parametrize(
    ("header", "row", "scale"),
    [
        ("id,t,x,y", "{id},{t},{x},{y}", 1.0),
        ("id,t_s,x_m,y_m", "{id},{t},{x},{y}", 1.0),
        ("x_cm;y_cm;person;time_ms", "{x};{y};{id};{t}", 100.0),
        ("frame,t,x,y", "7,{t},{x},{y}", 1.0),
        ("ID,Time,X,Y,z", "{id},{t},{x},{y},0", 1.0),
    ],
)
def test_header_variants_and_units_of_csv(tmp_path, header, row, scale):
    ms = 1000.0 if "_ms" in header else 1.0
    lines = [row.format(id=4, t=0.5 * i * ms, x=i * scale, y=2 * scale) for i in range(3)]
    walk = read_recording(write(tmp_path, "\n".join([header, *lines])))
    assert walk.stamps_ns == (0, 500_000_000, 1_000_000_000)
    assert (walk.xs, walk.ys) == ((0.0, 1.0, 2.0), (2.0, 2.0, 2.0))


def test_the_tag_export_is_in_millimetres_with_the_time_of_day(tmp_path):
    text = (
        "id;x;y;z;time\n0x1;1000;500;0;2019-05-16 10:24:06.500\n"
        "0x1;2000;500;0;2019-05-16 10:24:07.000\n"
    )
    walk = read_recording(write(tmp_path, text))
    assert walk.stamps_ns == (0, 500_000_000)
    assert (walk.xs, walk.ys) == ((1.0, 2.0), (0.5, 0.5))


def test_one_person_is_chosen_by_id(tmp_path):
    path = write(tmp_path, CSV)
    assert read_recording(path, "2").xs == (5.0, 5.0)


@pytest.mark.parametrize(
    ("text", "person", "message"),
    [
        (CSV, None, "walk.csv: holds 2 people; choose one by #id: 1, 2"),
        (CSV, "3", "walk.csv: no person '3'; has 1, 2"),
        ("t,x,y\n0,0,0\n1,1,1\n", "3", "no column of persons; leave out '#3'"),
        ("id,t,x,y\n1,0.1,0,0\n1,0.0,0,0\n", None, "walk.csv:3:1: time 0.0 is not after 0.1; sort"),
        ("id,t,x,y\n1,0.1,0,0\n1,0.1,0,0\n", None, "walk.csv:3:1: time 0.1 is not after 0.1"),
        ("id,t,x,y\n1,0,0,0\n1,1,nan,0\n", None, "walk.csv:3:1: 'nan' is not a finite number"),
        ("id,t,x,y\n1,0,0,0\n1,1,1e999,0\n", None, "walk.csv:3:1: '1e999' is not a finite number"),
        ("id,t,x,y\n1,0,0,0\n1,1,1e308,0\n", None, "walk.csv:3:1: (1e+308, 0) m is too far away"),
        ("id,t,x,y\n1,0,0,0\n1,1e308,0,0\n", None, "walk.csv:3:1: 1e+308 s after the first"),
        ("id,t,x,y\n1,0,0,0\n1,one,0,0\n", None, "walk.csv:3:1: 'one' is not a number"),
        ("id,t,x,y\n1,0,0,0\n1,1,0\n", None, "walk.csv:3:1: 3 values; the header has 4"),
        ("id,t,x,y\n1,0,0,0\n", None, "walk.csv:2:1: is the only row; a walk needs at least two"),
        ("id,t,x,y\n", None, "walk.csv: holds no data"),
        ("", None, "walk.csv:1:1: no column t, x, y; the header must be like id,t,x,y"),
        ("1,0,0,0\n1,1,1,1\n", None, "walk.csv:1:1: no column t, x, y"),
        ("id,frame,x,y\n1,0,0,0\n", None, "walk.csv:1:1: no column t;"),
        ("id,t,x_ft,y\n1,0,0,0\n", None, "walk.csv:1:1: column 'x_ft': unknown unit 'ft'"),
        (b"id,t,x,y\n\xff\xfe\x00\x01", None, "walk.csv:2:1: byte 0xff is not UTF-8"),
        (b"\x00\x01\x02\x03" * 100, None, "walk.csv:1:1: no column t, x, y"),
    ],
)
def test_a_wrong_csv_is_named_with_file_and_line(tmp_path, text, person, message):
    with pytest.raises(FileError) as caught:
        read_recording(write(tmp_path, text), person)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "person", "message"),
    [
        ("0 0 0 0 0 0 0 1\n1 1 1\n", None, "walk.txt:2:1: 3 values; needs 8: stamp tx ty"),
        ("0 0 0 0 0 0 0 1\n1 a 0 0 0 0 0 1\n", None, "walk.txt:2:1: 'a' is not a number"),
        ("0 0 0 0 0 0 0 1\n\n-1 0 0 0 0 0 0 1\n", None, "walk.txt:3:1: time -1.0 is not after 0.0"),
        ("# nothing\n", None, "walk.txt: holds no data"),
        (TUM, "1", "walk.txt: a TUM file holds one person; leave out '#1'"),
    ],
)
def test_a_wrong_tum_file_is_named_with_file_and_line(tmp_path, text, person, message):
    with pytest.raises(FileError) as caught:
        read_recording(write(tmp_path, text, "walk.txt"), person)
    assert message in str(caught.value)


def test_other_forms_and_missing_files_are_named(tmp_path):
    with pytest.raises(FileError, match=r"'\.bag' is not a known format"):
        read_recording(write(tmp_path, "x", "walk.bag"))
    with pytest.raises(FileError, match="cannot be read"):
        read_recording(tmp_path / "missing.csv")


@settings(deadline=None, max_examples=200)
@given(st.binary(max_size=300))
def test_any_bytes_are_a_walk_or_a_recording_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("fuzz") / "walk.csv"
    path.write_bytes(b"id,t,x,y\n" + data)
    try:
        path_named = read_recording(path).name
    except FileError as failure:
        path_named = str(failure)
    assert "walk.csv" in path_named


place = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-7, 7))


@settings(deadline=None, max_examples=100)
@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=2, max_size=20), place)
def test_the_middle_goes_to_the_place_and_every_distance_is_kept(points, where):
    x, y, yaw = where
    walk = Recording(
        "w", tuple(range(len(points))), tuple(p[0] for p in points), tuple(p[1] for p in points)
    )
    cx, cy = walk.middle
    placed = walk.placed(x, y, yaw)
    for (px, py), qx, qy in zip(points, placed.xs, placed.ys, strict=True):
        turned = complex(px - cx, py - cy) * complex(math.cos(yaw), math.sin(yaw))
        assert qx == pytest.approx(x + turned.real, abs=1e-9)
        assert qy == pytest.approx(y + turned.imag, abs=1e-9)


def test_turned_by_nothing_the_box_has_its_middle_at_the_place():
    walk = Recording("w", (0, 1, 2), (0.0, 4.0, 1.0), (0.0, 1.0, 2.0)).placed(3.0, -1.0, 0.0)
    assert walk.middle == pytest.approx((3.0, -1.0))
    assert walk.size == pytest.approx((4.0, 2.0))


def test_a_stretched_walk_has_the_wanted_box_and_the_same_speeds():
    walk = straight()
    longer = walk.stretched(8.0)
    assert max(longer.size) == pytest.approx(8.0)
    assert longer.motion()[1][10] == pytest.approx(walk.motion()[1][10])


def test_a_person_who_never_moves_cannot_be_stretched():
    with pytest.raises(FileError, match="never moves"):
        Recording("w", (0, 1), (1.0, 1.0), (2.0, 2.0)).stretched(8.0)


def test_the_heading_is_the_direction_of_travel():
    walk = straight().placed(0.0, 0.0, 2.5)
    headings, speeds = walk.motion()
    assert headings == pytest.approx([2.5] * 50)
    assert speeds == pytest.approx([1.0] * 50)


def test_the_heading_is_held_while_the_person_stands_and_known_before_the_first_step():
    still, step = (0.0,) * 20, tuple(0.1 * i for i in range(20))
    ys = still + step + (step[-1],) * 20
    walk = Recording("w", tuple(i * 100_000_000 for i in range(60)), (0.0,) * 60, ys)
    headings, speeds = walk.motion()
    assert headings == pytest.approx([math.pi / 2] * 60)
    assert (speeds[5], speeds[55]) == (0.0, 0.0)
    assert speeds[30] == pytest.approx(1.0)


def test_gaps_are_named_by_their_ends():
    walk = straight()
    keep = [i for i in range(50) if not 10 < i < 30]
    cut = Recording(
        "w", *(tuple(col[i] for i in keep) for col in (walk.stamps_ns, walk.xs, walk.ys))
    )
    assert walk.gaps() == ()
    assert cut.gaps() == ((1_000_000_000, 3_000_000_000, "drop-out"),)


@pytest.mark.requirement(24)
@pytest.mark.parametrize(
    ("name", "person", "rows", "seconds"),
    [
        ("tum_room3.txt", None, 15200, 141.0),
        ("juelich_people.csv", "9", 943, 37.7),
        ("sdu_uwb.csv", None, 827, 186.5),
    ],
)
def test_real_recordings_are_read(name, person, rows, seconds):
    walk = read_recording(shared(name), person)
    assert len(walk.xs) == rows
    assert walk.duration_ns * 1e-9 == pytest.approx(seconds, abs=0.1)


def test_the_drop_out_of_two_seconds_in_a_real_walk_is_found():
    longest = max(read_recording(shared("tum_room3.txt")).gaps(), key=lambda gap: gap[1] - gap[0])
    assert (longest[1] - longest[0]) * 1e-9 == pytest.approx(1.99, abs=0.01)


def circle(up: str) -> list[tuple[float, float, float, float]]:
    """A circle walked counter-clockwise seen from above, head at 1.7 m: t, x, y, z in a frame."""
    rows = []
    for i in range(60):
        angle = 0.1 * i
        x, y, height = 2.0 * math.cos(angle), 3.0 + 2.0 * math.sin(angle), 1.7 + 0.02 * (i % 3)
        place = {"z": (x, y, height), "y": (x, height, y), "y-right": (x, height, -y)}[up]
        rows.append((0.2 * i, *place))
    return rows


WRITTEN = {
    "walk.csv": ("t,x,y,z\n", "{},{},{},{}\n"),
    "cm.csv": ("id;t_ms;x_cm;y_cm;z_cm\n", "7;{0};{1};{2};{3}\n"),
    "walk.txt": ("# TUM\n", "{} {} {} {} 0 0 0 1\n"),
}


def written(folder: Path, name: str, up: str) -> Path:
    head, line = WRITTEN[name]
    scale = (1000.0, 100.0, 100.0, 100.0) if name == "cm.csv" else (1.0,) * 4
    rows = [line.format(*(a * b for a, b in zip(row, scale, strict=True))) for row in circle(up)]
    return write(folder, head + "".join(rows), name)


@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.parametrize("up", ["z", "y", "y-right"])
def test_a_circle_turns_the_same_way_whatever_axis_is_up(tmp_path, name, up):
    walk = read_recording(written(tmp_path, name, up), up=up)
    plain = [row[1:3] for row in circle("z")]
    assert list(zip(walk.xs, walk.ys, strict=True)) == [pytest.approx(place) for place in plain]


@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.parametrize("up", ["y", "y-right"])
def test_a_walk_whose_y_is_a_height_is_told(tmp_path, name, up):
    path = written(tmp_path, name, up)
    with pytest.raises(FileError, match=r"like a head's height.*`--up y` reads x, z"):
        read_recording(path)
    assert read_recording(path, up="z").size[1] < 0.1


def test_a_walk_along_x_with_a_head_that_bends_down_is_not_told_off(tmp_path):
    rows = "".join(f"{0.5 * i},{0.4 * i},1.5,{1.7 - 0.9 * (i == 3)}\n" for i in range(8))
    assert read_recording(write(tmp_path, "t,x,y,z\n" + rows)).size == pytest.approx((2.8, 0.0))


def test_only_the_axes_on_the_floor_are_needed(tmp_path):
    flat = write(tmp_path, "t,x,z\n0,1,2\n1,1,3\n", "flat.csv")
    assert read_recording(flat, up="y").ys == (2.0, 3.0)
    with pytest.raises(FileError, match="no column y; the header must be like id,t,x,y"):
        read_recording(flat)
    odd = write(tmp_path, "t,x,y,z_ft\n0,1,2,-\n1,1,3,-\n", "odd.csv")
    assert read_recording(odd).ys == (2.0, 3.0)
    with pytest.raises(FileError, match=r"no column z|unknown unit 'ft'"):
        read_recording(odd, up="y")


def test_a_script_has_no_axis_that_is_up():
    with pytest.raises(FileError, match="only a recording has an axis"):
        open_user("demo", load_scene("study"), up="y")
