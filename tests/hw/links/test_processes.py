"""Children: ready, refused, gone; and what they do when their parent is gone."""

import os
import select
import subprocess
import sys

import pytest

from hw.links.processes import Child

MODULE = "tests.hw.links.child"


def test_a_child_says_when_it_is_ready_and_ends_with_us(tmp_path):
    left = tmp_path / "left"
    child = Child(MODULE, {"leave": str(left)})
    told = child.wait()
    assert told["pid"] == child.pid != os.getpid()
    assert told["settings"] == {"leave": str(left)}
    assert child.alive
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
    with pytest.raises(OSError, match=r"links.child has ended before it was ready"):
        Child(MODULE, "die").wait()


def test_a_killed_child_is_gone_at_once():
    child = Child(MODULE, None)
    child.wait()
    child.kill()
    assert not child.alive
    child.close()


def test_a_child_comes_to_its_end_when_its_parent_is_killed(tmp_path):
    left = tmp_path / "left"
    code = (
        "from hw.links.processes import Child; import os, signal\n"
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
