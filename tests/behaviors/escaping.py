"""States of Escape, stepped by hand in a situation."""

from __future__ import annotations

from typing import Any

from behaviors.escape import escape_poses
from behaviors.escape.escape_candidates import candidates
from behaviors.situation.present_situation import Situation
from tests.behaviors.conftest import Base, Vr
from tests.fake_context import FakeContext


class Escaping:
    """A state in a situation, with its base and what the user is shown.

    What is predicted for the poses is computed anew at each step, as the signal does.
    """

    def __init__(self, state: Any, now: Situation, safe: bool = False, **inputs: Any) -> None:
        self.base, self.vr, self.now = Base("escape"), Vr(), now
        poses = escape_poses.poses(now.settings, now.planners["escape"], now.user, now.pose)
        values = {
            "environment": now.environment, "settings": now.settings, "base.pose": now.pose,
            "base.twist": now.twist, "user.pose": now.user, "user.velocity": now.velocity,
            "base.mode": "omni", "escape.poses": poses, "escape.safe": safe,
        }  # fmt: skip
        self.ctx = FakeContext(values, {"base": self.base, "vr": self.vr})
        self.run = state.run(self.ctx, **inputs)
        self.outputs: dict[str, Any] = {}
        self.waits: Any = None

    def go(self, **values: Any) -> str | None:
        """A step, with new values of signals; its outcome, or None while it goes on."""
        self.ctx.values |= {name.replace("_", ".", 1): value for name, value in values.items()}
        try:
            self.waits = next(self.run)
        except StopIteration as ended:
            if isinstance(ended.value, tuple):
                outcome, self.outputs = ended.value
                return str(outcome)
            return str(ended.value)
        return None

    def sees_the_signal(self) -> None:
        """The candidates come from the signal from now on."""
        poses = self.ctx.values["escape.poses"]
        outline = self.now.environment.outline()
        self.ctx.values["escape.candidates"] = candidates(self.now, poses, outline)
