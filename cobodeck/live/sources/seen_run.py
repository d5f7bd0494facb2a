"""What a page shows of one run besides its state: charts, room, lanes and figures."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from cobodeck.live.charts import chart_message
from cobodeck.live.clients import PageMessage
from cobodeck.live.feed import Whole
from cobodeck.live.figures import figures_of, final_figures
from cobodeck.live.model import RunModel
from cobodeck.live.sources.seen_lanes import SeenLanes
from cobodeck.live.sources.seen_room import SeenRoom, layers
from cobodeck.pictures.run import used_charts
from cobodeck.project import Catalogue, catalogue, reached
from cobodeck.record.format import charts_again, value
from cobodeck.record.read import Group, RunTexts, written_setup
from cobodeck.setup import Setup
from cobodeck.terminal import Problem
from engine.chart import Chart
from engine.files import did_you_mean
from engine.signals import types_of

PACED = frozenset({"simulation", "logic"})
"""Plants of runs whose time is virtual, so that pages may set its speed."""


class Texts(NamedTuple):
    """The header and the attached texts of a run."""

    path: Path
    header: Mapping[str, Any]
    attachments: Mapping[str, bytes]


@dataclass(slots=True)
class _Version:
    """The charts that run from an instant on; `message`: their picture, once it is drawn."""

    from_ns: int
    chart: Chart
    library: Mapping[str, Chart]
    message: PageMessage | None = None


class SeenRun:
    """A run as pages see it; `slot`: which of two side by side.

    Raises:
        Problem, FileError: its texts are missing or malformed.
    """

    def __init__(self, texts: RunTexts, known: Catalogue, slot: int = 0) -> None:
        self.setup: Setup = written_setup(texts, known)
        self._header, self._known, self.slot = texts.header, known, slot
        self._types = types_of(known.signals)
        self.place = SeenRoom(self.setup)
        self._versions = [_Version(0, self.setup.chart, self.setup.library)]
        self._lanes = SeenLanes(used_charts(self.setup.chart, self.setup.library))

    @classmethod
    def written(cls, header: Mapping[str, Any], attachments: Mapping[str, bytes]) -> SeenRun:
        """A run from its texts, before it begins.

        Raises:
            Problem, FileError: as the class.
        """
        texts = Texts(Path("this run"), header, attachments)
        try:
            found = cls(texts, catalogue())
        except Problem:  # code of the project that cannot be imported
            found = cls(texts, catalogue(own=False))
        found.chart()  # drawn now, while nobody waits
        return found

    def begin(self, header: Mapping[str, Any]) -> None:
        """Take what is known once the run has begun, such as its signals."""
        self._header = header

    def hello(self) -> dict[str, Any]:
        """What `hello` says of it."""
        header: Any = self._header
        about = [f"{header['plant']}, {header['profile']['name']}"]
        if "began" in header:
            about.append(f"began {header['began']}")
        signals = [{"name": n, "type": str(self._types.get(n, ""))} for n in self.signals]
        return {
            "title": self._versions[-1].chart.name,
            "about": about,
            "paced": header["plant"] in PACED,
            "signals": signals,
            "layers": layers(),
        }

    def chart(self, at_ns: int | None = None) -> PageMessage:
        """The chart of an instant; None: the one that runs now."""
        version = self._versions[self.version(at_ns)]
        if version.message is None:
            version.message = chart_message(
                version.chart,
                version.library,
                self.setup.profile,
                interfaces=self._known.interfaces,
                types=self._known.types,
                slot=self.slot,
            )
        return version.message

    def version(self, at_ns: int | None = None) -> int:
        """How often the charts were replaced until an instant; None: so far."""
        if at_ns is None:
            return len(self._versions) - 1
        return max(0, bisect_right(self._versions, at_ns, key=lambda held: held.from_ns) - 1)

    def text(self, name: str | None = None) -> PageMessage:
        """The text that runs now of a chart, to be changed; None: of the outermost one.

        Raises:
            ValueError: no such chart runs.
        """
        now = self._versions[-1]
        inside = sorted(reached({now.chart.name}, now.library))
        found = now.chart.name if name is None else name
        if found not in inside:
            raise ValueError(f"no chart {found!r} runs here; {did_you_mean(found, inside)}")
        text = now.library[found].source.text
        return {"t": "text", "chart": found, "text": text, "charts": inside}

    def _replace(self, from_ns: int, arguments: Mapping[str, Any]) -> None:
        """Go on with other charts, as the command `Replace` on record has them."""
        given = value(arguments)
        library = charts_again(given)
        chart = library[given["chart"]]
        self._versions.append(_Version(from_ns, chart, library))
        self._lanes.go_on_with(used_charts(chart, library))

    # what moves

    @property
    def signals(self) -> Sequence[str]:
        """The names of those that the run has."""
        found: Sequence[str] = self._header["signals"]
        return found

    @property
    def slotted(self) -> dict[str, int]:
        """What messages of the second of two runs have beside theirs."""
        return {"slot": self.slot} if self.slot else {}

    # lanes

    def add(self, group: Group) -> None:
        """Take the messages of a tick."""
        self._lanes.add(group)
        for told in group.messages("operator"):
            if told["command"] == "Replace":
                self._replace(group.ticked.at_ns, told["arguments"])

    def renew(self, whole: Whole) -> None:
        """Take what runs now, after ticks were dropped."""
        if whole.charts is not None:
            self._replace(whole.at_ns, whole.charts)
        self._lanes.renew(whole)

    def over_time(self) -> Iterator[PageMessage]:
        """Lanes, and differences from a shadow: all of them."""
        return ({**told, **self.slotted} for told in self._lanes.all())

    def news(self) -> Iterator[PageMessage]:
        """The same: what is new since the last call."""
        return ({**told, **self.slotted} for told in self._lanes.news())

    def figures(self, model: RunModel, result: Mapping[str, Any] | None = None) -> PageMessage:
        """Figures up to the model's instant, or, with its `result`, those of the whole run."""
        if result is None:
            rows = figures_of(model, self._lanes.escapes(model.at_ns / 1e9))
        else:
            rows = final_figures(result)
        told = {"t": "figures", "rows": rows, "range": None, "final": result is not None}
        return told | self.slotted
