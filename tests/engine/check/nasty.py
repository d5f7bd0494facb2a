"""Charts made to take long or much, and a run over all of them."""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator
from itertools import islice

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.finding import Finding
from engine.files.source import read
from tests.engine.check.some_charts import INTERFACES

HEAD = "chart: c0\noutcomes: [done]\n"
WORK = "{do: Work, next: {done: .done, failed: .done}}"


def findings(texts: list[str]) -> list[Finding]:
    library = Library()
    for number, text in enumerate(texts):
        library.add(read(text.encode(), f"{number}.yaml"))
    return check(library, INTERFACES)


def used_twice(charts: int) -> list[str]:
    """Each chart uses the next one twice."""
    texts = [
        f"chart: c{i}\noutcomes: [done]\nall: {{a: {{use: c{i + 1}}}, b: {{use: c{i + 1}}}}}\n"
        for i in range(charts)
    ]
    return [*texts, f"chart: c{charts}\noutcomes: [done]\nstates: {{a: {WORK}}}\n"]


def used_once(charts: int, ring: bool) -> list[str]:
    """Each chart uses the next one, the last one the first or none."""
    texts = [
        f"chart: c{i}\noutcomes: [done]\n"
        f"states: {{a: {{use: c{(i + 1) % charts}, next: {{done: .done}}}}}}\n"
        for i in range(charts)
    ]
    if not ring:
        texts[-1] = f"chart: c{charts - 1}\noutcomes: [done]\nstates: {{a: {WORK}}}\n"
    return texts


def sequence(lines: list[str], keys: int = 0) -> list[str]:
    data = "data:\n" + "".join(f"  k{i}: number\n" for i in range(keys)) if keys else ""
    return [HEAD + data + "states:\n" + "".join(f"  {line}\n" for line in lines)]


def diamonds(count: int) -> list[str]:
    """A way through it forks everywhere, and only one branch writes."""
    lines = []
    for i in range(count):
        after = f"a{i + 1}" if i < count - 1 else ".done"
        lines += [
            f"a{i}: {{do: Work, next: {{done: c{i}, failed: b{i}}}}}",
            f"b{i}: {{do: Give, out: {{value: k{i}}}, next: {{done: {after}, failed: .done}}}}",
            f"c{i}: {{do: Work, next: {{done: {after}, failed: .done}}}}",
        ]
    return sequence(lines, count)


def rules(children: int, items: int) -> list[str]:
    """Random conditions on three children each; whether they cover everything is hard to say."""
    chance = random.Random(1)
    text = f"{HEAD}all:\n" + "".join(f"  n{i}: {{do: Work}}\n" for i in range(children)) + "when:\n"
    for _ in range(items):
        picked = chance.sample(range(children), 3)
        pairs = ", ".join(f"n{i}: {chance.choice(('done', 'failed'))}" for i in picked)
        text += f"  - {{outcome: done, if: {{{pairs}}}}}\n"
    return [text]


def cases() -> Iterator[tuple[str, list[str]]]:
    """Each with what it is."""
    yield "brackets", ["[" * 50_000]
    yield "flow levels", ["{a: " * 20_000]
    yield "block levels", ["\n".join(" " * i + f"a{i}:" for i in range(1300))]
    bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
        f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n"
        for before, name in zip("abcdefgh", "bcdefghi", strict=True)
    )
    yield "alias bomb", [bomb]
    yield "10 MB", [HEAD + "x" * 10_000_000]
    yield "digits", sequence([f"a: {{do: Work, with: {{time: {'1' * 400_000}x}}}}"])
    yield "used twice", used_twice(30)
    yield "a chain", used_once(2000, ring=False)
    yield "a ring", used_once(2000, ring=True)
    many = range(9000)
    yield "unknown keys", sequence([f"s{i}: {{do: Work, nxt{i}: x}}" for i in many])
    yield "unknown classes", sequence([f"s{i}: {{do: Worq{i}, next: {{x: .done}}}}" for i in many])
    yield (
        "unknown targets",
        sequence([f"s{i}: {{do: Work, next: {{done: t{i}, failed: u{i}}}}}" for i in many]),
    )
    yield (
        "unknown outcomes",
        sequence([f"s{i}: {{do: Work, next: {{done{i}: .done, faild: .x{i}}}}}" for i in many]),
    )
    follow = "next: {{done: s{}, failed: .done}}"
    yield (
        "unwritten keys",
        sequence(
            [
                f"s{i}: {{do: Take, in: {{value: k{i}}}, {follow.format((i + 1) % 7000)}}}"
                for i in range(7000)
            ],
            keys=7000,
        ),
    )
    yield "diamonds", diamonds(2500)
    yield (
        "other names",
        sequence(
            [f"s{i}: {{in: {{x{i}: k{i}}}, states: {{a: {WORK}}}}}" for i in range(4500)], keys=4500
        ),
    )
    yield (
        "one part",
        [
            f"{HEAD}any:\n"
            + "".join(f"  s{i}: {{do: Drive, next: {{done: .done}}}}\n" for i in many)
        ],
    )
    yield "hard rules", rules(40, 170)
    yield "many rules", rules(3000, 12_000)
    outcomes = ", ".join(f"o{i}" for i in range(50_000))
    yield "many outcomes", [f"chart: c\noutcomes: [{outcomes}]\nstates: {{a: {{do: Rest}}}}"]
    yield (
        "dead ends",
        [
            f"{HEAD}any:\n"
            + "".join(f"  s{i}: {{states: {{a: {{do: Rest}}}}}}\n" for i in range(4900))
        ],
    )


def main() -> None:
    """Each is refused, at a place; says so for each. Argument: of how many each one is run."""
    for name, texts in islice(cases(), 0, None, int(sys.argv[1])):
        found = findings(texts)
        assert found, name
        assert all(f.place.line > 0 and f.place.column > 0 for f in found), name
        sys.stdout.write(f"{name}: {len(found)}\n")


if __name__ == "__main__":
    main()
