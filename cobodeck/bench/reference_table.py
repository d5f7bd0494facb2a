"""What pages say of the committed results of `bench reference`: the tiers against tier 3."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cobodeck.bench.reference_bench import CASES, COMMANDS, FLOORS, SECONDS
from cobodeck.bench.table import committed_result, machine_text, speed_text, time_text
from cobodeck.markdown import markdown_table

Rows = Sequence[Mapping[str, Any]]
CURIOUS = "escapes, lab_a, curious"


def reference_block() -> str:
    """Responses and their cost; Escapes beside a curious person; poses by the same commands."""
    result = committed_result("reference")
    rows = result["rows"]
    responses = markdown_table(
        ("run", "", "response off by", "mean response", "× real time"), _responses(rows)
    )
    escapes = "; ".join(
        f"{row['variant']}: {row['reference']}"
        for row in sorted(rows, key=lambda row: row["variant"])
        if row["name"] == CURIOUS
    )
    head = (f"corner off by, cm rms in {SECONDS:g} s", "tier 1", *FLOORS)
    poses = markdown_table(head, _poses(rows))
    curious = (
        f"A curious person in `lab_a`, {CASES['lab_a, curious'].options.duration_s:g} s: {escapes}."
    )
    return "\n\n".join([responses, curious, poses, machine_text(result)])


def tiers_in_short() -> str:
    """Speed of the tiers, cost of a tick, and how far responses are off, in a sentence."""
    plain = {row["name"]: row for row in committed_result("simulation")["rows"]
             if row["variant"] == "cobodeck"}  # fmt: skip
    study = {row["variant"]: row for row in committed_result("reference")["rows"]
             if row["name"] == "response, study"}  # fmt: skip
    first, second = plain["cpu_study"], plain["cpu_study_tier_2"]
    return (
        f"`study` runs {speed_text(first)} times as fast as real time at tier 1 "
        f"({time_text(first['time_us'])} per tick), {speed_text(second)} at tier 2 (all sensors), "
        f"{speed_text(study['tier 3'])} at [tier 3](hw/sim/physics/README.md) (MuJoCo), from which "
        f"responses differ by {study['tier 1']['error']:.1f} % and "
        f"{study['tier 2']['error']:.1f} %."
    )


def _responses(rows: Rows) -> Iterator[tuple[str, ...]]:
    for row in rows:
        if row["name"].startswith("response, "):
            yield (
                row["name"].removeprefix("response, "),
                row["variant"],
                "–" if row["error"] is None else f"{row['error']:.1f} %",
                row["reference"] or "–",
                speed_text(row),
            )


def _poses(rows: Rows) -> Iterator[tuple[str, ...]]:
    known = {(row["name"], row["variant"]): row["error"] for row in rows}
    for name in COMMANDS:
        off = (known[f"pose, {name}", variant] for variant in ("tier 1", *FLOORS))
        yield (name, *(f"{1e2 * error:.1f}" for error in off))
