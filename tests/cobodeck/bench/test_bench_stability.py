"""The committed curves of numerical stability: what they claim, and that they can be made again."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.bench import stability
from cobodeck.bench.result import read_result
from cobodeck.terminal.console import OK

COMMITTED = Path(stability.__file__).parent / "results" / "stability.json"
ROWS: list[dict[str, Any]] = read_result(COMMITTED)["rows"]


def errors(knob: str, name: str, variant: str = "cobodeck") -> dict[float, float]:
    return {
        row["value"]: row["error"]
        for row in ROWS
        if (row["knob"], row["name"], row["variant"]) == (knob, name, variant)
    }


@pytest.mark.parametrize("name", ["path", "scan match", "filter", "velocity"])
def test_errors_grow_with_the_offset_as_float64_does(name: str) -> None:
    found = errors("offset_m", name)

    assert len(found) == len(stability.OFFSETS_M)
    for offset, error in found.items():
        assert error <= 20.0 * math.ulp(offset)


def test_speeds_do_not_depend_on_the_stamp() -> None:
    assert len(set(errors("stamp_s", "speed by wheels").values())) == 1
    assert max(errors("stamp_s", "speed by wheels", "float64 stamps").values()) > 1e-5


def test_errors_of_steps_grow_no_faster_than_their_number() -> None:
    found = errors("steps", "composed steps")

    assert all(error <= 1e-15 * steps for steps, error in found.items())


@pytest.mark.parametrize("name", ["wrist", "elbow"])
def test_the_nearer_a_singularity_the_larger_the_condition_and_the_tool_is_exact(name: str) -> None:
    knob = "from_singular_rad"
    conditions = errors(knob, f"{name}, Jacobian")

    assert list(conditions.values()) == sorted(conditions.values(), reverse=True)
    assert max(conditions.values()) > 1e12
    assert max(errors(knob, f"{name}, tool").values()) < 1e-15
    assert max(errors(knob, f"{name}, tool", "float32").values()) < 1e-6


def test_a_corridor_is_open_along_it_and_a_filter_keeps_what_it_is_told() -> None:
    assert max(errors("angle_rad", "walls of a corridor, match").values()) == stability.NOTHING
    assert max(errors("variance_ratio", "filter, constant pose").values()) < 1e-6


@pytest.mark.slow
def test_the_curves_are_made_again_and_drawn(tmp_path: Path) -> None:
    again = {(row.name, row.variant, row.value) for row in stability.rows()}
    assert again == {(row["name"], row["variant"], row["value"]) for row in ROWS}
    assert all(math.isfinite(row.error or 0.0) for row in stability.rows())
    picture = tmp_path / "stability.svg"
    assert main(["bench", "--show", str(COMMITTED), "-o", str(picture)]) == OK
    assert picture.read_text().count("condition number") >= 3
