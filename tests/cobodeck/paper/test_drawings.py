"""Figures 8 to 10, drawn from short records."""

import math
from itertools import pairwise

import pytest
from PIL import Image

from cobodeck.campaign import run_cell
from cobodeck.paper import EvaluationPlan, draw_figures
from cobodeck.paper.drawings import _draw_way
from cobodeck.pictures.drawing import sheet
from cobodeck.pictures.run import course_of
from cobodeck.record.read import Record


@pytest.mark.slow
@pytest.mark.requirement(134, 141)
def test_figures_are_drawn_from_records(tmp_path):
    """The way that is drawn is as long as the one that the base has driven."""
    cell, record = EvaluationPlan(requests=1).cell("corner"), tmp_path / "corner.mcap"
    figures = run_cell(cell, record) | {
        "planner": "exact", "local_planner": "profile", "localizer": "ideal pose",
    }  # fmt: skip
    on = sheet((0.0, 0.0, 11.5, 10.1), "", [])
    _draw_way(on, course_of(Record(record)))
    drawn = sum(math.dist(a, b) for a, b in pairwise(on.axes.lines[0].get_xydata().tolist()))
    assert drawn == pytest.approx(figures["distance_m"], rel=0.01)

    conditions = dict.fromkeys(("chase", "corner", "center"), figures)
    files = draw_figures(
        {"conditions": conditions}, {"corner": record}, tmp_path, lambda text, share: None
    )
    assert [file.name for file in files] == ["figure_8_corner.png", "figure_9.png", "figure_10.png"]
    for file in files:
        with Image.open(file) as picture:
            picture.verify()
