"""The client of the chain in another process: what it sends, and what it keeps; no process."""

import time

import pytest

from hw.drivers.chain.remote_chain import RemoteChain
from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.ipc.datagrams import Datagram
from hw.model.robot import MotionLimits, load_robot
from hw.safety.cycle_record import ChainStatus, SafetyRecord
from hw.safety.limits import SafetyLimits
from hw.samples import PoseSigma, Sample

LIMITS = SafetyLimits.of(load_robot("rbkairos_ur10"), MotionLimits())
MS = 1_000_000
NOW = 5000 * MS
HERE, SURE = Pose2(1.0, 2.0), PoseSigma(0.01, 0.01)


class Sent:
    """Stands in for the outlet: (name, stamp, value)."""

    def __init__(self):
        self.told = []

    def send(self, name, stamp_ns, value):
        self.told.append((name, stamp_ns, value))

    def values(self, name):
        return [value for what, _, value in self.told if what == name]


@pytest.fixture
def sent():
    return Sent()


@pytest.fixture
def chain(sent):
    return RemoteChain(LIMITS, "omni", sent, lambda: NOW, lambda: True, lambda reason: None)


def test_a_command_is_as_old_there_as_it_is_here(chain, sent):
    before = time.monotonic_ns()
    chain.command(Twist2(0.3), NOW - 60 * MS)
    after = time.monotonic_ns()
    (stamp,) = [stamp for name, stamp, _ in sent.told if name == "command"]
    assert before <= stamp + 60 * MS <= after
    assert sent.values("command") == [Twist2(0.3)]


def test_without_a_source_no_velocity_is_sent_but_that_there_is_none(chain, sent):
    chain.command(STILL, None)
    assert sent.values("command") == [None]


def test_a_grant_is_repeated_with_each_command_until_the_request_ends(chain, sent):
    chain.grant(HERE)
    chain.command(STILL, None)
    chain.hear(Sample("vr.haptic_request", NOW, Pose3.from_yaw(1.0, 2.0, 1.5, 0.0)), NOW)
    chain.command(STILL, None)
    assert sent.values("grant") == [HERE, HERE, HERE]
    chain.hear(Sample("vr.haptic_request", NOW, None), NOW)
    chain.command(STILL, None)
    assert sent.values("grant") == [HERE, HERE, HERE]


def test_an_estimate_is_sent_once_and_its_loss_and_return_too(chain, sent):
    for _ in range(2):
        chain.locate(NOW, HERE, SURE)
    chain.locate(0, None, None)
    chain.locate(NOW, HERE, SURE)
    assert sent.values("estimate") == [(HERE, SURE), None, (HERE, SURE)]


def test_records_that_did_not_arrive_are_counted(chain):
    record = SafetyRecord(0, STILL, STILL)
    chain.receive(Datagram("chain", 1, "chain.cycles", 0, (record, record)), NOW)
    status = ChainStatus(None, (), None, "omni", 9, 0, 5, 10.0)
    chain.receive(Datagram("chain", 2, "chain.status", 0, status), NOW)
    assert chain.lost == 3
    assert chain.cycles.written == 2
