from engine.check.all_checks import (
    check as check,
)
