from states.arm.arm_situation import (
    ArmSituation as ArmSituation,
)
from states.arm.workspace import (
    Workspace as Workspace,
)
