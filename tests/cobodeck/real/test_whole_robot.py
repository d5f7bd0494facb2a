"""The whole robot against its fakes, and what becomes of it when its processes are killed.

What is asserted is counted in steps of the world, 10 ms each; nothing may move a second later.
"""

import os
import select
import signal
import time

import pytest

from tests.cobodeck.whole_robot import WholeRobot

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="needs Linux"),
]
FAST = 0.4
"""The base drives if it is faster, m/s."""


@pytest.fixture
def robot(tmp_path):
    robot = WholeRobot(tmp_path)
    yield robot
    robot.close()


def has_ended(pid: int) -> bool:
    try:
        handle = os.pidfd_open(pid)
    except ProcessLookupError:
        return True
    try:
        return bool(select.select([handle], [], [], 10.0)[0])
    finally:
        os.close(handle)


@pytest.mark.requirement(48, 149)
def test_an_engine_that_is_killed_leaves_nothing_moving(robot):
    robot.moving(FAST)
    children = robot.children()
    killed_ns = time.monotonic_ns()
    robot.engine.kill()
    steps, braking = robot.steps_until_standing(killed_ns)
    assert steps <= 10 + braking + 2
    assert {"hw.drivers.chain.process", "hw.drivers.ur.worker"} <= children.keys()
    assert all(has_ended(pid) for pid in children.values())


@pytest.mark.requirement(48, 149)
def test_a_chain_that_is_killed_is_noticed_by_the_drives_themselves(robot):
    robot.moving(FAST)
    chain = robot.children()["hw.drivers.chain.process"]  # it takes 100 ms to find
    robot.moving(FAST)
    killed_ns = time.monotonic_ns()
    os.kill(chain, signal.SIGKILL)
    steps, braking = robot.steps_until_standing(killed_ns)
    assert steps <= 10 + braking + 2
    assert robot.engine.poll() is None
