"""Charts of a folder, read anew when their files change, as messages for pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from time import thread_time
from typing import Any

from cobodeck.live.charts.chart_reader import ChartReader, ReadChart
from cobodeck.live.charts.drawn_chart import chart_message, finding_message
from cobodeck.live.charts.file_watch import FileWatch
from cobodeck.live.charts.seen_chart import seen_nodes
from cobodeck.live.clients import PageMessage
from cobodeck.project import Catalogue, kind_of, name_in, yaml_files
from cobodeck.terminal import Problem
from engine.files import did_you_mean
from engine.files.declared import YAML

PATIENCE = 2
"""Looks for which a file that is empty or gone may be on its way: editors replace files."""
LOOKS_PER_LISTING = 10
LISTING_SHARE = 0.1
"""At most so much of the time goes into listing a large folder."""
EVERY_S = 0.1
"""How often files are looked at, s."""
KEPT = 64
"""Messages that are kept; pages can ask for any number of them."""


@dataclass(frozen=True, slots=True)
class Shown:
    """What one place of a page shows: a chart file, by a profile, with these nodes unfolded.

    `unfolded`: paths of `use` nodes; None: all.
    """

    file: Path
    profile: str
    unfolded: frozenset[str] | None = frozenset()


class ChartFolder:
    """The charts of a folder, or a chart file and those beside it.

    Its methods may be called from any thread.

    Args:
        target: the folder or the file.
        known: what charts can name.

    Raises:
        Problem: there are no charts.
    """

    def __init__(self, target: Path, known: Catalogue) -> None:
        self.target, self._is_folder = target, target.is_dir()
        self._lock = Lock()
        self._reader = ChartReader(known)
        self._watch = FileWatch()
        self._good: dict[tuple[Path, str], ReadChart] = {}
        self._drawn: dict[tuple[Path, str], PageMessage] = {}
        self._messages: dict[Shown, PageMessage] = {}
        self._pending: set[Path] = set()
        self._looks = LOOKS_PER_LISTING
        self._waited = 0
        self.files = self._listed()
        if not self.files:
            raise Problem(f"{target}: no charts in this folder")
        self._first = self.files[0]
        self._watch.changed(self.files)

    @property
    def first(self) -> Path:
        """The chart that is shown first; one that is gone if all are."""
        return self.files[0] if self.files else self._first

    def file_of(self, chart: object) -> Path | str:
        """The file of a chart by its name or file; text that says why not, if there is none."""
        by_name = {name_in(file): file for file in reversed(self.files)}
        by_name |= {str(file): file for file in self.files}
        found = by_name.get(str(chart))
        return found or f"no chart {str(chart)!r} here; {did_you_mean(str(chart), by_name)}"

    def look(self) -> bool:
        """Look at all files; whether what pages show may have changed."""
        with self._lock:
            return self._looked()

    def _looked(self) -> bool:
        self._looks -= 1
        if not self._looks:
            self._list_again()
        self._pending |= self._watch.changed(
            [*self.files, *self._reader.sources(), *sorted(self._reader.files)]
        )
        if not self._pending:
            return False
        if self._waited < PATIENCE and any(map(_is_unfinished, self._pending)):
            self._waited += 1
            return False
        self._reader.forget(self._pending)
        self._pending, self._waited = set(), 0
        self._messages.clear()
        return True

    def chart(self, shown: Shown, slot: int) -> PageMessage:
        """The message `chart` of what is shown."""
        with self._lock:
            found = self._messages.pop(shown, None) or self._shown(shown)
            self._messages[shown] = found  # as the newest
            if len(self._messages) > KEPT:
                del self._messages[next(iter(self._messages))]
        return {**found, "slot": slot}

    def listing(self) -> PageMessage:
        """The message `charts`: names, files, and numbers of errors and warnings."""
        with self._lock:
            counts = self._reader.counts([file for file in self.files if file.is_file()])
        return {
            "t": "charts",
            "charts": [
                {"name": name_in(file), "file": str(file), "errors": errors, "warnings": warnings}
                for file, (errors, warnings) in counts.items()
            ],
        }

    def _shown(self, shown: Shown) -> PageMessage:
        try:
            return self._message(shown)
        except Exception as error:  # noqa: BLE001  pages outlive whatever a text brings about
            told = f"{shown.file} cannot be shown: {type(error).__name__}: {error}"
            last = self._drawn.get((shown.file, shown.profile))
            last = last or _without_picture(shown.file, [])
            return {**last, "trouble": told, "findings": [], "stale": True}

    def _message(self, shown: Shown) -> PageMessage:
        now = self._reader.read(shown.file, shown.profile)
        key = shown.file, shown.profile
        if now.whole:
            self._good[key] = now
        picture = self._good.get(key, now)
        if picture.chart is None or picture.profile is None:
            return _without_picture(now.file, _findings(now, {}))
        known = self._reader.known
        found = chart_message(
            picture.chart, picture.charts, picture.profile, interfaces=known.interfaces,
            types=known.types, unfolded=shown.unfolded, stale=not now.whole,
        )  # fmt: skip
        unfolded = None if shown.unfolded is None else sorted(shown.unfolded)
        findings = _findings(now, found["nodes"])
        found |= {"profile": shown.profile, "unfolded": unfolded, "findings": findings}
        self._drawn[key] = found
        return found

    def _list_again(self) -> None:
        begin = thread_time()
        listed = self._listed()
        self._pending |= set(listed) ^ set(self.files)
        self.files = listed
        spent = (thread_time() - begin) / EVERY_S
        self._looks = max(LOOKS_PER_LISTING, round(spent / LISTING_SHARE))

    def _listed(self) -> list[Path]:
        target = self.target
        if self._is_folder:
            return [file for file in yaml_files(target) if kind_of(file) == "chart"]
        beside = (file for file in target.parent.glob("*") if file.suffix in YAML)
        return [target, *(f for f in sorted(beside) if f != target and kind_of(f) == "chart")]


def _findings(now: ReadChart, drawn: Mapping[str, Any]) -> list[PageMessage]:
    """What is wrong now, at the nodes that are drawn."""
    nodes = [] if now.chart is None else seen_nodes(now.chart, now.charts, {})
    found = [finding_message(finding, nodes) for finding in now.findings]
    return [{**f, "path": f["path"] if f["path"] in drawn else None} for f in found]


def _without_picture(file: Path, findings: list[PageMessage]) -> PageMessage:
    """The message of a chart that could never be read."""
    return {
        "t": "chart", "name": name_in(file), "file": str(file), "svg": "", "trouble": "",
        "nodes": {}, "findings": findings, "unfolded": [], "form": [], "stale": True,
    }  # fmt: skip


def _is_unfinished(file: Path) -> bool:
    try:
        return file.stat().st_size == 0
    except OSError:
        return True
