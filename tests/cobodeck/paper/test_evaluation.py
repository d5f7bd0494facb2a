"""The evaluation in its short form, and the command."""

import json

import pytest

from cobodeck.__main__ import main
from cobodeck.paper import CONDITIONS, EvaluationPlan, evaluate
from cobodeck.paper.page import committed
from cobodeck.terminal import USAGE


@pytest.mark.slow
@pytest.mark.requirement(127, 128, 130, 133)
def test_the_short_form_has_the_structure_of_the_committed_results():
    plan = EvaluationPlan(requests=7, seeds=1)
    found = evaluate(plan, {"workers": 1}, varied=((),))
    kept = committed("paper")
    assert found.keys() == kept.keys() - {"date", "machine", "versions"}
    for name in CONDITIONS:
        assert found["conditions"][name].keys() == kept["conditions"][name].keys()
        assert found["conditions"][name]["served"] == 7
    assert [claim["claim"] for claim in found["claims"]] == [
        claim["claim"] for claim in kept["claims"]
    ]
    begun = kept["conditions"]["chase"]["request_list"][:6]  # the last one's way goes on
    assert found["conditions"]["chase"]["request_list"][:6] == begun
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--parts-requests", "-1"), "0 or more"),
        (("--profile", "papr"), "papr"),
        (("--out", "."), "not an empty folder"),
    ],
)
def test_what_cannot_be_evaluated_is_said_before_anything_runs(words, told, tmp_path, capsys):
    (tmp_path / "there").touch()
    words = tuple(str(tmp_path) if word == "." else word for word in words)
    assert main(["evaluate", "paper", *words]) == USAGE
    assert told in capsys.readouterr().err
