"""The committed results: their claims, and what pages say of them.

`python -m cobodeck.paper.page` judges the claims anew, from the figures; `make figures` writes the
pages.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from cobodeck.markdown import markdown_table
from cobodeck.paper.claims import claims, contact_counts, safe_times
from cobodeck.paper.conditions import CONDITIONS
from cobodeck.paper.published import ARM, KRUSKAL_WALLIS_H, REQUESTS, TABLE_2, TO_SAFETY

RESULTS = Path(__file__).with_name("results")
PROFILES = ("paper", "tuned")
HEAD = ("", "the paper", *(f"profile `{profile}`" for profile in PROFILES))
Result = Mapping[str, Any]
Cells = tuple[str, ...]


def committed(profile: str) -> dict[str, Any]:
    """The committed result of a profile."""
    found: dict[str, Any] = json.loads(_file(profile).read_text(encoding="utf-8"))
    return found


def judge_anew(profile: str) -> None:
    """Replace the claims of a committed result by those of its figures."""
    found = committed(profile)
    judged = found | {"claims": claims(found)}
    _file(profile).write_text(f"{json.dumps(judged)}\n", encoding="utf-8")


def _file(profile: str) -> Path:
    return RESULTS / f"{profile}.json"


def paper_block() -> str:
    """Table 2, and what else the paper's claims rest on: its figures, and ours by both profiles."""
    results = [committed(profile) for profile in PROFILES]
    lines = [*_conditions(results), *_others(results)]
    return f"{markdown_table(HEAD, lines)}\n\nMeasured on {results[0]['date']}."


def paper_in_short() -> str:
    """Table 2 in a row for each condition, and how many requests were served."""
    results = [committed(profile) for profile in PROFILES]
    head = ("a request's response (SD), way, Escapes", *HEAD[1:])
    lines = [
        _row(
            name,
            f"{printed.mean_s:.2f} ({printed.sd_s:.2f}) s, {printed.distance_m / REQUESTS:.1f} m, "
            f"{printed.escapes / REQUESTS:.2f}",
            (_in_short(found["conditions"][name]) for found in results),
        )
        for name, printed in TABLE_2.items()
    ]
    return markdown_table(head, [*lines, _all_served(results)])


def _conditions(results: Sequence[Result]) -> Iterator[Cells]:
    for name in CONDITIONS:
        printed = TABLE_2[name]
        yield _row(
            f"{name}: response, s (SD)",
            f"{printed.mean_s:.2f} ({printed.sd_s:.2f})",
            (_spread(found["conditions"][name]["response_s"]) for found in results),
        )
        yield _row(
            "… way per request, Escapes in 100 requests",
            f"{printed.distance_m / REQUESTS:.1f} m, {printed.escapes}",
            (_per_request(found["conditions"][name]) for found in results),
        )


def _all_served(results: Sequence[Result]) -> Cells:
    return _row("served", "300 of 300", map(_served, results))


def _others(results: Sequence[Result]) -> Iterator[Cells]:
    yield _all_served(results)
    arm = f"{ARM.mean:.2f} ({ARM.sd:.2f})"
    arms = (_spread(found["conditions"]["chase"]["arm_s"]) for found in results)
    yield _row("the arm in chase, s (SD)", arm, arms)
    yield _row("time to safety, s", f"{TO_SAFETY.mean:.2f}", map(_to_safety, results))
    study = (contact_counts(found["conditions"]) for found in results)
    yield _row("contacts in requests", "no Escape failed", study)
    routes = (contact_counts(found["statistics"]["routes"]["conditions"]) for found in results)
    yield _row("… on random routes", "–", routes)
    yield _row("Kruskal-Wallis, H(2)", f"{KRUSKAL_WALLIS_H}", map(_h, results))
    for pair in ("corner - chase", "center - chase"):
        yield _row(f"response on random routes, {pair}, s", "–", (_gap(f, pair) for f in results))
    yield _row("claims that hold", "all", map(_held, results))


def _row(about: str, printed: str, ours: Iterable[str]) -> Cells:
    return (about, printed, *ours)


def _spread(values: Mapping[str, float]) -> str:
    return f"{values['mean']:.2f} ({values['sd']:.2f})"


def _per_request(run: Mapping[str, Any]) -> str:
    escapes = 100.0 * run["escapes"] / run["requests"]
    return f"{run['distance_m'] / run['requests']:.1f} m, {escapes:.0f}"


def _in_short(run: Mapping[str, Any]) -> str:
    requests = run["requests"]
    way, escapes = run["distance_m"] / requests, run["escapes"] / requests
    return f"{_spread(run['response_s'])} s, {way:.1f} m, {escapes:.2f}"


def _served(result: Result) -> str:
    runs = result["conditions"].values()
    return f"{sum(run['served'] for run in runs)} of {sum(run['requests'] for run in runs)}"


def _to_safety(result: Result) -> str:
    times = safe_times(result)
    return f"{sum(times) / len(times):.2f} (n = {len(times)})" if times else "no Escape"


def _h(result: Result) -> str:
    test = result["statistics"]["study"]["kruskal_wallis"]
    return "–" if test is None else f"{test['h']:.2f}"


def _gap(result: Result, pair: str) -> str:
    """A mean difference with its 95 % bounds."""
    gap = result["statistics"]["routes"]["differences"][pair]["response_s"]
    return f"{gap['mean']:.2f} ({gap['low']:.2f} to {gap['high']:.2f})"


def _held(result: Result) -> str:
    held = [claim["holds"] for claim in result["claims"]]
    return f"{held.count(True)} of {len(held)}"


if __name__ == "__main__":
    for name in PROFILES:
        judge_anew(name)
