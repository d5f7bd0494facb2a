"""The committed results: what is said of them follows from their figures, on every page."""

import csv
import json
import math
from html import escape

import pytest

from cobodeck.paper import CONDITIONS, write_report
from cobodeck.paper.claims import claims
from cobodeck.paper.comparison import on_study
from cobodeck.paper.page import PROFILES, committed
from cobodeck.paper.tables import tables


@pytest.fixture(params=PROFILES)
def result(request):
    return committed(request.param)


@pytest.mark.requirement(128, 136, 140, 142, 143, 144)
def test_the_committed_claims_and_statistics_are_those_of_their_figures(result):
    assert result["plan"]["requests"] == 100
    assert result["claims"] == claims(result)
    assert result["statistics"]["study"] == on_study(result["conditions"])
    for name in CONDITIONS:
        run = result["conditions"][name]
        assert run["requests"] == len(run["request_list"]) == 100
        assert run["served"] == sum(asked["served"] for asked in run["request_list"])
        assert run["escapes"] == len(run["escape_list"])


@pytest.mark.requirement(140)
def test_a_claim_that_fails_has_its_measured_cause(result):
    for claim in result["claims"]:
        assert claim["ours"]
        if claim["holds"] is False:
            assert any(sign.isdigit() for sign in claim["cause"]), claim["claim"]
        else:
            assert claim["cause"] is None


@pytest.mark.requirement(135)
def test_responses_are_the_arm_and_what_goes_before_it(result):
    for name in CONDITIONS:
        for asked in result["conditions"][name]["request_list"]:
            if asked["served"]:
                assert 0.0 < asked["arm_s"] <= asked["response_s"] <= 30.0


@pytest.mark.requirement(131, 132)
def test_every_deep_is_85_cm_ahead_of_who_asks(result):
    for name in CONDITIONS:
        for asked in result["conditions"][name]["request_list"]:
            (x, y, z), (at_x, at_y, yaw) = asked["deep"], asked["user"]
            assert z == 1.5
            assert x == pytest.approx(at_x + 0.85 * math.cos(yaw), abs=1e-6)
            assert y == pytest.approx(at_y + 0.85 * math.sin(yaw), abs=1e-6)


def test_the_report_stands_alone_and_has_every_claim_and_request(result, tmp_path):
    page, requests, kept = write_report(result, [], tmp_path)
    text = page.read_text(encoding="utf-8")
    assert escape(result["machine"]["name"]) in text
    assert not any(sign in text for sign in ("<script", "src=", "href=", "http", "url("))
    assert text.count("<table>") == len(tables(result))
    for claim in result["claims"]:
        assert f"<td>{escape(claim['claim'])}</td>" in text
    with requests.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 300
    served = [float(row["response_s"]) for row in rows if row["condition"] == "chase"]
    assert sum(served) / 100 == pytest.approx(result["conditions"]["chase"]["response_s"]["mean"])
    assert json.loads(kept.read_text(encoding="utf-8")) == result
