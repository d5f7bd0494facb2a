from states.environment import (
    extrapolated_state as extrapolated_state,
)
from states.environment.environment import (
    Environment as Environment,
)
from states.environment.signal_names import (
    ACKNOWLEDGE as ACKNOWLEDGE,
    ARM_JOINTS as ARM_JOINTS,
    BASE_ADMITTED as BASE_ADMITTED,
    BASE_MODE as BASE_MODE,
    BASE_POSE as BASE_POSE,
    BASE_POSE_SIGMA as BASE_POSE_SIGMA,
    BASE_REFUSAL as BASE_REFUSAL,
    ENVIRONMENT as ENVIRONMENT,
    GRIPPER_STATE as GRIPPER_STATE,
    HAPTIC_REQUEST as HAPTIC_REQUEST,
    RELEASE as RELEASE,
    RESTART as RESTART,
    STOP_ENGAGED as STOP_ENGAGED,
    USER_POSE as USER_POSE,
    USER_STANDS_SINCE as USER_STANDS_SINCE,
    USER_STILL_SINCE as USER_STILL_SINCE,
    USER_VELOCITY as USER_VELOCITY,
    WRENCH_READING as WRENCH_READING,
    SignalReader as SignalReader,
    environment_of as environment_of,
    planner_key as planner_key,
)
