from behaviors.profile.person_settings import (
    RoomSettings as RoomSettings,
    WalkSettings as WalkSettings,
)
from behaviors.profile.profile import (
    Profile as Profile,
    ProfileFile as ProfileFile,
    is_base as is_base,
    load_profile as load_profile,
    profile_names as profile_names,
    resting_on_base as resting_on_base,
)
from behaviors.profile.settings import (
    ChaseSettings as ChaseSettings,
    CloseSettings as CloseSettings,
    EscapeSettings as EscapeSettings,
    HapticSettings as HapticSettings,
    InformSettings as InformSettings,
    LeaveSettings as LeaveSettings,
    Policy as Policy,
    Settings as Settings,
)
