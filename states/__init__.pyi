from states.subsystems import (
    QUARTER as QUARTER,
    SUBSYSTEMS as SUBSYSTEMS,
    Localization as Localization,
    Navigation as Navigation,
    SubsystemName as SubsystemName,
)
