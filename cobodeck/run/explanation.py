"""What a run used: signals built, evaluated and skipped, and where the time went."""

from __future__ import annotations

from behaviors import ESTIMATE
from cobodeck.loop import PHASES
from cobodeck.run.simulation import RunResult
from cobodeck.setup import reachable
from cobodeck.terminal import table
from states.localization import LocalizationEstimator


def explain(result: RunResult) -> str:
    """A table of the signals built, and lists of signals not built, parts and times."""
    usage, run = result.usage, result.wired.run
    leaves = reachable(run.machine)
    readers: dict[str, set[str]] = {}
    for leaf in leaves:
        for name in leaf.interface.reads:
            readers.setdefault(name, set()).add(leaf.interface.name)
    rows = [("signal", "kind", "evaluated", "skipped", "time ms", "read by")]
    for name, used in usage.items():
        if used.built:
            kind = type(result.wired.board.declared[name]).__name__.lower()
            shown = ", ".join(sorted(readers.get(name, ()))) or "other signals"
            time = f"{used.time_ns / 1e6:.1f}"
            rows.append((name, kind, str(used.evaluated), str(used.skipped), time, shown))
    missing = [name for name, used in usage.items() if not used.built]
    sampled = result.wired.inlet.sources
    present = result.loop.plant.parts
    parts = [name for name in present if name in sampled]
    idle = [name for name in present if name not in sampled]
    lines = [
        "",
        table(rows, frozenset((2, 3, 4))),
        "",
        f"not built           {', '.join(missing) or '-'}",
        f"parts sampled       {', '.join(parts) or '-'}",
        f"parts not sampled   {', '.join(idle) or '-'}",
        *_scans(result),
        f"states              {len(leaves)} of {len(run.machine.leaves)} can be reached",
        f"time per tick       {_times(result)}",
    ]
    return "\n".join(lines)


def _scans(result: RunResult) -> list[str]:
    """Counts of what localization did with scans and trackers; empty without localization."""
    slot = result.wired.board.slots.get(ESTIMATE)
    estimator = getattr(slot, "estimator", None)
    if not isinstance(estimator, LocalizationEstimator):
        return []
    counts = ", ".join(f"{what} {n}" for what, n in sorted(estimator.localizer.counts.items()))
    return [f"scans and trackers  {counts}"]


def _times(result: RunResult) -> str:
    loop = result.loop
    wall_us = result.figures["wall_s"] * 1e6 / loop.ticks
    spent = () if loop.stopwatch is None else zip(PHASES, loop.stopwatch.spent_ns, strict=True)
    parts = [f"{name} {ns / 1e3 / loop.ticks:.1f}" for name, ns in spent] or ["not measured"]
    share = loop.left_out / loop.ticks
    told = f"{share:.1%} of {loop.ticks} ticks left out, {loop.leapt / loop.ticks:.1%} leapt over"
    return f"{wall_us:.1f} µs: {', '.join(parts)}; {told}"
