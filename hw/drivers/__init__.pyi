from hw.drivers.access import (
    can_hindrance as can_hindrance,
    serial_hindrance as serial_hindrance,
)
from hw.drivers.can.can_base import CanBase as CanBase
from hw.drivers.chain.chain_client import (
    ChainBase as ChainBase,
    ChainBumper as ChainBumper,
    ChainLink as ChainLink,
    ChainStopLine as ChainStopLine,
)
from hw.drivers.kairos.kairos_base import KairosBase as KairosBase
from hw.drivers.needs import (
    Listening as Listening,
    Observed as Observed,
)
from hw.drivers.observer import (
    PERIOD_S as PERIOD_S,
    ObserverLink as ObserverLink,
)
from hw.drivers.observer_key import (
    key_in as key_in,
    make_key as make_key,
)
from hw.drivers.ros.ros_lidar import RosLidar as RosLidar
from hw.drivers.ros.ros_topics import RosTopics as RosTopics
from hw.drivers.sick.s300 import S300 as S300
from hw.drivers.unity.unity_link import (
    Unity as Unity,
    UnityRoverTrackers as UnityRoverTrackers,
    UnityTrackers as UnityTrackers,
    UnityVr as UnityVr,
)
from hw.drivers.ur.ur_arm import UrArm as UrArm
from hw.drivers.ur.ur_settings import ur_arm_of as ur_arm_of
from hw.drivers.ur.ur_wrench import UrWrench as UrWrench
