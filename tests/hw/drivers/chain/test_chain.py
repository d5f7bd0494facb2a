"""The chain in a process of its own, as the engine sees it: times, deaths, and who may have it."""

import os
import select
import signal
import subprocess
import sys
import time

import pytest

from hw.drivers.chain.chain_client import ChainLink
from hw.geometry import STILL
from hw.ipc.datagrams import Datagram, Intake, Outlet
from hw.safety.rule import is_standing
from tests.hw.drivers.chain_rig import (
    AHEAD,
    ARM_SILENT,
    HARDWARE,
    MS,
    PATIENCE_S,
    Rig,
    opening,
)
from tests.hw.drivers.rigs import key_file, own_address

SILENCES = [
    ("arm", 50 * MS, ARM_SILENT),
    ("observer", 500 * MS, "the observer is silent"),
    ("user", 500 * MS, "tracking of the user is lost"),
]


@pytest.fixture
def rig():
    made = Rig().start()
    yield made
    made.close()


def stays_stopped(rig, cycles=30):
    rig.standing()
    rig.go(cycles)
    assert all(cycle[2] == STILL and cycle[3].speed == 0.0 for cycle in rig.cycles[-cycles:])


def test_an_answer_to_another_reset_releases_nothing(rig):
    rig.chain.pull("console")
    for token in (-1, 0, 1, 7):
        rig.chain._receive(
            Datagram("chain", 1, "chain.reset", time.monotonic_ns(), (token, None)), 0
        )
        assert rig.chain.stopped == "console"


def test_a_stamp_ahead_of_the_clock_does_not_make_a_chain_live_longer(rig):
    for stamp in (time.monotonic_ns() + 10**12, -(10**18)):
        rig.chain._receive(Datagram("chain", 1, "chain.remark", stamp, None), 0)
        assert rig.chain._heard_ns <= time.monotonic_ns()


def until(reached, waits_for):
    """Wait for datagrams until it is so."""
    end = time.monotonic() + PATIENCE_S
    while not reached():
        assert time.monotonic() < end
        select.select([waits_for], [], [], 0.01)


@pytest.mark.requirement(41, 149)
def test_it_drives_and_no_record_is_lost(rig):
    rig.driving().go(100)
    cycles, remote = rig.cycles, rig.chain.remote
    rig.until(lambda: remote.status.cycles >= cycles[-1][1])
    (first, start, *_), (last, end, *_) = cycles[0], cycles[-1]
    assert abs((last - first) / 1e7 - (end - start) - remote.status.missed) <= 2
    assert remote.lost == 0
    assert remote.cycles.written > 100
    records = remote.cycles.reader().read_new()
    stamps = [record.stamp_ns for record in records]
    assert stamps == sorted(stamps)
    assert 0 < stamps[-1] <= rig.run_time()
    assert AHEAD in {record.admitted for record in records}
    assert {sample.name for sample in rig.base.samples(rig.run_time())} >= {"base.odometry"}


def test_a_second_engine_at_the_same_base_is_refused_and_the_first_goes_on(rig):
    rig.driving()
    host, port = rig.chain.address
    second = ChainLink(port, {"driver": HARDWARE}, rig.run_time, opening(rig.run_time), host=host)
    with pytest.raises(OSError, match=rf"{host}:{port}: .* in the hands of another engine"):
        rig.meanwhile(second.wait)
    second.close()
    rig.go(30).driving()
    assert rig.chain.stopped is None


def test_records_that_were_lost_are_an_error_at_the_end(rig, monkeypatch):
    rig.driving()
    monkeypatch.setattr("hw.drivers.chain.remote_chain._records", lambda value: [])
    rig.go(30)
    with pytest.raises(OSError, match="records of the safety chain are lost"):
        rig.chain.close()
    rig.chain.remote.lost = 0


def test_wheels_that_cannot_be_opened_are_told():
    made = Rig(refuse="no such bus: can7")
    with pytest.raises(OSError, match="Wheels: RuntimeError: no such bus: can7"):
        made.chain.wait()
    made.close()


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"hardware": {}}, 'write driver: "module:Class"'),
        ({"hardware": {"driver": HARDWARE}, "rate": 50}, "a rate of 50 Hz; 100 to 1000"),
        ({"hardware": {"driver": HARDWARE}, "observer": {"time": 1}}, "time; known: host, port"),
        (
            {"hardware": {"driver": HARDWARE}, "observer": {"timeout": 5, "key": key_file()}},
            "timeout of 5 s",
        ),
        (
            {"hardware": {"driver": HARDWARE}, "host": "0.0.0.0"},
            "chain: host: 0.0.0.0: only processes of this machine speak to the chain: leave it out",
        ),
        (
            {"hardware": {"driver": HARDWARE}, "observer": {"host": "0.0.0.0"}},
            "at 0.0.0.0 anybody could speak for the observer: name the file of a key, `key: FILE`",
        ),
    ],
)
def test_what_is_wrong_in_the_connection_is_told(given, match):
    with pytest.raises(ValueError, match=match):
        ChainLink(7400, **{"host": own_address(), "now": lambda: 0, **given}, opening=opening(int))


@pytest.mark.requirement(4, 5)
def test_a_touch_of_the_foam_stops_all_and_is_told_and_a_remark_only_told(rig):
    rig.order("remarked", ("one error frame",))
    rig.until(lambda: rig.remarks == ["one error frame"])
    assert rig.chain.stopped is None
    rig.driving()
    said = rig.order("hit", 0.3)
    rig.until(lambda: rig.pulled)
    stays_stopped(rig)
    assert rig.stopped_in(said) <= 2
    assert [reason for _, reason in rig.pulled] == ["bumper"]
    (hit,) = rig.bumper.samples(rig.run_time())
    assert hit.value.bearing == 0.3
    assert [sample.value for sample in rig.line.samples(0)] == ["bumper"]


@pytest.mark.requirement(48, 49)
def test_only_a_reset_takes_a_stop_away(rig):
    rig.driving()
    rig.base.chain.pull("console")
    stays_stopped(rig)
    assert rig.meanwhile(lambda: rig.base.chain.reset(rig.run_time()))
    assert rig.chain.stopped is None
    rig.driving()
    assert rig.pulled[0][1] == "console"


def test_a_reset_that_is_refused_says_why(rig):
    rig.driving()
    rig.order("fault", "drive 2: no heartbeat")
    rig.until(lambda: rig.pulled)
    rig.standing()
    assert not rig.meanwhile(rig.line.reset)
    assert rig.chain.why == "drive 2: no heartbeat"
    assert rig.chain.stopped == "drive 2: no heartbeat"


@pytest.mark.requirement(55)
@pytest.mark.parametrize(("who", "gate_ns", "reason"), SILENCES)
def test_who_falls_silent_stops_everything_within_the_gate_and_two_cycles(who, gate_ns, reason):
    rig = Rig(arm=who == "arm").start()
    rig.driving()
    rig.pulled.clear()
    rig.speaks.remove(who)
    rig.until(lambda: rig.pulled)
    stays_stopped(rig)
    assert [text for _, text in rig.pulled] == [reason]
    assert rig.stopped_in(rig.last[who] + gate_ns) <= 2
    rig.close()


@pytest.mark.requirement(41, 149)
def test_an_engine_that_hangs_is_a_zero_command_within_a_tenth_of_a_second(rig):
    rig.driving()
    rig.speaks.remove("engine")
    rig.standing()
    records = rig.chain.remote.cycles.reader().read_new()
    last = rig.last["engine"] - rig.begin
    after = [r for r in records if r.stamp_ns > last + 81 * MS]
    assert "command is old" in after[0].reasons
    assert after[0].admitted == STILL
    assert rig.chain.stopped is None


def test_a_chain_that_is_killed_is_noticed_and_not_trusted_again(rig):
    rig.driving()
    os.kill(rig.chain.pid, signal.SIGKILL)
    until(lambda: rig.pulled, rig.reports)
    reason = rig.pulled[0][1]
    assert reason == "the safety chain has ended (killed by signal 9, SIGKILL)"
    assert not rig.base.chain.reset(0)
    assert rig.chain.fault == reason
    assert rig.chain.why == rig.line.why == f"{reason}; no reset helps, start the run again"
    assert [sample.value for sample in rig.line.samples(0)] == [reason]


@pytest.mark.slow
def test_a_chain_that_hangs_is_noticed_and_not_trusted_when_it_goes_on(rig):
    rig.driving()
    os.kill(rig.chain.pid, signal.SIGSTOP)
    until(lambda: rig.pulled, rig.reports)
    os.kill(rig.chain.pid, signal.SIGCONT)
    stays_stopped(rig)
    halted = "the safety chain is halted by a signal"
    assert rig.pulled[0][1] == halted
    assert not rig.base.chain.reset(0)
    assert rig.chain.why == f"{halted}; no reset helps, start the run again"


def test_a_chain_that_is_ended_lets_go_of_the_wheels(rig):
    rig.driving()
    os.kill(rig.chain.pid, signal.SIGTERM)
    rig.until(lambda: rig.closed)


ENGINE = """
import sys
from tests.hw.drivers.chain_rig import Rig
_, own, host, port, key = sys.argv
Rig(host=own, also=[(host, int(port), key)]).start().until(lambda: False)
"""


@pytest.mark.requirement(41, 48, 149)
def test_an_engine_that_is_killed_leaves_nothing_moving_and_the_base_free():
    host, seen = own_address(), Intake(("wheels",))
    engine = subprocess.Popen(
        [sys.executable, "-c", ENGINE, host, *map(str, seen.door("wheels"))],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    told = []

    def drives():
        told.extend(seen.poll())
        return told and told[-1].value[1] == AHEAD

    until(drives, seen)
    engine.kill()
    engine.wait()
    killed = time.monotonic_ns()
    del told[:]
    until(lambda: told.extend(seen.poll()) or (told and told[-1].name == "closed"), seen)
    seen.close()
    after = [one for one in told if one.name == "cycle" and one.stamp_ns > killed]
    zero = next(n for n, one in enumerate(after, 1) if one.value[1] == STILL)
    assert zero <= 2
    assert is_standing(told[-1].value)  # when they were let go of
    until_free(host)


def until_free(host):
    """Until the next engine can have the base."""
    end, nobody = time.monotonic() + PATIENCE_S, Intake(())
    while True:
        try:
            Intake((), host, 7400).close()
            break
        except OSError:
            assert time.monotonic() < end, "the chain lives on"
        select.select([nobody], [], [], 0.01)
    nobody.close()


@pytest.mark.slow
def test_garbage_at_the_port_does_no_harm(rig):
    rig.driving()
    strange = Outlet([rig.chain.door("engine")])
    for name, value in (("reset", "x"), ("mode", 3), ("grant", "x"), ("estimate", 1), ("x", None)):
        strange.send(name, 0, value)
    strange.close()
    rig.go(30).driving()
    assert rig.chain.stopped is None
