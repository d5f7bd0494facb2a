"""All faults of the table."""

from __future__ import annotations

from tests.planted import (
    in_arm,
    in_behaviors,
    in_engine,
    in_hardware,
    in_judges,
    in_localization,
    in_navigation,
    in_safety,
)

FAULTS = (
    *in_hardware.FAULTS,
    *in_safety.FAULTS,
    *in_localization.FAULTS,
    *in_navigation.FAULTS,
    *in_arm.FAULTS,
    *in_behaviors.FAULTS,
    *in_engine.FAULTS,
    *in_judges.FAULTS,
)
