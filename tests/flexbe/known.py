"""What the Python code of five real behaviours, and of the states they use, says beyond the JSON.

Keys: which of them a state class writes stands in the class. Values: constants of modules, and
variables of the method that builds the behaviour. `index` and `test_pregrasp` are first values of
userdata; that of `index` is chosen so that the first pipe is number 0.
"""

from __future__ import annotations

from tests.flexbe.convert import Known

JOINTS = [f"arm_joint_{i}" for i in range(5)]

KNOWN = Known(
    outputs={
        "CalculateCartesianPathState": ("joint_trajectory", "plan_fraction"),
        "CalculateIKState": ("joint_config",),
        "CalculationState": ("output_value",),
        "GetEntityByID": ("Entity",),
        "GetJointsFromSrdfState": ("joint_values",),
        "GetRosParam": ("Value",),
        "MonitorPerceptState": ("object_id", "object_pose", "object_data"),
        "ReadTorque": ("torque",),
        "SelectPipePose": ("pipe_pose",),
        "SetGripperState": ("object_size",),
        "SetKey": ("Key",),
        "list_entities_by_name": ("entity_list", "number"),
    },
    values={
        "Logger.REPORT_HINT": "hint",
        "Logger.REPORT_ERROR": "error",
        "GripperState.OPEN": 0,
        "GripperRollState.HORIZONTAL": "horizontal",
        "start_msg": "Demo started!",
        "done_msg": "Demo finished!",
        "move_group": "arm_with_gripper_group",
        "srdf": "taurob_tracker.srdf",
        "joints_arm_with_gripper": JOINTS,
        "joints_arm_with_gripper[0:4]": JOINTS[:4],
    },
    userdata={"detect_pipes": {"index": -1, "test_pregrasp": [0, 1.57, 0.77, 0.38, 0]}},
)
