"""What is one value or one key in part, in `{…}`, is told once and read as meant."""

from __future__ import annotations

import pytest

from engine.files.source import read

LINE_ENDS = ("\n", "\r\n", "\r", "\x85", "\u2028")


@pytest.mark.parametrize("end", LINE_ENDS)
@pytest.mark.parametrize(
    ("written", "meant", "found"),
    [
        ("{a: 2,5 m, b: 3}", {"a": "2.5 m", "b": 3}, [("Y05", 8, "write 2.5 m")]),
        ("{a: -0,5, b: 3}", {"a": -0.5, "b": 3}, [("Y05", 8, "write -0.5")]),
        ("{a:2 m, b:3}", {"a": "2 m", "b": 3}, [("Y04", 5, "`a: 2 m`"), ("Y04", 12, "`b: 3`")]),
        ("{a: 2, 5 m}", {"a": 2, "5 m": None}, []),  # perhaps two entries
        ("{'a:b': , c: 1}", {"a:b": None, "c": 1}, []),
        ("{a: , b: }", {"a": None, "b": None}, []),
        ("{a: {b: 1}, {c: 2}}", None, [("Y04", 16, "`a: [{…}, {…}]`")]),
    ],
)
def test_it_is_read_as_meant_and_told_once(
    end: str, written: str, meant: object, found: list[tuple[str, int, str]]
) -> None:
    source = read(f"x: 1{end}{end}v: {written}{end}".encode(), "t.yaml")
    assert (source.value or {}).get("v") == meant
    told = [(finding.code, finding.place.column) for finding in source.findings]
    assert told == [(code, column) for code, column, _ in found]
    for finding, (_, _, help) in zip(source.findings, found, strict=True):
        assert finding.place.line == 3
        assert help in finding.hint
