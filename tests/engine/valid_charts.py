"""Random valid charts, for tests that compare the engine with something else."""

from __future__ import annotations

from typing import Any

import yaml
from hypothesis import strategies as st

LEAVES = {"Do": ("done", "failed", "other"), "See": ("seen", "lost")}


@st.composite
def chart_texts(draw: st.DrawFn, timeouts: bool = False, depth: int = 3) -> str:
    """The YAML text of a chart over `Do` and `See` without mistakes."""
    form = draw(st.sampled_from(("states", "any", "all")))
    chart = {"chart": "c", "outcomes": ["x", "y"]} | draw(_box(form, ("x", "y"), depth, timeouts))
    return yaml.safe_dump(chart, sort_keys=False)


@st.composite
def _box(
    draw: st.DrawFn, form: str, outcomes: tuple[str, ...], depth: int, timeouts: bool
) -> dict[str, Any]:
    """A box that can only end with one of `outcomes`."""
    names = [f"n{i}" for i in range(draw(st.integers(1, 3)))]
    keeps = form != "states" and draw(st.booleans()) and len(names) < 3
    targets = [f".{outcome}" for outcome in outcomes] + (names if form == "states" else [])
    children = {name: draw(_node(tuple(targets), keeps, depth, timeouts)) for name in names}
    if not keeps:
        # `all` without rules ends with `done`, so plain parallel boxes are `any`
        return {"states" if form == "states" else "any": children}
    return {form: children, "when": draw(_rules(children, outcomes))}


@st.composite
def _rules(draw: st.DrawFn, children: dict[str, Any], outcomes: tuple[str, ...]) -> list[Any]:
    """Random rules, and behind them one for each outcome of the first child."""
    rules = []
    for _ in range(draw(st.integers(0, 2))):
        picked = draw(st.lists(st.sampled_from(sorted(children)), min_size=1, unique=True))
        conditions = {n: draw(st.sampled_from(_kept(children[n]))) for n in picked}
        rules.append({"outcome": draw(st.sampled_from(outcomes)), "if": conditions})
    first = next(iter(children))
    sure = [(draw(st.sampled_from(outcomes)), outcome) for outcome in _kept(children[first])]
    return rules + [{"outcome": ending, "if": {first: outcome}} for ending, outcome in sure]


def _kept(node: dict[str, Any]) -> tuple[str, ...]:
    own = LEAVES.get(node.get("do") or node.get("watch"), ("p", "q"))
    return (*own, "timeout") if "timeout" in node else own


@st.composite
def _node(
    draw: st.DrawFn, targets: tuple[str, ...], keeps: bool, depth: int, timeouts: bool
) -> dict[str, Any]:
    kind = draw(st.sampled_from(("do", "watch") + ("states", "any", "all") * (depth > 0)))
    node: dict[str, Any]
    if kind == "do":
        node, outcomes = {"do": "Do"}, LEAVES["Do"]
    elif kind == "watch":
        node, outcomes = {"watch": "See"}, LEAVES["See"]
    else:
        node, outcomes = draw(_box(kind, ("p", "q"), depth - 1, timeouts)), ("p", "q")
    if timeouts and draw(st.integers(0, 3)) == 0:
        node["timeout"] = f"{draw(st.integers(1, 8)) * 100} ms"
        outcomes = (*outcomes, "timeout")
    if not keeps:
        node["next"] = {outcome: draw(st.sampled_from(targets)) for outcome in outcomes}
    return node
