"""What a run carries out for the operator at the start of a tick (rule 11)."""

from __future__ import annotations

from typing import Any


class Command:
    """Something the operator wants done. A command that has become impossible does nothing."""

    __slots__ = ()

    def carry_out(self, run: Any) -> None:
        """Do it to `run`, a `ChartRun`, at the start of a tick."""
        raise NotImplementedError(f"{type(self).__name__}.carry_out")
