from states.arm.description.robot_arm import (
    folded_contact as folded_contact,
    manipulator_of as manipulator_of,
)
