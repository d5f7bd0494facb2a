"""Children: ready, refused, gone; and what they do when their parent is gone."""

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hw.ipc.priority import SENSES, permitted
from hw.ipc.processes import Child

MODULE = "tests.hw.ipc.child"


@pytest.mark.requirement(149)
def test_a_child_says_when_it_is_ready_and_ends_with_us(tmp_path):
    left = tmp_path / "left"
    child = Child(MODULE, {"leave": str(left)})
    told = child.wait()
    assert told["pid"] == child.pid != os.getpid()
    assert told["settings"] == {"leave": str(left)}
    assert child.alive
    if permitted():
        mine = os.sched_getscheduler(child.pid), os.sched_getparam(child.pid).sched_priority
        assert mine == (os.SCHED_RR | os.SCHED_RESET_ON_FORK, SENSES)
    status = Path(f"/proc/{child.pid}/status").read_text()
    if int(status.partition("CapEff:")[2].split()[0], 16) & 1 << 14:  # CAP_IPC_LOCK
        assert int(status.partition("VmLck:")[2].split()[0]) > 0
    child.close()
    assert not child.alive
    assert left.read_text() == "stood still"


def test_children_start_side_by_side():
    children = [Child(MODULE, number) for number in range(3)]
    assert [child.wait()["settings"] for child in children] == [0, 1, 2]
    for child in children:
        child.close()


def test_a_child_that_cannot_open_its_device_says_why():
    with pytest.raises(OSError, match="no such device: can7"):
        Child(MODULE, "refuse").wait()


def test_a_child_that_dies_early_is_told():
    with pytest.raises(OSError, match=r"the twin has ended \(exit code 3\) before it was ready"):
        Child(MODULE, "die", "the twin").wait()


@pytest.mark.requirement(48)
def test_a_child_says_that_it_is_halted_and_how_it_has_ended():
    child = Child(MODULE, None, "the twin")
    child.wait()
    assert child.fault is None
    os.kill(child.pid, signal.SIGSTOP)
    os.waitid(os.P_PID, child.pid, os.WSTOPPED | os.WNOWAIT)
    assert child.fault == "the twin is halted by a signal"
    os.kill(child.pid, signal.SIGCONT)
    assert child.fault is None
    os.kill(child.pid, signal.SIGKILL)
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    assert child.fault == "the twin has ended (killed by signal 9, SIGKILL)"
    child.close()
    assert not child.alive


@pytest.mark.slow
@pytest.mark.requirement(149)
def test_a_child_that_never_pauses_gives_its_priority_back():
    child = Child(MODULE, "run away")
    child.wait()
    if not permitted():
        child.kill()
        pytest.skip("no right to real-time priorities")
    child.close(timeout_s=20.0)  # it ends by itself, once it has lost its priority
    assert child.fault.endswith("has ended (exit code 0)")


def test_a_child_comes_to_its_end_when_its_parent_is_killed(tmp_path):
    left = tmp_path / "left"
    code = (
        "from hw.ipc.processes import Child; import os, signal\n"
        f"child = Child({MODULE!r}, {{'leave': {str(left)!r}}}); child.wait()\n"
        "print(child.pid, flush=True); os.kill(os.getpid(), signal.SIGKILL)"
    )
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    parent = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    try:
        handle = os.pidfd_open(int(parent.stdout))
    except ProcessLookupError:  # it has come to its end already
        handle = None
    if handle is not None:
        assert select.select([handle], [], [], 10.0)[0]
        os.close(handle)
    assert left.read_text() == "stood still"
