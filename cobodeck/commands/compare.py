"""Compare two recorded runs: what was run, what came out, and when they begin to differ."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.terminal import FAILED, OK, json_options, show, show_json, table

if TYPE_CHECKING:
    from cobodeck.record.read import Comparison, Figure, HeaderDifference, Record
    from hw import Pose2

WIDTH = 100
NAME, VALUE = 30, 28
"""Longest names and values, in letters; longer ones are cut."""
LARGEST = 10.0
"""Relative changes above this are shown without the percentage of A."""
COLUMNS = frozenset((1, 2, 3, 4))


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("a", type=Path, metavar="A", help="a record, X.mcap or X.mcap.part")
    parser.add_argument("b", type=Path, metavar="B", help="the other one")
    parser.add_argument("--all", action="store_true", help="show figures that are equal as well")
    parser.add_argument(
        "--tolerance",
        type=_tolerance,
        metavar="ABS[,REL]",
        help="figures that differ by no more than this, in their SI unit or as a share, are equal; "
        "0: exactly; default 1e-9,1e-9",
    )
    json_options(parser)
    parser.epilog = (
        "Exit code 0: intact, same trace and figures, those of the machine aside; else 1."
    )


def _tolerance(text: str) -> tuple[float, float]:
    """`0.01` (also as a share: 0) or `0.01,1e-3`."""
    try:
        bounds = [float(part) for part in text.split(",")]
    except ValueError:
        bounds = []
    if len(bounds) not in (1, 2) or not all(0.0 <= bound < math.inf for bound in bounds):
        raise argparse.ArgumentTypeError(f"{text!r} is not ABS or ABS,REL, two numbers from 0 on")
    return bounds[0], bounds[1] if bounds[1:] else 0.0


def run(args: argparse.Namespace) -> int:
    """Compare."""
    from cobodeck.record.read import FigureTolerance, Record, compare

    records = (Record(args.a), Record(args.b))
    found = compare(
        *records, FigureTolerance() if args.tolerance is None else FigureTolerance(*args.tolerance)
    )
    if args.json:
        show_json(_for_programs(records, found))
    else:
        show("\n\n".join(_sections(records, found, args.all)))
    return OK if found.same and not any(record.broken for record in records) else FAILED


# for people


def _sections(records: Iterable[Record], found: Comparison, equal_too: bool) -> Iterable[str]:
    told = map(_record_text, records, found.ends_ns, found.altered_ns)
    yield table(zip("AB", told, strict=True))
    if found.headers:
        yield "what was run\n" + "\n".join(_header_lines(found.headers))
    else:
        yield "what was run: the same"
    yield _figure_section(records, found, equal_too)
    yield _trace_section(found)
    yield _motion_section(found)


def _record_text(record: Record, end_ns: int, altered_ns: int | None) -> str:
    told = f"{record.path}, {end_ns / 1e9:.1f} s"
    if record.broken is not None:
        told += f"; {record.broken}"
    if altered_ns is not None:
        told += f"; altered at {altered_ns / 1e9:.3f} s"
    return told


def _header_lines(differences: Iterable[HeaderDifference]) -> Iterable[str]:
    rows, texts = [], []
    for d in differences:
        if isinstance(d.a, list) and isinstance(d.b, list):
            rows.append((d.what, _only(d.a, d.b), _only(d.b, d.a)))
        elif d.lines is None:
            rows.append((d.what, _short(d.a), _short(d.b)))
        else:
            lines = "1 line differs" if d.lines == 1 else f"{d.lines} lines differ"
            texts.append(f"{d.what}: {lines}")
            texts += [f"    {_cut(line, WIDTH - 6)}" for line in d.first]
    if rows:
        yield _indented(table([("", "A", "B"), *((_cut(w, 38), x, y) for w, x, y in rows)]))
    yield from (f"  {line}" for line in texts)


def _only(mine: list[Any], its: list[Any]) -> str:
    only = ", ".join(str(one) for one in mine if one not in its)
    return _short(f"only {only}" if only else None)


def _figure_section(records: Iterable[Record], found: Comparison, equal_too: bool) -> str:
    lacking = [name for name, r in zip("AB", records, strict=True) if r.result is None]
    if lacking:
        return f"figures: none in {' and '.join(lacking)}, which did not come to an end"
    shown = [f for f in found.figures if equal_too or not f.same]
    came_out = [f for f in shown if not f.computing]
    computing = [f for f in shown if f.computing and (equal_too or "." not in f.name)]
    parts = ["figures: the same"]
    if came_out:
        parts = ["figures\n" + _figure_table(came_out)]
    if computing:
        parts.append("of the machine, and of what was left out on it\n" + _figure_table(computing))
    return "\n\n".join(parts)


def _figure_table(figures: Iterable[Figure]) -> str:
    rows = [(_cut(f.name, NAME), _number(f.a), _number(f.b), *_change(f.a, f.b)) for f in figures]
    return _indented(table([("", "A", "B", "B - A", ""), *rows], COLUMNS))


def _number(value: Any) -> str:
    if isinstance(value, list):
        return f"{len(value)} entries"
    if isinstance(value, float):
        return f"{value:.6g}"
    return _short(value)


def _change(a: Any, b: Any) -> tuple[str, str]:
    """The difference, absolute and in per cent of A."""
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b) and a != b:
        return "others", ""
    if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in (a, b)) or a == b:
        return "", ""
    share = (b - a) / abs(a) if a else LARGEST
    return f"{b - a:+.4g}", f"{share:+.1%}" if abs(share) < LARGEST else ""


def _trace_section(found: Comparison) -> str:
    t = found.traces
    if t.at_ns is None:
        return f"traces: equal, {t.equal} records"
    over = [f"over; the record ends at {end_ns / 1e9:.3f} s" for end_ns in found.ends_ns]
    rows = [
        (name, _event(line) if line else end)
        for name, line, end in zip("AB", (t.a, t.b), over, strict=True)
    ]
    if t.last is not None:
        at_ns, container, child, outcome, to = t.last
        inside = f" in {container}" if container else ""
        moved = f"{child} -> {to} by {outcome}{inside}, {at_ns / 1e9:.3f} s"
        rows.insert(0, ("before", moved))
    shown = _indented(table([(name, _cut(text, WIDTH - 10)) for name, text in rows]))
    from_when = f"differ from {t.at_ns / 1e9:.3f} s on, after {t.equal} equal records"
    if t.a is None or t.b is None:
        from_when = f"equal for {t.equal} records, to the end of {'B' if t.a else 'A'}"
    return f"traces: {from_when}\n{shown}"


def _event(line: str) -> str:
    """A line of a trace, its time last."""
    at_ns, *told = json.loads(line)
    words = (str(word) if isinstance(word, str) else json.dumps(word) for word in told)
    return f"{' '.join(words)}, {at_ns / 1e9:.3f} s"


def _motion_section(found: Comparison) -> str:
    m = found.motions
    if not m.known:
        return "motion: not known in both"
    if m.base is None and m.person is None:
        return "motion: equal within 1 mm and 1 mrad"
    rows = [
        (name, f"{first[0] / 1e9:.3f} s", _pose(first[1]), _pose(first[2]))
        for name, first in (("base", m.base), ("person", m.person))
        if first is not None
    ]
    return "motion: differs\n" + _indented(table([("", "from", "A", "B"), *rows]))


def _pose(pose: Pose2) -> str:
    return f"({pose.x:.4f}, {pose.y:.4f}, {pose.yaw:.4f})"


def _short(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, list):
        value = ", ".join(map(str, value))
    words = [word[:12] if len(word) == 64 else word for word in str(value).split(" ")]
    return _cut(" ".join(words), VALUE)


def _cut(text: str, width: int) -> str:
    """The text, without its middle if it is too long."""
    if len(text) <= width:
        return text
    half = (width - 1) // 2
    return f"{text[: width - 1 - half]}…{text[-half:]}"


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())


# for programs


def _for_programs(records: Iterable[Record], found: Comparison) -> dict[str, Any]:
    t, m = found.traces, found.motions
    return {
        "same": found.same,
        "records": [
            {
                "file": str(record.path),
                "end_s": _seconds(end),
                "broken": record.broken,
                "altered_at_s": _seconds(altered),
            }
            for record, end, altered in zip(records, found.ends_ns, found.altered_ns, strict=True)
        ],
        "headers": [
            {"what": d.what, "a": d.a, "b": d.b}
            | ({} if d.lines is None else {"lines": d.lines, "first": d.first})
            for d in found.headers
        ],
        "figures": {
            f.name: {"a": f.a, "b": f.b, "same": f.same, "computing": f.computing}
            for f in found.figures
        },
        "trace": {
            "same": t.same,
            "equal": t.equal,
            "at_s": _seconds(t.at_ns),
            "a": t.a,
            "b": t.b,
            "last_move": t.last and dict(zip(_MOVE, (t.last[0] / 1e9, *t.last[1:]), strict=True)),
        },
        "motion": {"base": _apart(m.base), "person": _apart(m.person)} if m.known else None,
    }


_MOVE = ("at_s", "container", "child", "outcome", "next")


def _seconds(at_ns: int | None) -> float | None:
    return None if at_ns is None else at_ns / 1e9


def _apart(first: tuple[int, Pose2, Pose2] | None) -> dict[str, Any] | None:
    if first is None:
        return None
    at_ns, a, b = first
    return {"at_s": at_ns / 1e9, "a": [a.x, a.y, a.yaw], "b": [b.x, b.y, b.yaw]}
