"""Rule 15 of engine/README.md: the trace."""

from __future__ import annotations

from tests.engine.rules.charts import SEQUENCE


def test_rule_15_notes_and_messages_are_not_in_the_hash(bench):
    hashes = []
    for text in ("one", "another"):
        b = bench(SEQUENCE)
        b.tick()
        b.run.note(b.run.nodes[""], text)
        b.end("a", RuntimeError(text))
        b.tick()
        hashes.append(b.run.trace.sha256())
    assert hashes[0] == hashes[1]
