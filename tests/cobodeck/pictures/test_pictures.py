"""Pictures of rooms: what is in them, that they repeat, and what is said of bad input."""

import math
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from cobodeck.pictures.drawing.arm_outline import ARM, HELD
from cobodeck.pictures.drawing.room_drawing import OBJECT, PLACE
from cobodeck.pictures.spaces import DROPPED, PATH, colours
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle, FancyArrowPatch

from behaviors import haptic
from behaviors.escape import escape_candidates, escape_poses, paper_escape
from behaviors.profile.profile import load_profile
from cobodeck.__main__ import main
from cobodeck.evaluate.evaluators import arm_outline
from cobodeck.pictures.drawing.canvas import form_of, save
from cobodeck.pictures.drawing.moment import Moment, after, at_start, situation_at, with_next_drive
from cobodeck.pictures.scene_picture import levels, next_deep, scene_picture
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.terminal.console import FAILED, OK, USAGE, Problem
from engine.draw.style import RED
from hw.geometry import Pose2
from hw.model.robot import load_robot
from hw.samples import UserPose
from hw.scene.objects import Thing
from hw.scene.scene import load_scene
from hw.sim.world import World


class Place:
    """A scene with the values of the paper's profile."""

    def __init__(self, name, profile="paper"):
        self.scene = load_scene(name)
        self.profile = load_profile(profile)
        self.settings = self.profile.settings
        self.environment = self.profile.environment(self.scene.room, load_robot(self.scene.robot))

    def draw(self, moment, spaces=None):
        return scene_picture(self.scene, self.environment, self.profile, moment, spaces)


def user(x, y, yaw):
    return UserPose(Pose2(x, y, yaw), yaw)


def arrows(on, colour):
    return [
        patch
        for patch in on.axes.patches
        if isinstance(patch, FancyArrowPatch) and patch.get_edgecolor() == to_rgba(colour)
    ]


def strokes(on, colour):
    lines = [line for line in on.axes.lines if line.get_color() == colour]
    return [line for line in lines if len(line.get_xdata()) == 2]


@pytest.fixture(scope="module")
def hall():
    return Place("hall")


@pytest.fixture(scope="module")
def lab():
    return Place("lab_a")


@pytest.mark.requirement(95)
def test_the_highest_weight_is_purple_and_the_lowest_red():
    low, middle, high = colours(np.array([0.2, 0.5, 0.8]))

    assert low[0] > 0.9
    assert low[2] < 0.1
    assert high[2] > 0.9
    assert high[1] < 0.1
    assert middle[1] > 0.9
    assert (colours(np.array([0.4, 0.4])) == high).all()


@pytest.mark.requirement(93, 94, 95)
def test_every_free_chase_cell_is_a_coloured_square(hall):
    on = hall.draw(Moment(Pose2(7.0, 12.0), user(7.0, 7.0, 0.4)), ("chase",))
    (image,) = on.axes.images
    shown = image.get_array()

    assert np.count_nonzero(shown[..., 3]) == 5998
    assert image.get_extent() == pytest.approx([-3.0, 3.0, -3.0, 3.0])
    ahead, behind = shown[60, 115, 3], shown[60, 5, 3]
    assert ahead == behind == 0.0
    assert shown[60 + 40, 60, 3] == shown[60 - 40, 60, 3] == 1.0


@pytest.mark.requirement(100)
def test_chase_cells_in_the_inflation_of_walls_are_left_out(lab):
    moment = Moment(Pose2(5.0, 8.0), user(2.0, 2.0, 0.8))

    (image,) = lab.draw(moment, ("chase",)).axes.images

    assert 0 < np.count_nonzero(image.get_array()[..., 3]) < 5000


@pytest.mark.requirement(106, 110)
def test_twelve_escape_arrows_have_the_yaw_of_the_robot(hall):
    robot = Pose2(7.0, 9.0, 0.5)

    found = arrows(hall.draw(Moment(robot, user(7.0, 7.0, 1.2)), ("escape",)), RED)

    assert len(found) == 12
    for arrow in found:
        (x1, y1), (x2, y2) = arrow.get_path().vertices[[0, -1]] * 0 + arrow._posA_posB
        assert math.atan2(y2 - y1, x2 - x1) == pytest.approx(0.5)


@pytest.mark.requirement(108)
def test_escape_poses_that_are_not_free_are_grey_and_those_outside_are_left_out(lab):
    robot, person = Pose2(1.6, 8.4, 0.0), user(3.5, 7.0, 2.5)
    free = escape_poses.poses(
        lab.settings, lab.environment.static_planners["escape"], person, robot
    )
    on = lab.draw(Moment(robot, person), ("escape",))

    assert 0 < len(free) < 12
    assert len(arrows(on, RED)) == len(free)
    assert "… not free" in on.legend
    x_low, x_high = on.axes.get_xlim()
    assert (x_low, x_high) == pytest.approx((-0.35, 11.85))


@pytest.mark.requirement(75, 77)
def test_two_of_the_seven_haptic_poses_in_an_obstacle_are_crossed_out(lab):
    person = user(1.9, 5.0, 1.745)
    moment = Moment(Pose2(4.5, 6.5), person)
    deep = next_deep(lab.settings, moment)
    on = lab.draw(Moment(moment.robot, person, deep))

    assert len(haptic.poses(lab.settings, lab.environment.static_planners["haptic"], deep)) == 5
    assert len(strokes(on, DROPPED)) == 2 * 2
    numbers = [text.get_text() for text in on.axes.texts if text.get_text().isdigit()]
    assert numbers == ["1", "2", "3", "4", "5", "6", "7"]
    assert "where the user reaches (DEEP)" in on.legend
    assert "Chase cell: weight low to high" not in on.legend


def test_the_way_leads_from_the_robot_to_the_goal(lab):
    moment = with_next_drive(at_start(lab.scene), lab.environment, lab.settings)
    on = lab.draw(moment)
    way, front = [line for line in on.axes.lines if line.get_color() == PATH]

    assert front.get_xydata()[0] == pytest.approx((moment.goal.x, moment.goal.y))
    assert moment.path[0] == (moment.robot.x, moment.robot.y)
    assert lab.environment.static_planners["chase"].is_free(moment.path[-1])
    assert (way.get_xdata()[-1], way.get_ydata()[-1]) == moment.path[-1]


def test_the_way_to_a_touch_leads_to_a_free_haptic_pose(lab):
    moment = at_start(lab.scene)
    asking = Moment(moment.robot, moment.user, next_deep(lab.settings, moment))

    found = with_next_drive(asking, lab.environment, lab.settings)

    free = haptic.poses(lab.settings, lab.environment.static_planners["haptic"], asking.deep)
    assert found.path[-1] in [(pose.x, pose.y) for pose in free]


def test_the_chosen_pose_is_the_robots_outline_at_the_goal(lab):
    moment = with_next_drive(at_start(lab.scene), lab.environment, lab.settings)
    shape = lab.environment.robot.footprint

    (outline,) = [p for p in lab.draw(moment).axes.patches if p.get_edgecolor() == to_rgba(PATH)]

    assert (moment.goal.x, moment.goal.y) == moment.path[-1]
    front = moment.goal.transform(shape.half_length, shape.half_width)
    assert outline.get_path().vertices[0] == pytest.approx(front)


def ring_of_escape(on):
    circles = [p for p in on.axes.patches if isinstance(p, Circle) and not p.get_fill()]
    return [p.center for p in circles if p.get_edgecolor() == to_rgba(RED)]


@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_the_escape_pose_with_a_ring_is_the_one_that_would_be_driven_to(profile):
    place = Place("lab_a", profile)
    robot, person = Pose2(1.6, 8.4, 0.0), user(3.5, 7.0, 2.5)
    moment = Moment(robot, person)
    planner = place.environment.static_planners["escape"]
    free = escape_poses.poses(place.settings, planner, person, robot)
    now = situation_at(moment, person, place.environment, place.settings)

    if profile == "paper":
        best = paper_escape.first_in_reach(now, free)
    else:
        best = escape_candidates.candidates(now, free).goal

    assert best in free
    assert ring_of_escape(place.draw(moment, ("escape",))) == [(best.x, best.y)]


@pytest.mark.parametrize("robot", [Pose2(1.6, 8.4, -1.57), Pose2(4.0, 5.0, 0.7), Pose2(3.0, 2.0)])
def test_no_number_of_a_pose_is_written_over_the_robot(lab, robot):
    on = lab.draw(Moment(robot, user(3.5, 7.0, 2.5)), ("escape",))
    shape = lab.environment.robot.footprint
    on.figure.canvas.draw()
    to_map = on.axes.transData.inverted()

    assert len(on.axes.texts) > 4
    for text in on.axes.texts:
        corners = to_map.transform(text.get_window_extent().corners())
        inside = [robot.inverse().transform(x, y) for x, y in corners]
        assert not any(abs(x) < shape.half_length and abs(y) < shape.half_width for x, y in inside)


@pytest.fixture(scope="module")
def arm(lab):
    return arm_outline(lab.environment.robot)


def links(on, colours=(ARM, HELD)):
    faces = [to_rgba(colour) for colour in colours]
    return [patch for patch in on.axes.patches if patch.get_facecolor() in faces]


def test_the_arm_is_drawn_where_its_capsules_are(lab, arm):
    robot, joints = Pose2(5.0, 8.0, 0.7), lab.environment.robot.parked
    drawn = links(lab.draw(Moment(robot, joints=joints)))
    ends, radii = arm.capsules_of(joints)
    expected = {
        tuple(np.round(robot.transform(*(0.5 * (start + end))[:2]), 2)): radius
        for (start, end), radius in zip(ends, radii, strict=True)
    }

    assert len(drawn) == len(radii)
    for patch in drawn:
        (x0, y0), (x1, y1) = patch.get_path().get_extents().get_points()
        middle = tuple(np.round((0.5 * (x0 + x1), 0.5 * (y0 + y1)), 2))
        assert any(math.dist(middle, place) < 0.02 for place in expected)
        assert min(x1 - x0, y1 - y0) >= 2.0 * 0.95 * min(radii)


def test_the_prop_is_drawn_where_the_arm_holds_it(lab):
    robot = Pose2(5.0, 8.0, 0.7)
    reaching = (0.0, -1.2, 1.2, -1.57, -1.57, 0.0)

    parked, out = (
        links(lab.draw(Moment(robot, joints=joints)), (HELD,))[0].get_path().get_extents()
        for joints in (lab.environment.robot.parked, reaching)
    )

    near, far = (math.dist((robot.x, robot.y), 0.5 * (box.min + box.max)) for box in (parked, out))
    assert far > near + 0.2


def test_without_joints_no_arm_is_drawn(lab):
    on = lab.draw(at_start(lab.scene))

    assert not links(on)
    assert "arm" not in on.legend


@pytest.mark.requirement(120)
def test_inflations_are_named_after_the_subsystems_that_have_them(lab):
    assert levels(lab.environment.navigation) == [(1.0, "Haptic, Chase"), (0.77, "Escape")]


def test_what_no_map_shows_is_drawn_where_it_first_is(hall):
    place = copy(hall)
    walker = Thing("person", (3.0, 4.0), walks=((5.0, 4.0), (5.0, 6.0)))
    place.scene = replace(hall.scene, objects=(Thing("chair", (9.0, 8.0)), walker))
    on = place.draw(Moment(Pose2(2.0, 2.0)))
    circles = {
        (patch.center, patch.radius)
        for patch in on.axes.patches
        if isinstance(patch, Circle) and patch.get_facecolor() == to_rgba(OBJECT)
    }
    assert circles == {((9.0, 8.0), 0.25), ((3.0, 4.0), 0.5)}
    (way,) = [line for line in on.axes.lines if line.get_color() == OBJECT]
    assert [tuple(xy) for xy in way.get_xydata()] == [(3.0, 4.0), (5.0, 4.0), (5.0, 6.0)]


def test_places_have_their_names_and_an_arrow_along_their_yaw(hall):
    place, robot = copy(hall), Pose2(4.0, 4.0)
    places = {"kitchen": Pose2(3.0, 4.0, 0.5), "dock": Pose2(9.0, 8.0, -2.0)}
    place.scene = replace(hall.scene, places=places)
    on = place.draw(Moment(robot))

    drawn = []
    for arrow in arrows(on, PLACE):
        (x1, y1), (x2, y2) = arrow._posA_posB
        drawn.append(Pose2(x1, y1, pytest.approx(math.atan2(y2 - y1, x2 - x1))))
    assert drawn == list(places.values())
    assert "place, with its yaw" in on.legend
    names = {text.get_text(): Pose2(*text.get_position()) for text in on.axes.texts}
    assert names.keys() == places.keys()
    assert names["kitchen"].distance_to(robot) > hall.environment.robot.footprint.enclosing_radius


def test_a_scene_without_a_user_shows_room_and_robot_alone(hall):
    moment = Moment(Pose2(3.0, 3.0))

    on = hall.draw(with_next_drive(moment, hall.environment, hall.settings))

    assert moment.path == ()
    assert not on.axes.images
    assert "robot with foam, enclosing circle" in on.legend
    assert "user, direction of view" not in on.legend


def test_a_moment_of_a_run_shows_what_goes_on_and_where_to():
    setup = open_setup(None, "lab_a", "paper")

    early = after(setup, Options("cornering"), 0.0)
    asking = after(setup, Options("cornering"), 16.0)

    assert early.robot.distance_to(setup.scene.robot_start) < 0.1
    assert early.caption.startswith("0.0 s, chase")
    assert asking.deep is not None
    assert asking.caption.startswith("16.0 s, haptic/serve")
    assert asking.robot.distance_to(early.robot) > 1.0
    assert len(asking.robot_trail) == len(asking.user_trail) == 91
    assert early.joints is not None
    last, before = asking.robot_trail[-1], asking.robot_trail[-2]
    assert math.hypot(asking.twist.vx, asking.twist.vy) == pytest.approx(
        30.0 * math.dist(last, before), rel=1e-6
    )


def test_a_moment_of_a_run_is_the_end_of_it(monkeypatch):
    closed = []
    monkeypatch.setattr(World, "close", lambda world: closed.append(world))

    after(open_setup("cobodeck", "lab_a"), Options(), 0.5)

    assert [world.now_ns for world in closed] == [500_000_000]


def test_a_run_that_ends_before_the_moment_shows_its_end(tmp_path):
    chart = tmp_path / "park.yaml"
    chart.write_text(
        "chart: park\noutcomes: [done]\nstates:\n"
        "  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}\n"
    )

    moment = after(open_setup(str(chart), "lab_a"), Options(), 60.0)

    assert moment.caption.endswith("s, ended: done")
    assert moment.path == ()


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
@pytest.mark.few(1)
def test_the_same_moment_gives_the_same_file(lab, tmp_path, form):
    moment = with_next_drive(at_start(lab.scene), lab.environment, lab.settings)
    files = [tmp_path / f"{name}.{form}" for name in ("one", "two")]
    for file in files:
        save(lab.draw(moment, ("chase", "escape", "haptic")), file)
    one, two = (file.read_bytes() for file in files)

    assert one == two
    assert len(one) > 10_000
    if form == "svg":
        assert b"Escape pose, in order" in one


def test_other_forms_of_pictures_are_refused(tmp_path):
    with pytest.raises(Problem, match=r"unknown form; allowed: pdf, png, svg"):
        form_of(tmp_path / "room.gif")


DRAWN = [
    "--scene lab_b -o room.svg",
    "--scene study --at 12 -o out/room.png",
    "--scene lab_a --at 1 --user study --requests 2 --profile paper -o room.svg",
    "--scene hall --show chase,escape,haptic -o room.svg",
    "chase --scene lab_a --at 2 -o room.svg",
]


@pytest.mark.parametrize("arguments", DRAWN)
@pytest.mark.few(2)
def test_render_draws_rooms(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    assert main(["render", *arguments.split()]) == OK

    written = arguments.split()[-1]
    assert written in capsys.readouterr().out
    assert (tmp_path / written).stat().st_size > 10_000


WRONG = [  # arguments, exit code, part of the message
    ("", USAGE, "name a CHART, a RECORD, or a room with --scene"),
    ("--scene nowhere", USAGE, "nowhere: no such scene"),
    ("--scene nothing.yaml", USAGE, "nothing.yaml: cannot be read"),
    ("--scene flat.yaml", FAILED, "flat.yaml:3:3: room.outer: has no area"),
    ("--scene lab_a -o room.gif", USAGE, "room.gif: unknown form; allowed: pdf, png, svg"),
    ("--scene lab_a -o flat.yaml/room.svg", FAILED, "flat.yaml"),
    ("--scene lab_a --at -1", USAGE, "-1 is no time"),
    ("--scene lab_a --at nan", USAGE, "nan is no time"),
    ("--scene lab_a --at 1 --user nobody", USAGE, "nobody: no such user"),
    ("--scene lab_a --show chasse", USAGE, "did you mean 'chase'"),
    ("--scene lab_a --profile nothing", USAGE, "nothing: no such profile"),
    ("nothing --scene lab_a --at 1", USAGE, "no chart 'nothing'"),
    ("--scene bare.yaml --at 1", USAGE, "scene bare names no user; give one with --user"),
]


@pytest.mark.parametrize(("arguments", "code", "message"), WRONG)
def test_wrong_input_is_told_without_a_traceback(
    arguments, code, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flat.yaml").write_text(
        "scene: flat\nroom:\n  outer: [[0.0, 0.0], [5.0, 0.0], [9.0, 0.0]]\n"
        "robot: {start: {x: 1, y: 1}}\n"
    )
    (tmp_path / "bare.yaml").write_text(
        "scene: bare\nroom: {outer: [[0, 0], [8, 0], [8, 8], [0, 8]]}\n"
        "robot: {start: {x: 2, y: 2}}\n"
    )

    assert main(["render", *arguments.split()]) == code

    shown = "".join(capsys.readouterr())
    assert message in shown
    assert "Traceback" not in shown


def test_a_scene_without_a_user_can_be_drawn_from_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bare.yaml").write_text(
        "scene: bare\nroom: {outer: [[0, 0], [0.9, 0], [0.9, 9]]}\nrobot: {start: {x: 0.5, y: 2}}\n"
    )

    assert main(["render", "--scene", "bare.yaml"]) == OK
    assert (tmp_path / "bare.svg").is_file()
