"""Real-time priorities: taken by all threads of a process, given back, or not to be had."""

import os
import resource
import signal
import threading

import pytest

from hw.ipc import priority
from hw.ipc.priority import ARM, CHAIN, DEVICES, ENGINE, SENSES, hurry, hurrying, permitted


def test_the_chain_goes_first_and_interrupts_before_it():
    assert 50 > CHAIN > ARM > SENSES > DEVICES > ENGINE > 0


@pytest.fixture
def other():
    """A thread that waits, as those of drivers do."""
    over, begun = threading.Event(), threading.Event()
    thread = threading.Thread(target=lambda: (begun.set(), over.wait()))
    thread.start()
    begun.wait()
    yield thread.native_id
    over.set()
    thread.join()


def policies(threads):
    asked = [os.sched_getscheduler(thread) & ~os.SCHED_RESET_ON_FORK for thread in threads]
    return list(zip(asked, [os.sched_getparam(one).sched_priority for one in threads], strict=True))


def surroundings():
    return resource.getrlimit(resource.RLIMIT_RTTIME), signal.getsignal(signal.SIGXCPU)


@pytest.mark.requirement(149)
def test_all_threads_have_it_for_the_time_of_a_run_and_then_what_they_had_before(other):
    if not permitted():
        pytest.skip("no right to real-time priorities")
    threads = (0, other)
    before, around = policies(threads), surroundings()
    with hurrying(ENGINE):
        assert policies(threads) == [(os.SCHED_RR, ENGINE)] * 2
        assert os.sched_getscheduler(0) & os.SCHED_RESET_ON_FORK
        assert surroundings()[0][0] == 1_000_000  # us
        os.kill(os.getpid(), signal.SIGXCPU)  # as after a second without a pause
        assert policies(threads) == [(os.SCHED_OTHER, 0)] * 2
    assert policies(threads) == before
    assert surroundings() == around


def test_without_the_right_to_it_nothing_changes(monkeypatch, other):
    def refused(*_):
        raise PermissionError

    before, around = policies((0, other)), surroundings()
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    assert not permitted()
    hurry(CHAIN)
    assert policies((0, other)) == before
    assert surroundings() == around


@pytest.mark.parametrize("given", [resource.RLIM_INFINITY, 8 << 20])
@pytest.mark.parametrize("right", [0, 1 << 14])
def test_memory_is_locked_only_where_any_amount_of_it_may_be(monkeypatch, tmp_path, given, right):
    asked = []

    class Library:
        def __init__(self, _):
            self.mlockall = asked.append

    (tmp_path / "status").write_text(f"Name:\tx\nCapEff:\t{right:016x}\n")
    monkeypatch.setattr(priority, "_STATUS", tmp_path / "status")
    monkeypatch.setattr(resource, "getrlimit", lambda _: (given, given))
    monkeypatch.setattr(priority.ctypes, "CDLL", Library)
    priority.lock_memory()
    assert asked == ([7] if right or given == resource.RLIM_INFINITY else [])
