"""Localization on logs beside its peers: peers that work, variants that are what they say."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cobodeck.__main__ import main
from cobodeck.bench.localization.localization_logs import OFF, REFERENCE_SIGMA, log_row
from cobodeck.bench.localization.localization_peers import by_correlation, by_particles
from cobodeck.bench.localization.log_variants import (
    SCALE,
    SIDEWAYS_SIGMA,
    VARIANTS,
    YAW_SIGMA,
    LogDrive,
    drive_of,
)
from cobodeck.commands.bench import text
from cobodeck.logs.formats.drive_log import ReferencePose
from cobodeck.logs.log_localization import LocalizedScan
from cobodeck.logs.mapped import room_ground
from cobodeck.logs.seen import scans_of
from cobodeck.terminal.console import FAILED, USAGE
from hw.geometry import Pose2
from hw.samples import Odometry, PoseSigma, Sample
from tests.cobodeck.logs.drives import log_of, world

SCAN, WHEELS = "base.scan", "base.odometry"


@pytest.fixture(scope="module")
def drive() -> LogDrive:
    log = log_of(world(seconds=12.0, speed=1.4), WHEELS, SCAN)
    return drive_of(log, room_ground(log, log.room))


def varied(drive: LogDrive, name: str, value: float, seed: int = 5) -> LogDrive:
    found = VARIANTS[name](drive, value, np.random.default_rng(seed))
    assert found is not None
    return found


def named(drive: LogDrive, name: str) -> list:
    return [sample for sample in drive.log.samples if sample.name == name]


@pytest.mark.parametrize("peer", [by_correlation, by_particles])
@pytest.mark.few(1)
def test_a_peer_follows_slipping_wheels_that_lead_far_away(drive, peer) -> None:
    slipping = varied(drive, "slip", 5.0)
    start, last = drive.truth[0], drive.truth[-1]
    wheels = start @ named(slipping, WHEELS)[-1].value.pose
    assert wheels.distance_to(last) > 0.3

    steps = peer(slipping, start, 0, itertools.count().__next__)

    off = [s.pose.distance_to(t) for s, t in zip(steps, drive.truth, strict=True)]
    assert max(off) < 0.15
    assert all(step.took == 1 for step in steps)


@pytest.mark.parametrize(
    ("name", "value"), [("slip", 2.0), ("thin", 3.0), ("gap", 1.0), ("bunched", 4.0), ("late", 0.2)]
)
def test_variants_repeat_by_seed_and_keep_each_scan_with_its_true_pose(drive, name, value) -> None:
    one, again = varied(drive, name, value), varied(drive, name, value)
    assert one.log.samples == again.log.samples

    true = {id(s.value): t for s, t in zip(named(drive, SCAN), drive.truth, strict=True)}
    assert [true[id(s.value)] for s in named(one, SCAN)] == list(one.truth)
    assert one.ground.scored == frozenset(range(len(one.truth)))
    stamps = [sample.stamp_ns for sample in one.log.samples]
    assert stamps == sorted(stamps)


def test_wheels_without_slip_follow_the_corrected_path(drive) -> None:
    poses = [s.value.pose for s in named(varied(drive, "slip", 0.0), WHEELS)]
    true = {ref.stamp_ns: ref.pose for ref in drive.log.reference}
    first = true[0]
    wheels = [s for s in named(drive, WHEELS) if s.stamp_ns in true]
    for sample, pose in zip(wheels, poses, strict=True):
        assert (first @ pose).distance_to(true[sample.stamp_ns]) < 1e-6


def test_slip_has_the_size_that_it_says() -> None:
    """Of many straight ways of 1 m: mean and spread of the way, sideways, and of the yaw."""
    log = log_of(world(seconds=0.5), WHEELS)
    ways = 1500
    stamps = [round(k * 1e9) for k in range(ways)]
    wheels = tuple(Sample(WHEELS, at, Odometry(Pose2(0.0, 0.0), None)) for at in stamps)
    path = tuple(ReferencePose(at, Pose2(1.001 * k, 0.0)) for k, at in enumerate(stamps))
    long = replace(log, samples=wheels, reference=path)
    found = varied(LogDrive(long, None, ()), "slip", 2.0)
    moved = [a.inverse() @ b for a, b in pairwise(s.value.pose for s in named(found, WHEELS))]
    for got, mean, spread in (
        ([m.x for m in moved], 1.0 + 2.0 * SCALE, 2.0 * 0.05),
        ([m.y for m in moved], 0.0, 2.0 * SIDEWAYS_SIGMA),
        ([m.yaw for m in moved], 0.0, 2.0 * YAW_SIGMA),
    ):
        assert np.mean(got) == pytest.approx(mean, abs=4.0 * spread / math.sqrt(ways))
        assert np.std(got) == pytest.approx(spread, rel=0.1)


def test_thin_gaps_bunches_and_late_wheels_are_what_they_say(drive) -> None:
    assert len(varied(drive, "thin", 3.0).truth) == math.ceil(len(drive.truth) / 3)

    gap = [s.stamp_ns for s in varied(drive, "gap", 1.5).log.samples]
    assert 0.99e9 < max(b - a for a, b in pairwise(gap)) < 2.1e9

    scans = [s.stamp_ns for s in named(varied(drive, "bunched", 4.0), SCAN)]
    steps = np.diff(scans[: len(scans) // 4 * 4])
    assert all(step < 1e6 for step in np.delete(steps, np.s_[3::4]))
    assert all(step > 0.39e9 for step in steps[3::4])

    true = {s.stamp_ns: s.value.pose for s in named(drive, WHEELS)}
    for sample in named(varied(drive, "late", -0.2), WHEELS):
        assert sample.value.pose == true[sample.stamp_ns + 200_000_000]


def test_a_log_too_short_for_a_gap_has_none(drive) -> None:
    assert VARIANTS["gap"](drive, 30.0, np.random.default_rng(0)) is None


def test_only_scans_that_are_scored_remain(drive) -> None:
    log = drive.log
    cut = drive_of(log, replace(drive.ground, scored=frozenset({4, 6})))
    seen = scans_of(log)
    assert [s.stamp_ns for s in scans_of(cut.log)] == [seen[4].stamp_ns, seen[6].stamp_ns]
    assert cut.truth == (drive.truth[4], drive.truth[6])
    assert cut.log.samples[0].stamp_ns >= named(drive, SCAN)[3].stamp_ns


def step(error: float, sigma: float, status: str, known: bool = True) -> LocalizedScan:
    pose = Pose2(error, 0.0) if known else None
    return LocalizedScan(0, pose, PoseSigma(sigma, 0.1), status, None, 0.001)


def test_a_row_counts_lost_scans_and_poses_that_are_confidently_wrong() -> None:
    steps = [
        step(0.03, 0.03, "tracking"),
        step(0.0, 0.03, "resting"),
        step(0.8, 0.1, "tracking"),  # off, and told as good
        step(0.8, 0.1, "doubtful"),  # off, but told
        step(0.8, 0.5, "tracking"),  # off, as its sigma says
        step(OFF - 0.1, 0.01, "tracking"),
        step(0.0, 0.1, "lost", known=False),
        step(0.2, 0.1, "ambiguous"),
        step(9.0, 0.1, "starting"),  # not yet confirmed
    ]
    row = log_row("a.log", "cobodeck", ("slip", 2.0), steps, [Pose2(0.0, 0.0)] * 9)
    errors = [0.03, 0.0, 0.8, 0.8, 0.8, OFF - 0.1, 0.2]
    sigmas = [0.03, 0.03, 0.1, 0.1, 0.5, 0.01, 0.1]
    nees = [e**2 / (s**2 + REFERENCE_SIGMA**2) for e, s in zip(errors, sigmas, strict=True)]
    assert (row.knob, row.value, row.lost, row.wrong) == ("slip", 2.0, 2, 1 / 9)
    assert row.error == pytest.approx(100.0 * math.sqrt(np.mean(np.square(errors))))
    assert row.worst == pytest.approx(80.0)
    assert row.nees == pytest.approx(np.median(nees))
    assert row.time_us == pytest.approx(1000.0)


def test_without_a_pose_or_a_sigma_a_row_has_no_error_or_no_nees() -> None:
    lost = [step(0.0, 0.1, "lost", known=False)]
    assert log_row("a", "cobodeck", None, lost, [Pose2(0.0, 0.0)]).error is None
    assert log_row("a", "correlative", None, [step(0, math.inf, "tracking")], [None]).lost == 0
    there = [step(0.1, math.inf, "tracking")]
    assert log_row("a", "correlative", None, there, [Pose2(0.0, 0.0)]).nees is None


def test_rows_of_logs_are_shown_in_columns_of_their_own() -> None:
    row = log_row("a.log", "cobodeck", None, [step(0.1, 0.1, "tracking")], [Pose2(0.0, 0.0)])
    machine = {"name": "m", "cores": 1, "system": "s", "python": "p"}
    told = text(json.loads(json.dumps({"machine": machine, "rows": [row.plain()]})))
    assert "confidently wrong" in told
    assert "as it is" in told
    assert "what" not in told


@pytest.mark.parametrize("given", ["slip", "slip=x", "thin=0", "fog=1", "late=nan", "gap=inf"])
def test_a_variant_that_is_none_is_refused_by_name(given, capsys) -> None:
    assert main(["bench", "--logs", "a.log", "--variants", given]) == USAGE
    assert "is not NAME=VALUE" in capsys.readouterr().err


def test_logs_are_for_localization_and_need_corrected_poses(tmp_path: Path, capsys) -> None:
    assert main(["bench", "engine", "--logs", "a.log"]) == USAGE
    assert "bench localization" in capsys.readouterr().err
    bare = tmp_path / "bare.log"
    bare.write_text("ODOM 0 0 0 0 0 0 0 host 0\nODOM 1 0 0 0 0 0 1 host 1\n")
    assert main(["bench", "localization", "--logs", str(bare)]) == FAILED
    assert "corrected poses" in capsys.readouterr().err
