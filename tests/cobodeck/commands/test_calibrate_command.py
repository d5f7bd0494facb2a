"""`cobodeck calibrate`: frames that are known are found again, and what does not fit is refused."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from cobodeck.__main__ import main
from cobodeck.commands import calibrate as command
from cobodeck.logs.log_calibration import calibrated, tracking_file
from cobodeck.logs.mapped import room_ground
from cobodeck.terminal.console import FAILED, OK
from engine.files.finding import FileError
from hw.geometry import Pose3
from hw.model.robot import load_robot
from hw.model.tracking import Tracking
from hw.model.tracking_file import load_tracking, placement_of
from hw.samples import Sample
from states.localization.calibration.tracker_calibration import NoCalibration
from tests.cobodeck.logs.drives import log_of, tracked, world

TURNED = Pose3.from_yaw(1.2, -0.7, 0.0, math.radians(0.9))


def drive_log(noise=5e-4, vive_from_map=TURNED, **how):
    seen = world(seed=7, seconds=40.0, rate=6.0, speed=0.8, **how)
    rng = np.random.default_rng(11)
    log = log_of(seen, "base.odometry", "base.scan")
    samples = [*log.samples, *tracked(seen, vive_from_map, noise, rng)]
    return replace(log, samples=tuple(sorted(samples, key=lambda one: one.stamp_ns)))


@pytest.fixture(scope="module")
def log():
    return drive_log()


@pytest.fixture(scope="module")
def found(log):
    return calibrated(log, room_ground(log, log.room), None, 0)


def test_a_frame_that_a_restart_has_turned_is_found(found):
    true = TURNED.inverse()

    assert not isinstance(found, NoCalibration)
    assert found.map_from_vive.distance_to(true) < 0.005
    assert math.degrees(abs(found.map_from_vive.yaw - true.yaw)) < 0.05
    assert found.position_rms < 0.005


def test_mounts_are_found(log, found):
    for name, model in log.sensing.trackers.items():
        assert found.mounts[name].flat().distance_to(model.mount.flat) < 0.005


def test_known_mounts_leave_the_frame_alone_to_be_found(log):
    mounts = {name: model.mount.pose for name, model in log.sensing.trackers.items()}
    held = calibrated(log, room_ground(log, log.room), None, 0, mounts)

    assert not isinstance(held, NoCalibration)
    assert held.map_from_vive.distance_to(TURNED.inverse()) < 0.005


def test_the_file_gives_the_poses_again(found, tmp_path):
    path = tmp_path / "cal.yaml"
    path.write_text(tracking_file(found, "cal", "From a test.").text())
    again = load_tracking(path)

    assert main(["validate", str(path)]) == OK
    assert again.residual.position == found.position_rms
    assert dict(again.scanner_yaws) == pytest.approx(dict(found.scanner_yaws))
    poses = again.poses()
    assert poses.map_from_vive.distance_to(found.map_from_vive) < 1e-12
    assert poses.map_from_vive.angle_to(found.map_from_vive) < 1e-7
    assert set(poses.mounts) == {"front_tracker", "rear_tracker"}


def test_the_shipped_file_says_what_the_robot_file_does():
    nominal, told = (
        load_tracking("nominal").poses(),
        Tracking.of(load_robot("rbkairos_ur10").sensing),
    )

    assert nominal.map_from_vive == told.map_from_vive
    assert set(nominal.mounts) == set(told.mounts)
    for name, mount in told.mounts.items():
        assert nominal.mounts[name].distance_to(mount) < 1e-9
        assert nominal.mounts[name].angle_to(mount) < 1e-7


def test_poses_and_angles_belong_together():
    rng = np.random.default_rng(2)
    for q in rng.normal(size=(200, 4)):
        pose = Pose3(1.0, 2.0, 3.0, *(q / np.linalg.norm(q)).tolist())
        assert placement_of(pose).pose().angle_to(pose) < 1e-6


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("map_from_vive: {xyz: [0, 0, 0], rpy: [0, 0, 0]}", "mounts"),
        ("residual: {position: -1, yaw: 0}", "residual"),
        ("scanner_yaws: {a: west}", "scanner_yaws"),
    ],
)
def test_files_that_are_wrong_are_told(tmp_path, wrong, told):
    path = tmp_path / "cal.yaml"
    path.write_text(f"tracking: cal\n{wrong}\n")

    with pytest.raises(FileError, match=told):
        load_tracking(path)


def run(monkeypatch, log, *words):
    monkeypatch.setattr("cobodeck.logs.open_log", lambda _: log)
    return main(["calibrate", "drive.mcap", *map(str, words)])


def test_the_command_writes_what_fits_and_doctor_takes_it(monkeypatch, log, tmp_path, capsys):
    path = tmp_path / "lab.yaml"

    assert run(monkeypatch, log, "-o", path) == OK
    assert "can be used" in capsys.readouterr().out
    assert load_tracking(path).tracking == "lab"
    assert main(["doctor", "--tracking", str(path), "--json"]) == OK
    last = json.loads(capsys.readouterr().out)["checks"][-1]
    assert (last["what"], last["state"]) == ("tracking lab", "ok")
    assert run(monkeypatch, log, "--mounts", path, "--json") == OK
    assert json.loads(capsys.readouterr().out)["fits"]


def test_doctor_refuses_what_does_not_fit(tmp_path, found, capsys):
    path = tmp_path / "bad.yaml"
    bad = replace(found, position_rms=0.0051)
    path.write_text(tracking_file(bad, "bad", "").text())

    assert main(["doctor", "--tracking", str(path), "--json"]) == FAILED
    last = json.loads(capsys.readouterr().out)["checks"][-1]
    assert last["state"] == "bad"
    assert "5 mm and 0.1 deg are allowed" in last["about"]


@pytest.mark.slow
def test_trackers_that_contradict_the_scans_are_refused(monkeypatch, log, tmp_path, capsys):
    shaken = [
        _moved(one, 0.05 * (one.stamp_ns // 4_000_000_000 % 2))
        if one.name == "rover.tracker"
        else one
        for one in log.samples
    ]
    bad = replace(log, samples=tuple(shaken))

    assert run(monkeypatch, bad, "-o", tmp_path / "x.yaml") == FAILED
    assert "refused" in capsys.readouterr().out
    assert not (tmp_path / "x.yaml").exists()


def _moved(sample, by):
    pose = sample.value.pose
    return Sample(
        sample.name, sample.stamp_ns, replace(sample.value, pose=replace(pose, x=pose.x + by))
    )


def test_a_base_that_stood_is_told_what_it_lacks(monkeypatch, log, capsys):
    still = replace(log, samples=tuple(one for one in log.samples if one.stamp_ns < 1_500_000_000))

    assert run(monkeypatch, still, "--json") == FAILED
    assert not json.loads(capsys.readouterr().out)["fits"]


@pytest.mark.parametrize("name", ["rover.tracker", "base.scan"])
def test_logs_without_trackers_or_scans_are_told(log, name):
    lacking = replace(log, samples=tuple(one for one in log.samples if one.name != name))

    with pytest.raises(FileError, match=f"has no {name}"):
        calibrated(lacking, room_ground(lacking, lacking.room), None, 0)


def test_a_log_without_a_room_needs_a_map(monkeypatch, log, capsys):
    run(monkeypatch, replace(log, room=None))

    assert "give it with --map MAP" in capsys.readouterr().err
    assert command.figures(NoCalibration("data", "too few")) == {
        "fits": False,
        "refused": "too few",
    }


@pytest.mark.slow
def test_the_record_of_a_simulated_run_gives_a_calibration(tmp_path, capsys):
    path = tmp_path / "run.mcap"
    words = "simulate --tier 2 --scene lab_a --user cornering --duration 40 --record"
    main([*words.split(), str(path)])
    capsys.readouterr()

    assert main(["calibrate", str(path), "--json"]) == OK
    held = json.loads(capsys.readouterr().out)
    assert held["position_rms_m"] < 0.005
    assert math.hypot(held["map_from_vive"]["x"], held["map_from_vive"]["y"]) < 0.005
    assert main(["localize", str(path), "--map", "lab_a", "--json"]) == OK
    assert json.loads(capsys.readouterr().out)["errors"]["position_rmse_m"] < 0.02
