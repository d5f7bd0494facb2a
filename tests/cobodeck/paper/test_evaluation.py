"""The evaluation in its short form, and the command."""

import json

import pytest

from cobodeck.__main__ import main
from cobodeck.paper import CONDITIONS, EvaluationPlan, evaluate
from cobodeck.paper.page import committed
from cobodeck.terminal import OK, USAGE


@pytest.mark.slow
@pytest.mark.requirement(127, 128, 130, 133)
def test_the_short_form_has_the_structure_of_the_committed_results():
    plan = EvaluationPlan(requests=7, seeds=1)
    found = evaluate(plan, {"workers": 1}, varied=((),))
    kept = committed("paper")
    assert found.keys() == kept.keys() - {"date", "machine", "versions"}
    for name in CONDITIONS:
        assert found["conditions"][name].keys() >= kept["conditions"][name].keys()  # newer figures
        assert found["conditions"][name]["served"] == 7
    assert [claim["claim"] for claim in found["claims"]] == [
        claim["claim"] for claim in kept["claims"]
    ]
    begun = kept["conditions"]["chase"]["request_list"][:6]  # the last one's way goes on
    assert found["conditions"]["chase"]["request_list"][:6] == begun
    json.dumps(found, allow_nan=False)


@pytest.mark.slow
def test_runs_that_are_kept_are_not_run_again(tmp_path, capsys):
    """As after an end before the last run: the same command runs that one, and reports the same."""
    words = ["evaluate", "paper", "--requests", "1", "--no-varied", "--workers", "1", "--json"]
    words += ["--seeds", "1", "--out", str(tmp_path)]
    assert main(words) == OK
    first = json.loads(capsys.readouterr().out)
    assert first["causes"] == []

    store = tmp_path / "runs" / "cells.jsonl"
    *kept, last = store.read_bytes().splitlines(keepends=True)
    assert len(kept) == 5
    store.write_bytes(b"".join(kept))
    (tmp_path / "chase.mcap").rename(tmp_path / "chase.mcap.part")
    assert main(words) == OK
    assert json.loads(capsys.readouterr().out) == first
    assert json.loads((tmp_path / "result.json").read_text(encoding="utf-8")) == first
    *still, again = store.read_bytes().splitlines(keepends=True)
    assert still == kept
    assert json.loads(again)["address"] == json.loads(last)["address"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--parts-requests", "-1"), "0 or more"),
        (("--profile", "papr"), "papr"),
        (("--out", "."), "neither an empty folder"),
    ],
)
def test_what_cannot_be_evaluated_is_said_before_anything_runs(words, told, tmp_path, capsys):
    (tmp_path / "there").touch()
    words = tuple(str(tmp_path) if word == "." else word for word in words)
    assert main(["evaluate", "paper", *words]) == USAGE
    assert told in capsys.readouterr().err
