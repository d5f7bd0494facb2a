from engine.check.check_library import (
    check as check,
)
from engine.check.exploration import (
    explore as explore,
)
