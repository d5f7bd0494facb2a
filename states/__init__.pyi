from states.subsystems import (
    QUARTER as QUARTER,
    SUBSYSTEMS as SUBSYSTEMS,
    Localization as Localization,
    LocalizerEffort as LocalizerEffort,
    Navigation as Navigation,
    SubsystemName as SubsystemName,
)
