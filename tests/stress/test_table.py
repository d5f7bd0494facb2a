"""The table is complete: what computes is under stress, or stands here with the reason why not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.stress.numerics import ROOT, numeric_modules
from tests.stress.subjects import SUBJECTS, at_home
from tests.stress.traced import covered, traced

CONVERTS = (
    "converts numbers of files or devices one by one; bad ones are refused where they come in"
)
DRAWS = "shows what others compute, and nobody decides by it"
JUDGES = "looks at records and rooms by means of what is under stress"
EXEMPT = {
    "cobodeck/avoidable/futures.py": JUDGES,
    "cobodeck/avoidable/judged.py": JUDGES,
    "cobodeck/avoidable/safety_envelope.py": JUDGES,
    "cobodeck/checks/floor_space.py": JUDGES,
    "cobodeck/checks/waiting_places.py": JUDGES,
    "cobodeck/flexbe_states/ros/plain_values.py": CONVERTS,
    "cobodeck/flexbe_states/ros/ros_names.py": CONVERTS,
    "cobodeck/logs/formats/drive_log.py": CONVERTS,
    "cobodeck/logs/log_localization.py": JUDGES,
    "cobodeck/logs/mrpt/mrpt_poses.py": CONVERTS,
    "cobodeck/paper/arm_times.py": JUDGES,
    "cobodeck/paper/causes.py": JUDGES,
    "cobodeck/paper/rooms.py": JUDGES,
    "cobodeck/record/format/sample_messages.py": CONVERTS,
    "cobodeck/shapes/actors.py": DRAWS,
    "cobodeck/shapes/sensed.py": DRAWS,
    "cobodeck/shapes/shape.py": DRAWS,
    "cobodeck/shapes/spaces.py": DRAWS,
    "cobodeck/statistics/ranks.py": "sums ranks; oracles are in `tests/cobodeck/statistics`",
    "hw/drivers/can/mecanum.py": CONVERTS,
    "hw/drivers/kairos/kairos_base.py": CONVERTS,
    "hw/drivers/unity/inbox.py": CONVERTS,
    "hw/drivers/unity/protocol/ros_messages.py": CONVERTS,
    "hw/model/flange.py": CONVERTS,
    "hw/people/walking/attacker.py": "aims; oracles are in `tests/hw/people`",
    "hw/people/recorded/repeats_path.py": "replays what `hw/people/walking` computes",
    "hw/people/recorded/walk_file.py": CONVERTS,
    "hw/scene/items.py": "compares heights",
    "hw/sim/hand/loose_items.py": "carries items along with the arm's frames",
    "hw/sim/physics/robot_body.py": "MuJoCo computes; cases by hand are in `tests/hw/sim/physics`",
    "hw/sim/mock.py": "gives a body that stands where it is",
    "hw/model/urdf/capsules.py": "fits capsules to shapes once, in metres of a link",
    "hw/model/urdf/chain.py": CONVERTS,
    "hw/model/urdf/urdf.py": CONVERTS,
    "states/arm/kinematics/descent.py": "solves in the rover frame; its peers are in `tests`",
    "states/arm/kinematics/numeric.py": "solves in the rover frame; its peers are in `tests`",
    "states/arm/kinematics/sampled.py": "draws joints, which have no place in the map",
    "states/arm/description/urdf_arm.py": CONVERTS,
    "states/arm/planning/parking.py": "searches joints by the arm's checker",
}
QUICK = (
    "planar_poses", "spatial_poses", "velocity", "reckoned", "ramps", "safety_rule", "rays",
    "planar_filter", "spatial_filter", "fusion", "wheel_motion", "scan_match", "exact_paths",
    "arm_seen", "governed_arm", "rollouts", "escape_choices", "waiting_risks",
)  # fmt: skip
"""Those that take little time without a compiler."""


def test_whatever_computes_is_under_stress() -> None:
    missing = numeric_modules() - set().union(*covered().values())

    assert missing == set(EXEMPT), "a module is in no row, or exempt without need"
    assert len(numeric_modules()) > 140


def test_the_table_is_that_of_the_subjects() -> None:
    assert list(covered()) == [subject.name for subject in SUBJECTS]
    assert all((ROOT / file).is_file() for files in covered().values() for file in files)


@pytest.mark.slow
def test_subjects_run_what_the_table_says_and_answer_alike_without_a_compiler() -> None:
    found, table = traced(QUICK), covered()

    for subject in SUBJECTS:
        if subject.name in QUICK:
            assert found[subject.name]["modules"] == table[subject.name], subject.name
            answers = np.array(found[subject.name]["answers"])
            home = at_home(subject)
            np.testing.assert_allclose(answers, home, 1e-12, 1e-12, err_msg=subject.name)
