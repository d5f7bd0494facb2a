"""The signals of CoboDeck's own behaviours, each with the type of its values.

See `states.environment.signal_names`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine import Key
from hw import Pose2
from states.environment import SignalReader

if TYPE_CHECKING:
    from behaviors.profile import Settings

SETTINGS: Key[Settings] = Key("settings")
ESCAPE_REQUIRED: Key[bool] = Key("escape.required")
ESCAPE_SAFE: Key[bool] = Key("escape.safe")
ESCAPE_POSES: Key[tuple[Pose2, ...]] = Key("escape.poses")


def settings_of(ctx: SignalReader) -> Settings:
    """The settings of the run, a constant that is set before the first tick."""
    found = ctx.value(SETTINGS)
    assert found is not None
    return found
