"""`cobodeck localize`, from the command line."""

import csv
import json
import math
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK, USAGE
from states.maps.occupancy import load_map
from tests.cobodeck.logs.drives import carmen, world_of_one

JACKAL = Path(__file__).resolve().parents[4] / "shared/data/ekf/test2.bag.gz"


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "drive.log"
    path.write_text(carmen(world_of_one(), corrected=True))
    return path


def told(capsys, *words):
    code = main(["localize", *map(str, words)])
    return code, capsys.readouterr()


def test_a_log_alone_is_mapped_and_scored(log, tmp_path, capsys):
    files = [tmp_path / name for name in ("way.csv", "map.yaml", "way.png")]
    code, said = told(capsys, log, "--csv", files[0], "--save-map", files[1], "-o", files[2])

    assert code == OK
    assert "of its scans, by its corrected poses, 0.05 m" in said.out or "every other" in said.out
    assert "against corrected poses" in said.out
    assert all(str(file) in said.out for file in files)
    rows = list(csv.DictReader(files[0].read_text().splitlines()))
    assert {"t", "x", "y", "yaw", "status", "wall"} <= set(rows[0])
    assert math.isfinite(float(rows[-1]["x"]))
    assert load_map(files[1]).area(100) > 0.5
    assert files[2].read_bytes().startswith(b"\x89PNG")


def test_figures_are_json(log, capsys):
    code, said = told(capsys, log, "--json", "--seed", "3")
    figures = json.loads(said.out)

    assert code == OK
    assert figures["seed"] == 3
    assert figures["errors"]["position_rmse_m"] < 0.12  # this format has no times of beams
    assert len(figures["trajectory"]) == figures["scans"]
    assert set(figures["trajectory"][0]) == {"t", "pose", "sigma", "status", "wall_m", "error"}


@pytest.mark.slow
def test_a_map_that_was_saved_is_localized_in(log, tmp_path, capsys):
    told(capsys, log, "--save-map", tmp_path / "map.yaml")
    for where in (["--global"], ["--start", "2,2,0.5"], []):
        code, said = told(capsys, log, "--map", tmp_path / "map.yaml", "--json", *where)
        figures = json.loads(said.out)

        assert code == OK
        assert figures["split"] is None
        assert figures["start"] == ([2.0, 2.0, 0.5] if "2,2,0.5" in where else None)


def test_scans_that_see_nothing_find_nothing(tmp_path, capsys):
    blind = " ".join(["99"] * 181)
    lines = [f"FLASER 181 {blind} {n} 0 0 {n} 0 0 {n} host {n}" for n in range(1, 9)]
    path = tmp_path / "blind.log"
    path.write_text("\n".join(lines))
    code, said = told(capsys, path, "--map", "hall", "--json")

    assert code == FAILED
    assert json.loads(said.out)["without_pose"] == 8


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nowhere.log"], "nowhere.log: cannot be read: No such file or directory"),
        (["{log}", "--map", "nowhere"], "nowhere"),
        (["{log}", "--map", "{log}"], "drive.log"),
        (["{log}", "--start", "1,2"], "'1,2' is no pose: x,y in m and yaw in rad, as 1.5,-2,0.3"),
        (["{log}", "--start", "1,2,nan"], "'1,2,nan' is no pose"),
        (["{log}", "--start", "0,0,0", "--global"], "not allowed with"),
        (["{log}", "--save-map", "x.png"], "does not end in .yaml"),
        (["{log}", "--map", "hall", "--save-map", "x.yaml"], "scene hall is no map of scans"),
        (["{log}", "-o", "x.doc"], "unknown form"),
        (["{log}", "--resolution", "-1"], "is not above 0 m"),
    ],
)
def test_what_is_wrong_is_told(log, tmp_path, monkeypatch, capsys, words, complaint):
    monkeypatch.chdir(tmp_path)
    code, said = told(capsys, *(word.format(log=log) for word in words))

    assert code in (FAILED, USAGE)
    assert complaint in said.err
    assert "Traceback" not in said.err


@pytest.mark.skipif(not JACKAL.is_file(), reason="needs ../shared/data/ekf")
def test_wheels_and_inertial_sensor_alone_end_where_they_should(capsys):
    code, said = told(capsys, JACKAL, "--json")
    figures = json.loads(said.out)

    assert code == OK
    assert math.dist(figures["final_position_m"], (1.0206, 3.4292, 0.7419)) < 0.1383
    assert figures["way_m"] == pytest.approx(84.2, abs=0.1)
    assert told(capsys, JACKAL)[0] == OK
    assert told(capsys, JACKAL, "--map", "hall")[1].err.count("nothing for --map") == 1
