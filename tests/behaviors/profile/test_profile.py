"""Profiles: complete, with units, and mistakes in them have a place."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest

from behaviors.profile.profile import FOLDER, Profile, load_profile, profile_names
from behaviors.signal_table import signals
from cobodeck.fitness.check_list import require
from cobodeck.setup.setup import Uses
from engine.chart.chart import Parameter, Reference
from engine.chart.load import load_files, load_text
from engine.files.finding import FileError
from engine.signals.signal_kinds import declare
from hw.model.robot import RobotModel, load_robot
from hw.model.sensor_errors import SensorErrors
from hw.scene.room import Room
from states.signals.prediction import PREDICTORS
from tests.behaviors.conftest import written

CHARTS = FOLDER.parent
PAPER = Path(__file__).with_name("spelled_out.yaml").read_text()
"""A profile without a base, as those of before."""


def unsuited(profile: Profile, robot: RobotModel, uses: Uses | None = None) -> str:
    """Why a run with this profile does not start on this robot; empty if it does."""
    try:
        if uses is None:
            require("start", profile=profile, robot=robot)
        else:
            require("start", profile=profile, robot=robot, uses=uses)
    except FileError as error:
        return str(error)
    return ""


def flat(value: Any, path: str = "") -> dict[str, Any]:
    if not is_dataclass(value):
        return {path: value}
    found: dict[str, Any] = {}
    for field in fields(value):
        found |= flat(getattr(value, field.name), f"{path}.{field.name}".lstrip("."))
    return found


def test_both_profiles_are_there() -> None:
    assert profile_names() == ("paper", "tuned")


@pytest.mark.requirement(34, 50, 75, 79, 97, 98, 104, 111, 120, 129)
def test_paper_keeps_the_printed_numbers(paper: Profile) -> None:
    found = flat(paper.settings) | flat(paper.navigation, "navigation")

    printed = {
        "navigation.chase.max_speed": 1.5, "navigation.haptic.max_speed": 1.5,
        "navigation.escape.max_speed": 2.5, "navigation.chase.inflation": 1.0,
        "navigation.haptic.inflation": 1.0, "navigation.escape.inflation": 0.77,
        "navigation.haptic.tolerance": 0.2, "escape.ahead": 2.5, "escape.around": 1.5,
        "chase.inner": 1.5, "chase.outer": 3.0, "chase.cell": 0.05, "haptic.radius": 1.0,
    }  # fmt: skip
    assert {name: found[name] for name in printed} == printed
    assert found["escape.half_view"] == pytest.approx(0.6283185307)
    assert found["chase.front"] == pytest.approx(1.0471975512)
    assert found["chase.rear"] == pytest.approx(0.7853981634)


@pytest.mark.requirement(50)
def test_the_settled_differences_of_tuned(paper: Profile, tuned: Profile) -> None:
    assert (paper.robot.base_acceleration, tuned.robot.base_acceleration) == (1.5, 1.0)
    assert (paper.robot.arm_acceleration, tuned.robot.arm_acceleration) == (1.0, 5.0)
    assert (paper.robot.tool_speed, tuned.robot.tool_speed) == (None, 1.0)
    assert (paper.safety.governor, tuned.safety.governor) == (False, True)
    assert tuned.settings.chase.margin == 0.3
    assert tuned.navigation.haptic.tolerance == 0.05


def test_predictors_are_known_ones(profile: Profile) -> None:
    user = profile.settings.user

    assert {*user.likely, *user.possible} <= set(PREDICTORS)


def test_what_the_shipped_charts_pick_is_in_the_shipped_profiles(profile: Profile) -> None:
    library = load_files(sorted(CHARTS.glob("*.yaml")))

    applied = profile.apply(library)["chase"].parameters

    assert library["chase"].parameters["room"].default == Reference("profile.chase.room")
    assert applied["room"].default == profile.values["chase.room"]
    assert applied["room"].origin == "base: chase.room"  # where it is written
    assert (applied["far"].default, applied["far"].origin) == ("4 m", "")
    assert not profile.chart_values(library)  # each of these values has one home


PICKING = """\
chart: picking
parameters: {room: {type: length, default: $profile.chase.room}, far: {type: length, default: 4 m}}
outcomes: [x]
states: {s: {do: X, with: {a: $room, b: $far}, timeout: $profile.escape.warning, next: {d: .x}}}
"""


def picking(profile: Profile, text: str = PICKING, **used: Any) -> Mapping[str, Parameter]:
    """The parameters of a chart that picks values, as a run by this profile has them."""
    return profile.apply(load_text(text, "picking.yaml"), **used)["picking"].parameters


def test_a_value_on_top_or_for_one_chart_goes_first_and_is_told(tmp_path: Path) -> None:
    text = "profile: mine\nbase: tuned\ncharts: {picking: {far: 5 m, other: 1}}\n"
    mine = load_profile(written(tmp_path, text))
    found = picking(mine)
    assert (found["far"].default, found["far"].origin) == ("5 m", "mine: charts.picking.far")
    assert found["room"].origin == "base: chase.room"  # where it is written

    sets = ["chase.room=2 m", "charts.picking.far=6 m"]
    found = picking(load_profile("tuned", sets))
    assert {p.default: p.origin for p in found.values()} == {
        "2 m": "--set chase.room=2 m",
        "6 m": "--set charts.picking.far=6 m",
    }

    found = picking(load_profile("tuned", [*sets, "charts.picking.room=1 m"]))
    assert found["room"].origin == "--set charts.picking.room=1 m"


def test_a_profile_tells_what_it_says_of_charts(tmp_path: Path) -> None:
    library = load_text(PICKING)
    mine = load_profile("tuned", ["charts={picking: {far: 5 m, other: 1}, absent: {far: 1 m}}"])
    assert mine.chart_values(library) == {"picking.far": ("5 m", f"--set {mine.sets[0]}")}


@pytest.mark.parametrize(
    ("right", "wrong", "place"),
    [
        ("chase.room", "chase.rom", "2:44"),
        ("escape.warning", "escape.warnin", "4:57"),
        ("a: $room", "a: [$profile.chase.rom]", "4:31"),
    ],
)
def test_a_value_that_no_profile_has_is_told_in_the_chart(
    right: str, wrong: str, place: str, tuned: Profile
) -> None:
    text = PICKING.replace(right, wrong)
    with pytest.raises(FileError) as failure:
        picking(tuned, text)

    told = str(failure.value)
    assert told.startswith(f"picking.yaml:{place}: "), told
    assert "there is no value $profile." in told
    assert "in the profile tuned; did you mean 'profile." in told
    assert picking(tuned, text, used=())["far"].default == "4 m"


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("tool_speed", "null", "robot.tool_speed: nothing given; wanted: length"),
        ("base_speed", None, "robot.base_speed: '3.0 m/s' is a speed"),
    ],
)
def test_a_picked_value_that_does_not_fit_is_told_with_its_place(
    tmp_path: Path, key: str, value: str | None, message: str
) -> None:
    line = PAPER[: PAPER.index(f"  {key}:")].count("\n") + 1
    mine = load_profile(written(tmp_path, PAPER))

    with pytest.raises(FileError) as failure:
        picking(mine, PICKING.replace("chase.room", f"robot.{key}"))

    assert f"mine.yaml:{line}:" in str(failure.value)
    assert message in str(failure.value)


def test_a_environment_has_the_room_the_robot_and_the_limits(profile: Profile, robot: Any) -> None:
    room = Room(outer=((0.0, 0.0), (5.0, 0.0), (5.0, 5.0), (0.0, 5.0)))

    environment = profile.environment(room, robot)

    assert environment.limits.base_acceleration == profile.robot.base_acceleration
    assert environment.static_planners["escape"].inflation_radius == 0.77
    assert environment.static_planners["chase"] is environment.static_planners["haptic"]
    declare(signals(environment, profile.settings))


BROKEN = [
    ("base_acceleration: 1.5 m/s2", "base_acceleration: 1.5 m", "base_acceleration.*length"),
    ("inner: 1.5 m", "iner: 1.5 m", "did you mean 'inner'"),
    ("local_planner: profile", "local_planner: profil", "did you mean 'profile'"),
    ("safety:", "safty:", "did you mean 'safety'"),
    ("inform:\n", "charts: 3\ninform:\n", "mapping"),
    ("moving: 0.2 m/s", "moving: [1]", "moving"),
    ("about: The", "about: [The", "mine.yaml:"),
]


@pytest.mark.parametrize(("right", "wrong", "message"), BROKEN)
def test_a_mistake_is_told_with_its_place(
    tmp_path: Path, right: str, wrong: str, message: str
) -> None:
    assert right in PAPER
    file = written(tmp_path, PAPER.replace(right, wrong, 1))

    with pytest.raises(FileError) as failure:
        load_profile(file)

    text = str(failure.value)
    assert re.match(rf"{re.escape(str(file))}:\d+:\d+: ", text)
    assert re.search(message, text)


SENSELESS = [  # a wrong sign, a wrong unit, nothing at all
    (
        "base_acceleration: 1.5 m/s2",
        "base_acceleration: -1.5 m/s2",
        "base_acceleration: -1.5 is out",
    ),
    ("base_acceleration: 1.5 m/s2", "base_acceleration: 0", "above 0"),
    ("base_yaw_acceleration: 1.0", "base_yaw_acceleration: 0.0", "above 0"),
    ("latency: 0 s", "latency: -1 s", "latency: -1 is out of range, 0 to 1"),
    ("latency: 0 s", "latency: 50", "latency: 50 is out of range"),
    ("inflation: 1.0 m", "inflation: -1.0 m", "inflation: -1 is out"),
    ("max_speed: 2.5 m/s", "max_speed: 25 m/s", "max_speed: 25 is out"),
    ("tolerance: 20 cm", "tolerance: 20", "tolerance: 20 is out"),
    ("yaw_tolerance: 0.1 rad", "yaw_tolerance: 6", "yaw_tolerance: 6 is out"),
    ("window: 0.3 s", "window: 0 s", "window: 0 is out"),
    ("likely: [stays]", "likely: [stys]", "did you mean 'stays'"),
    ("likely: [stays]", "likely: []", "empty"),
    ("half_view: 36 deg", "half_view: 36", "half_view: 36 is out"),
    ("distances: [2.5 m", "distances: [-2.5 m", "distances[0]: -2.5 is out"),
    ("distances: [2.5 m, 1.75 m, 1.0 m]", "distances: []", "empty"),
    ("angles: [20 deg", "angles: [121 deg", "angles[0]: 2.11"),
    ("60 deg, -60 deg]", "60 deg, -121 deg]", "angles[3]: -2.11"),
    ("inner: 1.5 m", "inner: 3.5 m", "3.5 is not below outer"),
    ("cell: 5 cm", "cell: 0 cm", "cell: 0 is out"),
    ("cell: 5 cm", "cell: 0.01 mm", "cell: 1e-05 is out"),
    ("rear: 45 deg", "rear: 330 deg", "nothing is left"),
    ("tie: 0", "tie: .nan", "tie"),
    ("radius: 1.0 m", "radius: 0 m", "radius: 0 is out"),
    ("{ur10: [0.39 rad, ", "{ur10: [", "needs 6 to 7 values, has 5"),
    ("tool_speed: null", "tool_speed: -1 m/s", "tool_speed: -1 is out"),
]


@pytest.mark.requirement(125)
@pytest.mark.parametrize(("right", "wrong", "message"), SENSELESS)
def test_a_value_that_cannot_be_meant_is_refused_with_its_place(
    tmp_path: Path, right: str, wrong: str, message: str
) -> None:
    assert right in PAPER
    line = PAPER[: PAPER.index(right)].count("\n") + 1

    with pytest.raises(FileError) as failure:
        load_profile(written(tmp_path, PAPER.replace(right, wrong, 1)))

    assert f"mine.yaml:{line}:" in str(failure.value)
    assert message in str(failure.value)


@pytest.mark.parametrize(
    ("charts", "message"),
    [
        ("{chase: {room: 3 s}}", "charts.chase.room: '3 s' is a duration"),
        ("{chase: {rom: 3 m}}", "charts.chase.rom: no such parameter; did you mean 'room'"),
        ("{chas: {room: 3 m}}", "charts.chas.room: no such chart; did you mean 'chase'"),
    ],
)
def test_a_wrong_value_for_a_chart_is_told_with_its_place(
    tmp_path: Path, charts: str, message: str
) -> None:
    file = written(tmp_path, f"{PAPER}charts: {charts}\n")
    library = load_files(sorted(CHARTS.glob("*.yaml")))

    with pytest.raises(FileError) as failure:
        require("validate", profile=load_profile(file), library=library)

    line = PAPER.count("\n") + 1
    assert f"mine.yaml:{line}:" in str(failure.value)
    assert message in str(failure.value)


def test_an_unknown_profile_names_the_known_ones() -> None:
    with pytest.raises(FileError, match="did you mean 'tuned'"):
        load_profile("tunde")


def test_the_hash_is_that_of_the_file(tmp_path: Path, paper: Profile) -> None:
    other = load_profile(written(tmp_path, PAPER.replace("cell: 5 cm", "cell: 10 cm")))

    assert load_profile("paper").sha256 == paper.sha256
    assert other.sha256 != paper.sha256
    assert other.settings.chase.cell == 0.1


def test_all_mistakes_of_a_profile_are_told_at_once(tmp_path: Path) -> None:
    wrong = PAPER.replace("inner: 1.5 m", "inner: 1.5 s").replace("half_view", "half_veiw")
    wrong = wrong.replace("latency: 0 s", "latency: 5 s").replace(
        "{planner: exact", "{planner: exat"
    )

    with pytest.raises(FileError) as failure:
        load_profile(written(tmp_path, wrong))

    told = [finding.message.partition(":")[0] for finding in failure.value.findings]
    assert told == [
        "plant.latency", "navigation.chase.planner", "navigation.haptic.planner",
        "navigation.escape.planner", "escape.half_veiw", "chase.inner",
    ]  # fmt: skip


@pytest.mark.parametrize("body", ["rbkairos_ur10", "rbkairos_plus_ur10"])
def test_the_shipped_profiles_go_with_the_shipped_robots(profile: Profile, body: str) -> None:
    assert not unsuited(profile, load_robot(body))


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ("inflation: 77 cm", "inflation: 72 cm", "navigation.escape.inflation: 0.72 m is too lit"),
        ("inflation: 1.0 m", "inflation: 30 cm", "needs 0.7254 m to turn"),
        ("user_radius: 1.27 m", "user_radius: 1.2 m", "user_radius: 1.2 m is too little for rbk"),
        ("{ur10: [0.39 rad", "{ur10: [7 rad", "robot.arm_parked.ur10: rbkairos_ur10: arm: "),
    ],
)
def test_a_profile_that_a_robot_cannot_keep_is_told_with_its_place(
    tmp_path: Path, right: str, wrong: str, message: str
) -> None:
    assert right in PAPER
    line = PAPER[: PAPER.index(right)].count("\n") + 1
    mine = load_profile(written(tmp_path, PAPER.replace(right, wrong, 1)))

    told = unsuited(mine, load_robot("rbkairos_ur10"))

    assert f"mine.yaml:{line}:" in told
    assert message in told


def test_a_robot_that_is_alone_needs_no_room_beside_a_person(tmp_path: Path) -> None:
    text = PAPER.replace("user_radius: 1.27 m", "user_radius: 1 m")

    mine, robot = load_profile(written(tmp_path, text)), load_robot("rbkairos_ur10")

    assert "user_radius: 1 m is too little" in unsuited(mine, robot)
    assert "user_radius" in unsuited(mine, robot, Uses(frozenset({"base", "vr"}), frozenset()))
    assert not unsuited(mine, robot, Uses(frozenset({"base"}), frozenset()))


def test_both_profiles_spell_out_the_same_errors_of_simulated_sensors(profile: Profile) -> None:
    assert profile.plant.sensing == SensorErrors()
    named = {name.removeprefix("plant.sensing.") for name in profile.places}
    assert set(flat(SensorErrors())) - {"vive.restart.x", "vive.restart.y"} <= named


def test_a_floor_without_slip_and_wrong_errors_are_told(tmp_path: Path) -> None:
    firm = re.sub(r"slip: .*", "slip: null", PAPER)
    assert load_profile(written(tmp_path, firm)).plant.sensing.slip is None
    for wrong, told in {
        "outliers: 1 %": ("outliers: 120 %", "outliers"),
        "jump: [15 mm, 47 mm]": ("jump: [50 mm, 47 mm]", "jump: the first"),
        "lost_for: 0.5 s": ("lost_for: 70 s", "lost_for"),
    }.items():
        with pytest.raises(FileError, match=told[1]):
            load_profile(written(tmp_path, PAPER.replace(wrong, told[0])))


def test_mounts_that_are_off_are_of_sensors_that_the_robot_has(tmp_path: Path) -> None:
    setting = "plant.sensing.mount_error.{}={{x: 2 cm, y: 0, yaw: 1 deg}}"
    robot = load_robot("rbkairos_ur10")
    mine = load_profile("tuned", [setting.format("front_laser")])

    assert not unsuited(mine, robot)
    off = mine.plant.sensing.mount_error["front_laser"]
    assert (off.x, off.yaw) == pytest.approx((0.02, 0.0174533), rel=1e-5)
    told = unsuited(load_profile("tuned", [setting.format("front_lasr")]), robot)
    assert re.search(r"no such scanner or tracker.*front_laser", told)
