from hw.model.arm import (
    ALIKE as ALIKE,
    LINKS as LINKS,
    ArmShape as ArmShape,
    DescribedArm as DescribedArm,
    DescribedArmFile as DescribedArmFile,
    Dh as Dh,
    JointRange as JointRange,
    arm_names as arm_names,
    load_arm as load_arm,
    nearest_arm as nearest_arm,
)
from hw.model.calibration import (
    CalibrationFile as CalibrationFile,
    load_calibration as load_calibration,
)
from hw.model.description import (
    ArmUrdf as ArmUrdf,
    UrdfDescription as UrdfDescription,
)
from hw.model.flange import (
    FlangeChain as FlangeChain,
)
from hw.model.prop import (
    ANY as ANY,
    FLANGE as FLANGE,
    JOINTS as JOINTS,
    ByArm as ByArm,
    Capsule as Capsule,
    GripperModel as GripperModel,
    ParkedJoints as ParkedJoints,
    Placement as Placement,
    Point3 as Point3,
    Prop as Prop,
    PropFile as PropFile,
    WrenchModel as WrenchModel,
    load_prop as load_prop,
)
from hw.model.robot import (
    FOLDER as FOLDER,
    ArmModel as ArmModel,
    BaseModel as BaseModel,
    ChassisBox as ChassisBox,
    Footprint as Footprint,
    MotionLimits as MotionLimits,
    RobotFile as RobotFile,
    RobotModel as RobotModel,
    check_pace as check_pace,
    load_robot as load_robot,
    robot_from as robot_from,
    robot_names as robot_names,
)
from hw.model.sensing import (
    ImuModel as ImuModel,
    LidarModel as LidarModel,
    Mount as Mount,
    OdometryModel as OdometryModel,
    Sensing as Sensing,
    TrackerModel as TrackerModel,
)
from hw.model.sensor_errors import (
    ImuErrors as ImuErrors,
    LidarErrors as LidarErrors,
    OdometryErrors as OdometryErrors,
    SensorErrors as SensorErrors,
    Slip as Slip,
    ViveErrors as ViveErrors,
)
from hw.model.sensor_model import (
    IDEAL as IDEAL,
    SensorModel as SensorModel,
    WhiteNoise as WhiteNoise,
    added as added,
)
from hw.model.tracking import (
    Tracking as Tracking,
)
from hw.model.tracking_file import (
    Residual as Residual,
    TrackingFile as TrackingFile,
    load_tracking as load_tracking,
    placement_of as placement_of,
)
from hw.model.urdf.frames import (
    inverted as inverted,
    matrix as matrix,
    placement as placement,
)
from hw.model.urdf.urdf import (
    Joint as Joint,
    Urdf as Urdf,
    read_urdf as read_urdf,
)
