"""Real-time priorities of a run's processes, and memory that stays where it is.

Each child has a session of its own. Where the kernel schedules by sessions
(`sched_autogroup_enabled`, the usual default), niceness counts within a session only; so a process
goes before other programs by a real-time policy alone: SCHED_RR, which its own children do not
inherit. It covers all threads that a process has when it asks, those of libraries included: one
that is left behind may hold a lock for which the others wait.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

CHAIN, ARM, SENSES, DEVICES, ENGINE = 40, 30, 20, 15, 10
"""Priorities, 1 to 99: the safety chain before the arm's worker, before what brings poses and
scans, before fake devices, which stand for hardware that waits for nobody, before the engine. All
are below 50, at which a kernel may run its interrupts."""
RUNAWAY_S = 1
"""Processor time without a pause after which a process gives its priority back, s."""
_TASKS, _STATUS = Path("/proc/self/task"), Path("/proc/self/status")
_MAY_LOCK = 1 << 14
"""CAP_IPC_LOCK."""
_PRESENT, _FUTURE, _ON_FAULT = 1, 2, 4
"""MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT of mlockall."""


def permitted() -> bool:
    """True if this process may have each of the priorities; tried by a thread, which ends."""
    found: list[bool] = []
    trying = threading.Thread(target=lambda: found.append(_set_priority(0, CHAIN)))
    trying.start()
    trying.join()
    return found[0]


def hurry(priority: int) -> None:
    """Give all present threads a real-time priority; without the right to it do nothing.

    A process that then computes for RUNAWAY_S without a pause gives it back and says so on stderr:
    an endless loop would leave other programs 5 % of a processor, the kernel's own guard.
    """
    if not all(_set_priority(thread, priority) for thread in _threads()):
        return
    import resource

    with suppress(ValueError):  # not the main thread, which alone sets handlers
        signal.signal(signal.SIGXCPU, _give_back)
        _, most = resource.getrlimit(resource.RLIMIT_RTTIME)
        resource.setrlimit(resource.RLIMIT_RTTIME, (RUNAWAY_S * 1_000_000, most))


@contextmanager
def hurrying(priority: int) -> Iterator[None]:
    """As `hurry` for a while: afterwards policies, limit and handler are those from before."""
    if not hasattr(os, "sched_setscheduler"):
        yield
        return
    import resource

    policies = {t: (os.sched_getscheduler(t), os.sched_getparam(t)) for t in _threads()}
    limit, handler = resource.getrlimit(resource.RLIMIT_RTTIME), signal.getsignal(signal.SIGXCPU)
    hurry(priority)
    try:
        yield
    finally:
        for thread, (policy, param) in policies.items():
            with suppress(ProcessLookupError):
                os.sched_setscheduler(thread, policy | os.SCHED_RESET_ON_FORK, param)
        with suppress(ValueError):
            signal.signal(signal.SIGXCPU, handler)
            resource.setrlimit(resource.RLIMIT_RTTIME, limit)


def lock_memory() -> None:
    """Keep each page in memory from its first use on, where any number of them may be locked.

    Under a limit nothing is locked, because what is allocated later would fail at the limit.
    """
    try:
        import resource

        unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
        rights = int(_STATUS.read_text().partition("CapEff:")[2].split()[0], 16)
        if unlimited or rights & _MAY_LOCK:
            ctypes.CDLL(None).mlockall(_PRESENT | _FUTURE | _ON_FAULT)
    except (ImportError, AttributeError, OSError):
        return  # no Linux


def _set_priority(thread: int, priority: int) -> bool:
    """Give a thread (0: this one) a real-time priority; False if that is not permitted."""
    try:
        policy = os.SCHED_RR | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(thread, policy, os.sched_param(priority))
    except ProcessLookupError:  # it has ended
        return True
    except (AttributeError, OSError):
        return False
    return True


def _give_back(*_: object) -> None:
    for thread in _threads():
        with suppress(ProcessLookupError):
            policy = os.SCHED_OTHER | os.SCHED_RESET_ON_FORK
            os.sched_setscheduler(thread, policy, os.sched_param(0))
    told = f"{sys.argv[0]}: no pause for {RUNAWAY_S} s: it goes on without real-time priority\n"
    os.write(2, told.encode())  # not print: the signal may have interrupted one


def _threads() -> list[int]:
    try:
        return [int(task.name) for task in _TASKS.iterdir()]
    except OSError:
        return [0]
