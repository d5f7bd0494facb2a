"""Rule 1 of engine/README.md: ticks and time."""

from __future__ import annotations

import itertools

from engine.state import Action, Context, Run, Until
from tests.engine.rules.charts import NESTED


def test_rule_1_durations_are_rounded_to_nanoseconds(bench):
    class Hold(Action):
        """Ends after a tenth of a second."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            yield Until(ctx.after(0.1))
            return "done"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Hold, next: {done: a}}\n"
    b = bench(text, states=(Hold,), scripted=False)
    b.tick(400)
    entries = [r.time for r in b.run.trace if r.kind == "enter" and r.subject == "a"]
    assert len(entries) > 300
    assert {after - before for before, after in itertools.pairwise(entries)} == {10**8}


def test_rule_1_the_same_script_gives_the_same_trace(bench):
    hashes = set()
    for _ in range(2):
        b = bench(NESTED)
        b.tick(2)
        b.end("chase/danger", "seen")
        b.tick(3)
        b.end("escape/flee", "done")
        b.tick(2)
        hashes.add(b.run.trace.sha256())
    assert len(hashes) == 1
