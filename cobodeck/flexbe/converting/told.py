"""What an import has to tell: what is left to do, and what is not the same as in FlexBE."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Left:
    """Something that is left to do by hand: where, what, and the code that says it in FlexBE."""

    chart: str
    path: str
    what: str
    code: str = ""

    def __str__(self) -> str:
        where = f"{self.chart}: {self.path}" if self.path else self.chart
        return f"{where}: {self.what}{f': {self.code}' if self.code else ''}"


@dataclass(slots=True)
class Findings:
    """Both, in the order in which they are found."""

    left: list[Left] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def of(self, chart: str) -> ChartFindings:
        """That of one chart."""
        return ChartFindings(self, chart)


@dataclass(frozen=True, slots=True)
class ChartFindings:
    """What is told of one chart."""

    all: Findings
    chart: str

    def left(self, path: str, what: str, code: str = "") -> None:
        """Tell what is left to do."""
        self.all.left.append(Left(self.chart, path, what, code))

    def note(self, path: str, what: str) -> None:
        """Tell what is different."""
        where = f"{self.chart}: {path}" if path else self.chart
        self.all.notes.append(f"{where}: {what}")
