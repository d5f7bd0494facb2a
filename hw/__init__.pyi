from hw.extras import (
    missing as missing,
    needs as needs,
)
from hw.finite import (
    is_finite as is_finite,
)
from hw.geometry import (
    STILL as STILL,
    AnyAngle as AnyAngle,
    Coordinate as Coordinate,
    Outline as Outline,
    Pose2 as Pose2,
    Pose3 as Pose3,
    Twist2 as Twist2,
    displacement_of as displacement_of,
    total as total,
    velocity_of as velocity_of,
    wrap as wrap,
)
from hw.interfaces import (
    PARTS as PARTS,
    Arm as Arm,
    DriveMode as DriveMode,
    Gripper as Gripper,
    RobotPart as RobotPart,
    StopLine as StopLine,
)
from hw.jit import (
    Struct as Struct,
    Structs as Structs,
    compile_examples as compile_examples,
    compiled as compiled,
    compiled_like_numpy as compiled_like_numpy,
    example as example,
    record_type as record_type,
    wrapped as wrapped,
)
from hw.samples import (
    ARM_MOVES as ARM_MOVES,
    EXACT as EXACT,
    LATE_S as LATE_S,
    OLD_NS as OLD_NS,
    OLD_S as OLD_S,
    USER_RADIUS as USER_RADIUS,
    ArmState as ArmState,
    BumperHit as BumperHit,
    GripperState as GripperState,
    ImuReading as ImuReading,
    Joints as Joints,
    Odometry as Odometry,
    PoseSigma as PoseSigma,
    Sample as Sample,
    Scan as Scan,
    TimedJoints as TimedJoints,
    TrackerPose as TrackerPose,
    UserPose as UserPose,
    WrenchReading as WrenchReading,
)
from hw.se3 import (
    IDENTITY as IDENTITY,
    RigidMotion as RigidMotion,
    between as between,
    inverse as inverse,
    product as product,
    unit_quaternion as unit_quaternion,
)
from hw.truth import (
    BASE as BASE,
    USER as USER,
    Contact as Contact,
    Hit as Hit,
    Truth as Truth,
)
