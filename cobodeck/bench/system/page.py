"""What `cobodeck/campaign/PRECISION.md` says of the committed results."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from operator import itemgetter
from pathlib import Path
from typing import Any

from cobodeck.bench.table import machine_text
from cobodeck.markdown import markdown_table

RESULTS = Path(__file__).parents[2] / "campaign" / "results"
Compared = Mapping[str, Any]
"""A knob with its values, as `comparison.compared` gives it."""
_BREAK = "\n"
_CHANGES = {"response_s": 2, "escapes_per_request": 2, "least_gap_m": 3}
"""Which differences are told, and their decimals."""


def precision_block() -> str:
    """What each value costs, and how its runs differ from ours."""
    head = ("", "value", "CPU, ms per s", "to ours", "response, s", "Escapes per request",
            "least gap, m", "prop, mm", "pose, mm")  # fmt: skip
    result = _committed("precision")
    lines = (line for knob in result["knobs"] for line in _precision_lines(knob))
    return f"{markdown_table(head, lines)}\n\n{_made(result)}"


def disturbed_block() -> str:
    """Up to where the robot touches nobody, and where the rest is worst."""
    head = ("", "no touch by the robot", "bound", "as many served", "Escapes per request",
            "any touch", "hardest, m/s", "stopped", "Escapes failed", "unserved")  # fmt: skip
    result = _committed("disturbed")
    return f"{markdown_table(head, map(_holds, result['knobs']))}\n\n{_made(result)}"


def keys_block() -> str:
    """What each value of a key comes to; empty as long as nothing has been measured."""
    if not (RESULTS / "keys.json").is_file():
        return ""
    head = ("key", "value", "response, s", "Escapes per request", "runs with a touch",
            "3 to 4 m away", "driven, m a minute", "unserved")  # fmt: skip
    result = _committed("keys")
    lines = (line for knob in result["knobs"] for line in _key_lines(knob))
    pictures = (
        "![Response, Escapes, touches, gaps, distance and way over six keys](results/keys_1.svg)\n"
        "![… and over the other six](results/keys_2.svg)"
    )
    return f"{pictures}\n\n{markdown_table(head, lines)}\n\n{_made(result)}"


def _key_lines(knob: Compared) -> Iterator[tuple[str, ...]]:
    for number, row in enumerate(knob["values"]):
        value = f"**{row['value']}**" if row["value"] == knob["ours"] else row["value"]
        means, shares = row["means"], row["shares"]
        yield (
            "" if number else f"`{knob['title'].replace(_BREAK, '')}`",
            value,
            _bounded(means["response_s"]),
            _bounded(means["escapes_per_request"]),
            f"{shares['touched']['hits']} of {shares['touched']['of']}",
            _bounded(means["beside_share_3_4"]),
            _plain(means["travelled_m"]),
            f"{shares['unserved']['hits']} of {shares['unserved']['of']}",
        )


def _bounded(mean: Mapping[str, float] | None) -> str:
    if mean is None:
        return "–"
    return f"{mean['mean']:.2f} [{mean['low']:.2f}, {mean['high']:.2f}]"


def _committed(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    return found


def _precision_lines(knob: Compared) -> Iterator[tuple[str, ...]]:
    for number, row in enumerate(knob["values"]):
        ours = row["value"] == knob["ours"]
        yield (
            "" if number else knob["title"],
            f"**{row['value']}**" if ours else row["value"],
            f"{row['cpu_ms_per_s']:.1f}",
            f"{row['cpu_ratio']:.2f}",
            *(_own(row, name) if ours else _changed(row, name) for name in _CHANGES),
            *(_plain(row["means"][name]) for name in ("prop_error_mm", "pose_error_mm")),
        )


def _plain(mean: Mapping[str, float] | None) -> str:
    return "–" if mean is None else f"{mean['mean']:.1f}"


def _own(row: Mapping[str, Any], name: str) -> str:
    mean = row["means"][name]
    return "–" if mean is None else f"**{mean['mean']:.{_CHANGES[name]}f}**"


def _changed(row: Mapping[str, Any], name: str) -> str:
    change, places = row["differences"][name], _CHANGES[name]
    if change is None:
        return "–"
    return (
        f"{change['mean']:+.{places}f} [{change['low']:+.{places}f}, {change['high']:+.{places}f}]"
    )


def _holds(knob: Compared) -> tuple[str, ...]:
    values = knob["values"]
    held = list(takewhile(lambda row: not row["shares"]["touched_by_robot"]["hits"], values))
    bound = held[-1]["shares"]["touched_by_robot"]["high"] if held else 1.0
    hardest = max((row["impact_m_s"] for row in values if row["impact_m_s"]), default=None)
    return (
        knob["title"],
        f"to {held[-1]['value']}" if held else "nowhere",
        f"≤ {100.0 * bound:.0f} %",
        _served(values),
        _most_escapes(values),
        _worst(values, "touched"),
        "–" if hardest is None else f"{hardest:.1f}",
        *(_worst(values, name) for name in ("stopped", "escapes_failed", "unserved")),
    )


def _served(values: Sequence[Mapping[str, Any]]) -> str:
    """Up to where the same people are served as often, as far as can be told."""
    changes = [(row["differences"]["served"], row["value"]) for row in values]
    if any(change is None for change, _ in changes):
        return "–"
    held = list(takewhile(lambda found: found[0]["high"] >= 0.0, changes))
    return f"to {held[-1][1]}" if held else "nowhere"


def _most_escapes(values: Sequence[Mapping[str, Any]]) -> str:
    found = [(row["means"]["escapes_per_request"], row["value"]) for row in values]
    most, value = max((mean["mean"], value) for mean, value in found if mean is not None)
    return f"{most:.1f} at {value}"


def _worst(values: Sequence[Mapping[str, Any]], name: str) -> str:
    """The first value at which the largest share is; "0" if it is nowhere above 0."""
    shares = [(row["shares"][name], row["value"]) for row in values]
    told = [(share["hits"] / share["of"], share, value) for share, value in shares if share]
    if not any(part for part, _, _ in told):
        return "0"
    _, share, value = max(told, key=itemgetter(0))
    return f"{share['hits']} of {share['of']} at {value}"


def _made(result: Mapping[str, Any]) -> str:
    runs = [row["runs"] for knob in result["knobs"] for row in knob["values"]]
    return f"{sum(runs)} runs, {min(runs)} to {max(runs)} of each value. {machine_text(result)}"
