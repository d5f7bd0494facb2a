"""What the Python code of five real behaviours, and of the states they use, says beyond the JSON.

Keys: which of them a state class writes stands in the class. Values: constants of modules, and
variables of the method that builds the behaviour. `index` and `test_pregrasp` are first values of
userdata; that of `index` is chosen so that the first pipe is number 0.
"""

from __future__ import annotations

from cobodeck.flexbe_states import FlexbeClass


def writer(name: str, *keys: str) -> FlexbeClass:
    """A state class of which nothing is known but the keys that it writes."""
    said = {"outcomes": None, "input_keys": None, "output_keys": keys}
    return FlexbeClass(name, ("EventState",), "", 1, templates=said)


CLASSES = {
    cls.name: cls
    for cls in (
        writer("CalculateCartesianPathState", "joint_trajectory", "plan_fraction"),
        writer("CalculateIKState", "joint_config"),
        writer("GetEntityByID", "Entity"),
        writer("GetJointsFromSrdfState", "joint_values"),
        writer("GetRosParam", "Value"),
        writer("MonitorPerceptState", "object_id", "object_pose", "object_data"),
        writer("ReadTorque", "torque"),
        writer("SelectPipePose", "pipe_pose"),
        writer("SetGripperState", "object_size"),
        writer("SetKey", "Key"),
        writer("list_entities_by_name", "entity_list", "number"),
    )
}
VARIABLES = {
    "GripperState.OPEN": "0",
    "GripperRollState.HORIZONTAL": "'horizontal'",
    "start_msg": "'Demo started!'",
    "done_msg": "'Demo finished!'",
    "move_group": "'arm_with_gripper_group'",
    "srdf": "'taurob_tracker' + '.srdf'",
    "joints_arm_with_gripper": "['arm_joint_%d' % i for i in range(5)]",
}
USERDATA = {
    "detect_pipes": {"_state_machine": {"index": "-1", "test_pregrasp": "[0, 1.57, 0.77, 0.38, 0]"}}
}
