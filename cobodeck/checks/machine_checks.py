"""This machine: Python, libraries, packages that hide ours, priorities, the clock."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterator
from importlib.util import find_spec

from cobodeck.fitness import BAD, FIT, MISSING, CheckResult

LEAST = (3, 11)
"""The oldest Python."""
UNSYNCHRONISED = 5
"""The value that adjtimex returns for a clock that is not synchronised (TIME_ERROR)."""


def python() -> Iterator[CheckResult]:
    """Its version."""
    import platform

    fit = sys.version_info >= LEAST
    needed = f"{platform.python_version()}, {LEAST[0]}.{LEAST[1]} or newer is needed"
    yield CheckResult("python", FIT if fit else BAD, needed)


def system() -> Iterator[CheckResult]:
    """The system."""
    import platform

    yield CheckResult("system", FIT, f"{platform.system()} {platform.machine()}")


def shadowed() -> Iterator[CheckResult]:
    """Each package that is imported in place of one of ours."""
    from cobodeck.shadowed import explained, shadows

    for name, file in shadows().items():
        yield CheckResult(f"package {name}", BAD, explained({name: file}))


def libraries() -> Iterator[CheckResult]:
    """Every library that cobodeck requires."""
    from importlib.metadata import PackageNotFoundError, requires, version

    try:
        needed = requires("cobodeck") or []
    except PackageNotFoundError:
        how = "`make demo` does it, or `pip install -e .`"
        yield CheckResult("cobodeck", MISSING, "not installed", how)
        return
    yield CheckResult("cobodeck", FIT, version("cobodeck"))
    told = {"cobodeck"}  # a package may be of several extras, and these name cobodeck itself
    for line in needed:
        requirement, _, marker = line.partition(";")
        name = re.split(r"[\[<>=!~ ]", requirement, maxsplit=1)[0]
        if name in told:
            continue
        told.add(name)
        try:
            yield CheckResult(name, FIT, version(name))
        except PackageNotFoundError:
            if "extra" not in marker:
                yield CheckResult(name, MISSING, advice(requirement.strip(), marker.strip()))


def advice(requirement: str, marker: str) -> str:
    """What to do about a library that is not installed."""
    if marker:
        drives = "no UR arm can be driven from here; " * requirement.startswith("ur-rtde")
        return f"there may be none for this machine ({marker}); {drives}the rest works without it"
    return f"pip install {requirement!r}"


def drawing() -> Iterator[CheckResult]:
    """Whether Graphviz is there."""
    if find_spec("pygraphviz") is not None:
        yield CheckResult("graphviz", FIT, "comes with pygraphviz")
    elif shutil.which("dot") is not None:
        yield CheckResult("graphviz", FIT, "the program dot")
    else:
        yield CheckResult(
            "graphviz", MISSING, "render makes only .dot and .mmd", "pip install pygraphviz"
        )


def compiled() -> Iterator[CheckResult]:
    """Where compiled code is kept."""
    from cobodeck.setup import described

    yield CheckResult("compiled code", FIT, described())


def realtime() -> Iterator[CheckResult]:
    """The right to real-time priorities, which keep cycles from being delayed."""
    slow = hindered()
    state = FIT if slow is None else MISSING
    yield CheckResult("real time", state, slow or "real-time priorities are allowed")


def hindered() -> str | None:
    """Why other programs may delay this robot's cycles, and what ends that; None if they cannot."""
    from hw.ipc import CHAIN, permitted

    if permitted():
        return None
    try:
        import pwd
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
        user = pwd.getpwuid(os.getuid()).pw_name
    except (ImportError, AttributeError, KeyError):
        return "this system gives no real-time priorities: other programs may delay cycles"
    denied = "no right to real-time priorities, so that other programs may delay cycles: "
    if os.geteuid() == 0 or limit >= CHAIN:
        return (
            f"{denied}this container or group of processes has none; it is to be started with "
            f"CAP_SYS_NICE (`docker run --cap-add SYS_NICE`), its cgroup with cpu.rt_runtime_us"
        )
    return (
        f"{denied}rtprio is {limit}, {CHAIN} is needed; write the lines '{user} - rtprio {CHAIN}' "
        f"and '{user} - memlock unlimited' into /etc/security/limits.d/cobodeck.conf and log in "
        f"again (a systemd unit: LimitRTPRIO={CHAIN} and LimitMEMLOCK=infinity)"
    )


def clock() -> Iterator[CheckResult]:
    """Whether the clock is synchronised: other machines' stamps are compared with it."""
    import ctypes

    what = "clock"
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.create_string_buffer(512))
    except (OSError, AttributeError):
        yield CheckResult(what, MISSING, "not known on this system")
        return
    if state < 0:
        yield CheckResult(what, MISSING, f"not known: {os.strerror(ctypes.get_errno())}")
    elif state == UNSYNCHRONISED:
        remedy = "chrony on all machines keeps their clocks alike"
        yield CheckResult(what, MISSING, "not synchronised", remedy)
    else:
        yield CheckResult(what, FIT, "synchronised")
