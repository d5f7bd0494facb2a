"""Each fault twenty times in front of a chain in its own process: counted cycles, told figures."""

import statistics
import sys

import pytest

from hw.geometry import STILL
from tests.hw.drivers.chain_rig import ARM_SILENT, MS, Rig
from tests.repeats import TIMES, long_form

pytestmark = [pytest.mark.slow, long_form]


def arm_cut(rig):
    rig.speaks.remove("arm")
    return rig.last["arm"] + 50 * MS


def observer_gone(rig):
    rig.speaks.remove("observer")
    return rig.last["observer"] + 500 * MS


def user_lost(rig):
    rig.speaks.remove("user")
    return rig.last["user"] + 500 * MS


def foam_touched(rig):
    return rig.order("hit", 0.3)


def drive_failed(rig):
    return rig.order("fault", "drive 3: EMCY 0x7500")


def observer_pulls(rig):
    rig.until(lambda: not rig.reports.poll())
    now = rig.begin + rig.run_time()
    rig.observer.pull("observer")
    return now


def console_pulls(rig):
    now = rig.begin + rig.run_time()
    rig.base.chain.pull("console")
    return now


FAULTS = {
    arm_cut: ARM_SILENT,
    observer_gone: "the observer is silent",
    user_lost: "tracking of the user is lost",
    foam_touched: "bumper",
    drive_failed: "drive 3: EMCY 0x7500",
    observer_pulls: "observer",
    console_pulls: "console",
}


@pytest.mark.requirement(5, 48, 49, 55, 149)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_each_fault_stops_the_wheels_within_two_cycles_until_it_is_reset(fault, capsys):
    rig = Rig(arm=fault is arm_cut).start()
    cycles, reactions = [], []
    for _ in range(TIMES):
        rig.driving()
        since = fault(rig)
        rig.until(lambda: rig.chain.stopped is not None and rig.cycles[-1][4])
        rig.standing().go(20)
        assert rig.chain.stopped == FAULTS[fault]
        assert all(cycle[2] == STILL for cycle in rig.cycles[-20:])
        cycles.append(rig.stopped_in(since))
        first = next(cycle[0] for cycle in rig.cycles if cycle[0] > since and cycle[4])
        reactions.append((first - since) / MS)
        mend(rig)
    lost = rig.chain.remote.lost
    rig.close()
    tell(capsys, fault.__name__, cycles, reactions)
    assert max(cycles) <= 2
    assert lost == 0


def mend(rig):
    """Take the cause away, and the stop."""
    rig.order("fault", None)
    rig.speaks |= {"arm", "observer", "user"}
    rig.go(5)
    rig.until(lambda: not rig.observer.stopping and rig.meanwhile(rig.chain.reset))


def test_an_engine_that_hangs_is_a_zero_command_each_time(capsys):
    rig = Rig().start()
    cycles, reactions = [], []
    for _ in range(TIMES):
        rig.driving()
        rig.speaks.remove("engine")
        gate = rig.last["engine"] - rig.begin + 80 * MS
        rig.standing()
        records = [r for r in rig.chain.remote.cycles.reader().read_new() if r.stamp_ns > gate]
        number = next(n for n, r in enumerate(records, 1) if r.admitted == STILL)
        cycles.append(number)
        reactions.append((records[number - 1].stamp_ns - gate) / MS)
        rig.speaks.add("engine")
    rig.close()
    tell(capsys, "engine_hangs", cycles, reactions)
    assert max(cycles) <= 2


def tell(capsys, name, cycles, reactions):
    ordered = sorted(reactions)
    p50, p99 = statistics.median(ordered), ordered[-1]
    with capsys.disabled():
        sys.stdout.write(
            f"\n{name}: {len(cycles)} times, most {max(cycles)} cycles after the gate; "
            f"p50 {p50:.1f} ms, p99 {p99:.1f} ms\n"
        )
