"""Keeps the results of cells by their addresses in one file, so that nothing is run twice.

A line of JSON per cell, appended and flushed to the disk as soon as the cell is done, with a hash
of its own. Whatever stops the program or the machine costs at most the line being written; a line
that is damaged is reported, and its cell runs again.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult, canonical, sha256_of
from cobodeck.terminal import Problem, complain

NAME = "cells.jsonl"


class ResultStore:
    """The results in a folder, which is made if it is not there; one program writes at a time.

    Raises:
        Problem: another program writes there, or it is a file.
    """

    def __init__(self, folder: Path) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError):
            raise Problem(f"{folder}: a file is there; results need a folder") from None
        self.path = folder / NAME
        self._file = self.path.open("a+b")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise Problem(f"{self.path}: another campaign is writing here") from None
        self._places = dict(self._intact())

    def __contains__(self, address: str) -> bool:
        """Whether there is a result of this address."""
        return address in self._places

    def __len__(self) -> int:
        """The number of results."""
        return len(self._places)

    def result(self, cell: CampaignCell, address: str) -> CellResult:
        """The result of a cell that is there."""
        self._file.seek(self._places[address])
        line = json.loads(self._file.readline())
        return CellResult(cell, address, line["figures"], line["cpu_s"])

    def keep(self, result: CellResult) -> None:
        """Write a result with figures."""
        line = {
            "address": result.address,
            "key": result.cell.key(),
            "seed": result.cell.seed,
            "figures": result.figures,
            "figures_sha256": result.figures_sha256,
            "cpu_s": result.cpu_s,
        }
        self._places[result.address] = self._file.seek(0, os.SEEK_END)
        self._file.write(canonical({**line, "sha256": sha256_of(line)}).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Let others write."""
        self._file.close()

    def _intact(self) -> Iterator[tuple[str, int]]:
        """The addresses and the places of all lines that are whole; after it one can append."""
        self._file.seek(0)
        place, line = 0, b"\n"
        for number, line in enumerate(self._file, 1):
            found = _read(line)
            if found is None:
                complain(f"{self.path}:{number}: damaged; this cell is run again")
            else:
                yield found["address"], place
            place += len(line)
        if not line.endswith(b"\n"):
            self._file.write(b"\n")


def _read(line: bytes) -> dict[str, Any] | None:
    """The content of a line; None if it is damaged."""
    try:
        found = json.loads(line)
        told = found.pop("sha256")
        return found if isinstance(found, dict) and sha256_of(found) == told else None
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError):
        return None
