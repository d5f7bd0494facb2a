from states.arm.kinematics.collision import (
    MARGIN as MARGIN,
    OUTSIDE as OUTSIDE,
    CollisionChecker as CollisionChecker,
    Cylinder as Cylinder,
    Limb as Limb,
    Surroundings as Surroundings,
    Wall as Wall,
    WallSegments as WallSegments,
    edges_of as edges_of,
    extent as extent,
    outline as outline,
)
from states.arm.kinematics.dynamics import (
    Bodies as Bodies,
    Effort as Effort,
    effort as effort,
)
from states.arm.kinematics.inverse_kinematics import (
    BRANCHES as BRANCHES,
    EXACT as EXACT,
    Solutions as Solutions,
    inverse as inverse,
    inverse_near as inverse_near,
    nearest_copies as nearest_copies,
)
from states.arm.kinematics.kernels import (
    Array as Array,
    CapsuleSet as CapsuleSet,
    Integers as Integers,
    approaching as approaching,
    approaching_limbs as approaching_limbs,
    free_from as free_from,
    room_within as room_within,
    seen_from_above as seen_from_above,
)
from states.arm.kinematics.kinematics import (
    deviation as deviation,
    fastest_point as fastest_point,
    forward as forward,
    jacobian as jacobian,
    link_frames as link_frames,
    pose_matrix as pose_matrix,
    tcp_speed as tcp_speed,
)
from states.arm.kinematics.model import (
    Manipulator as Manipulator,
)
from states.arm.kinematics.newton import (
    ALONG_STEPS as ALONG_STEPS,
    descended as descended,
)
from states.arm.kinematics.numeric import (
    followed as followed,
    slowness as slowness,
)
