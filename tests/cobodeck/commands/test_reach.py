"""`cobodeck reach`: the table of reach by height, with other props, and bad input."""

import json

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK, USAGE

STICK = """
prop: stick
mass: 0.5
tcp: {xyz: [0, 0, 0.4], rpy: [0, 1.5707963267948966, 0]}
capsules:
  - {start: [0, 0, 0.03], end: [0, 0, 0.2], radius: 0.02}
parked: [-2.95, -1.0, -1.94, -3.12, -2.28, 2.21]
"""


def told(capsys, *arguments, code=OK):
    assert main(["reach", *arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def shares(found):
    return {(row["height_m"], row["distance_m"]): round(7 * row["share"]) for row in found["rows"]}


@pytest.mark.requirement(147)
def test_the_papers_heights_are_reached_from_a_metre_and_higher_ones_from_nearer(capsys):
    found = shares(told(capsys, "--height", "0.5:1.7:1.1", "--distance", "0.8:1.0:0.2"))
    assert found == {(0.5, 0.8): 7, (0.5, 1.0): 7, (1.6, 0.8): 7, (1.6, 1.0): 3}


@pytest.mark.requirement(147)
def test_the_band_of_heights_is_told_by_distance(capsys):
    found = told(capsys, "--height", "1.3:1.8", "--distance", "0.8:1.2:0.4")
    assert found["reached_m"] == {"0.8": [1.3, 1.8], "1.2": [1.3, 1.4]}


@pytest.mark.requirement(150)
def test_a_longer_prop_reaches_where_the_shipped_one_does_not(capsys):
    short = told(capsys, "--height", "1.3", "--distance", "1.2")
    longer = told(capsys, "--height", "1.3", "--distance", "1.2", "--tool", "0.35")
    assert short["rows"][0]["share"] < longer["rows"][0]["share"]


def test_the_shipped_prop_by_its_length_is_the_shipped_prop(capsys):
    asked = ("--height", "0.4:1.6:0.3", "--distance", "1.0")
    assert told(capsys, *asked) == told(capsys, *asked, "--tool", "0.15")


@pytest.mark.requirement(150)
def test_a_prop_of_ones_own_is_read_from_its_file(capsys, tmp_path):
    file = tmp_path / "stick.yaml"
    file.write_text(STICK)
    found = told(capsys, "--height", "1.5", "--distance", "1.2", "--tool", str(file))
    assert (found["tool"], found["tool_length_m"]) == ("stick", 0.4)
    assert found["rows"][0]["share"] > 0.0


@pytest.mark.requirement(78, 147, 150)
def test_a_longer_prop_and_a_higher_mount_reach_higher(capsys):
    asked = ("--height", "1.5:2.0", "--distance", "1.0")
    highest = {
        name: told(capsys, *asked, *more)["reached_m"]["1"][1]
        for name, more in {
            "own": (), "long": ("--tool", "long"), "plus": ("--robot", "rbkairos_plus_ur10"),
        }.items()
    }  # fmt: skip
    assert highest == {"own": 1.6, "long": 1.7, "plus": 1.8}


@pytest.mark.requirement(79)
def test_a_tolerance_of_the_rover_takes_reach(capsys):
    exact = told(capsys, "--height", "1.3", "--distance", "1.0")
    drifting = told(capsys, "--height", "1.3", "--distance", "1.0", "--tolerance", "0.2")
    assert drifting["rows"][0]["share"] < exact["rows"][0]["share"] == 1.0


def test_nothing_reached_is_a_finding(capsys):
    assert not any(row["share"] for row in told(capsys, "--height", "2.5", code=FAILED)["rows"])


@pytest.mark.requirement(147)
def test_table_and_picture_have_a_row_for_each_height_highest_first(capsys, tmp_path):
    file = tmp_path / "reach.svg"
    code = main(["reach", "--height", "1.5:1.7", "--distance", "1.0", "-o", str(file)])
    out = capsys.readouterr().out
    assert code == OK
    assert [line.split()[0] for line in out.splitlines()[3:6]] == ["1.70", "1.60", "1.50"]
    assert "3/7" in out
    drawn = file.read_text()
    assert all(words in drawn for words in ("3/7", "5/7", "0/7", "paper: up to 1.6 m"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--height", "high"), "no length"),
        (("--height", "nan"), "no length"),
        (("--height", "1.6:0.5"), "does not go upwards"),
        (("--distance", "0"), "above 0 m"),
        (("--height", "0.1:9:0.001"), "more than 1000 values"),
        (("--tolerance=-1",), "0 m or more"),
        (("--tool", "stick.yaml"), "stick.yaml: cannot be read"),
        (("--tool", "lng"), "did you mean 'long'"),
        (("--robot", "rbkairos_plus"), "did you mean 'rbkairos_plus_ur10'"),
        (("--tool=-0.1",), "longer than 0 m"),
        (("-o", "reach.txt"), "unknown form"),
    ],
)
def test_wrong_input_is_named(capsys, arguments, words):
    assert main(["reach", *arguments]) == USAGE
    assert words in capsys.readouterr().err
