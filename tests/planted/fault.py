"""What a planted fault is."""

from __future__ import annotations

from typing import NamedTuple


class Fault(NamedTuple):
    """A mistake that a reviewer could miss, and a test that notices it.

    `old` occurs once in `file`, and `new` replaces it; `test` is a test function, as pytest names
    it, without parameters.
    """

    name: str
    file: str
    old: str
    new: str
    test: str

    def planted_in(self, text: str) -> str:
        """The text of the file with the fault.

        Raises:
            ValueError: the text of the table is not there, or not once.
        """
        found = text.count(self.old)
        if found != 1:
            raise ValueError(f"{self.name}: its `old` occurs {found} times in {self.file}; once")
        return text.replace(self.old, self.new)
