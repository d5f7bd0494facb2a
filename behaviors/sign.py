"""The stop sign, shown by a state that does something else besides (paper 4.4.4)."""

from __future__ import annotations

from engine.state import Context


class Sign:
    """Robot and stop sign as shown by one state; once shown, it is to be seen for `least` s."""

    def __init__(self, ctx: Context, least: float) -> None:
        self._ctx, self._least = ctx, least
        self._until: int | None = None

    @property
    def is_seen(self) -> bool:
        """True if it is not shown, or has been shown long enough to be understood."""
        return self._until is None or self._ctx.now >= self._until

    def show(self) -> None:
        """Show it, unless it is shown already."""
        if self._until is None:
            self._until = self._ctx.after(self._least)
            self._ctx.part("vr").inform(True)

    def hide(self) -> None:
        """Hide it if it is shown."""
        if self._until is not None:
            self._until = None
            self._ctx.part("vr").inform(False)
