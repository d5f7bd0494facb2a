"""What a run carries out for the operator at the start of a tick (rule 11)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar


@dataclass(frozen=True, slots=True)
class Command:
    """Something the operator wants done. A command that has become impossible does nothing.

    `by`: who wants it, as far as that is known. `is_late`: it is carried out after the end, too.
    """

    by: str = field(default="", kw_only=True)
    is_late: ClassVar[bool] = False

    def carry_out(self, run: Any) -> None:
        """Do it to `run`, a `ChartRun`, at the start of a tick."""
        raise NotImplementedError(f"{type(self).__name__}.carry_out")
