import math

import pytest
from hypothesis import assume, example, given, settings, strategies as st

from cobodeck.bench.navigation.drive_trials import OPEN_ROOM, TRIALS, Trial, drive
from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.scene.room import Disc
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.local.local_planner import LocalPlanner
from states.navigation.local.profile_planner import ProfilePlanner
from states.navigation.planner_interfaces import Limits, Tolerance
from tests.repeats import examples

USER = Disc(0.0, 0.0, 1.27)
PLAN_A = ((0.0, 0.0), (11.5, 0.0), (11.5, 10.1), (0.0, 10.1))
WALLS = (
    ((6.65, 0.0), (6.85, 0.0), (6.85, 2.58), (6.65, 2.58)),
    ((6.65, 7.72), (6.85, 7.72), (6.85, 10.1), (6.65, 10.1)),
    ((6.6, 4.9), (6.9, 4.9), (6.9, 5.4), (6.6, 5.4)),
)
LAB = ExactPlanner(PLAN_A, WALLS, inflation_radius=1.0)
FREE = ExactPlanner(OPEN_ROOM, inflation_radius=0.5)


CASES = {trial.name: trial for trial in TRIALS}


def go(planner, start, goal, user=None):
    driver = ProfilePlanner(planner, Limits(), Tolerance())
    return drive(driver, Trial("", start, goal, user, 1.0))


def over_least_time(trial, dt):
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    outcome = drive(driver, trial, dt)
    assert outcome.arrived
    return outcome.time / trial.least_time - 1.0


@pytest.mark.requirement(39, 50)
@pytest.mark.parametrize("hz", [20, 30, 50, 100])
def test_time_to_the_goal_is_near_the_least_possible(hz):
    over = {trial.name: over_least_time(trial, 1.0 / hz) for trial in TRIALS}
    assert max(over.values()) <= 0.07, over
    assert sum(over.values()) / len(over) <= 0.04, over
    assert min(over.values()) >= -0.001, over  # faster than the optimum: a limit was broken


@pytest.mark.requirement(50, 52)
@pytest.mark.parametrize("name", ["S2", "S3", "S4"])
@pytest.mark.parametrize("hz", [20, 30, 50])
def test_the_users_disc_is_never_entered(name, hz):
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    assert drive(driver, CASES[name], 1.0 / hz).intrusion <= 0.0


places = st.tuples(st.floats(1.0, 10.5), st.floats(1.0, 9.1))
yaws = st.floats(-3.1, 3.1)


@pytest.mark.requirement(34, 39, 50, 52)
@settings(deadline=None, max_examples=60, derandomize=True)
@given(start=places, goal=places, person=places, yaw=yaws, goal_yaw=yaws)
def test_every_drive_arrives_within_its_limits_and_touches_nothing(
    start, goal, person, yaw, goal_yaw
):
    user = Disc(*person, 1.27)
    assume(LAB.is_free(start, user) and LAB.plan(start, goal, user) is not None)
    result = go(LAB, Pose2(*start, yaw), Pose2(*goal, goal_yaw), user)
    assert result.arrived
    assert result.intrusion <= 0.0
    assert min(LAB.clearance(place) for place in [start, *result.places]) >= 1.0 - 1e-3
    assert result.speed <= 1.5 + 1e-9
    assert result.acceleration <= 1.0 + 1e-6
    assert result.turn_rate <= 1.0 + 1e-9
    assert result.turn_acceleration <= 1.0 + 1e-6


rings = [PLAN_A[::-1], *WALLS, WALLS[-1], WALLS[-1]]  # the column is passed most often
sides = st.sampled_from(
    [side for ring in rings for side in zip(ring, (*ring[1:], ring[0]), strict=True)]
)
parts = st.one_of(st.sampled_from([0.0, 1.0]), st.floats(0.0, 1.0))
turns = st.one_of(st.just(0.0), st.floats(-1.57, 1.57))


def beside(side, part, turn, depth):
    """A place `depth` m inside the inflation of a side, `turn` rad from its normal to the right."""
    (ax, ay), (bx, by) = side
    reach, angle = 1.0 - depth, math.atan2(by - ay, bx - ax) - 0.5 * math.pi + turn
    x, y = ax + part * (bx - ax), ay + part * (by - ay)
    return x + reach * math.cos(angle), y + reach * math.sin(angle)


TOP = ((6.9, 5.4), (6.6, 5.4))  # of the column


@pytest.mark.requirement(34, 39)
@settings(deadline=None, max_examples=examples(200), derandomize=True)
@given(sides, parts, turns, st.floats(1e-4, 0.03), places)
@example(TOP, 0.57, 0.0, 0.0105, (4.69, 6.51))
@example(TOP, 0.2, 0.0, 0.0194, (5.345, 4.954))
def test_a_robot_a_little_inside_an_inflation_gets_out_and_arrives(side, part, turn, depth, goal):
    start = beside(side, part, turn, depth)
    inside = 0.0 < start[0] < 11.5 and 0.0 < start[1] < 10.1
    assume(inside and 1.0 - depth - 1e-9 <= LAB.clearance(start))
    assume(LAB.plan(start, goal) is not None)
    result = go(LAB, Pose2(*start), Pose2(*goal))
    assert result.arrived
    least = min(LAB.clearance(place) for place in [start, *result.places])
    assert least >= min(LAB.clearance(start), 1.0 - 1e-3) - 1e-5


def test_turning_goes_on_while_driving():
    goal = Pose2(5.0, 0.0, math.pi / 2)
    straight = go(FREE, Pose2(0.0, 0.0), Pose2(5.0, 0.0))
    turning = go(FREE, Pose2(0.0, 0.0), goal)
    assert turning.time <= straight.time + 1e-9


def test_a_goal_that_is_only_a_turn_is_reached_on_the_spot():
    result = go(FREE, Pose2(0.0, 0.0), Pose2(0.0, 0.0, math.pi / 2))
    assert result.arrived
    assert result.speed < 1e-9
    assert result.time == pytest.approx(2.0 * math.sqrt(math.pi / 2), rel=0.1)


def test_having_arrived_is_kept_until_pushed_out_of_twice_the_tolerance():
    driver = ProfilePlanner(FREE, Limits(), Tolerance(position=0.05, yaw=0.1))
    driver.go_to(Pose2(0.0, 0.0))
    for x, status in [(0.04, "arrived"), (0.09, "arrived"), (0.2, "driving")]:
        driver.command(Pose2(x, 0.0), STILL, None, 0.05)
        assert driver.status == status


def test_passing_the_goal_fast_is_not_arriving():
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(0.0, 0.0))
    driver.command(Pose2(0.0, 0.0), Twist2(0.5), None, 0.05)
    assert driver.status == "driving"


def test_without_a_way_the_robot_brakes_within_its_limits():
    driver = ProfilePlanner(LAB, Limits(), Tolerance())
    driver.go_to(Pose2(20.0, 5.0))
    command = driver.command(Pose2(3.0, 5.0), Twist2(1.0, 0.5), None, 0.05)
    assert driver.status == "blocked"
    assert command.speed == pytest.approx(math.hypot(1.0, 0.5) - 0.05)
    assert command.vy / command.vx == pytest.approx(0.5)


def test_a_new_goal_is_taken_without_stopping():
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(5.0, 0.0))
    pose, twist = Pose2(0.0, 0.0), Twist2(1.0)
    driver.command(pose, twist, None, 0.05)
    driver.go_to(Pose2(5.0, 1.0))
    assert driver.command(pose, twist, None, 0.05).speed > 1.0


def way_side(driver, user, x=-4.0, y=0.0):
    driver.command(Pose2(x, y), STILL, user, 0.05)
    return math.copysign(1.0, driver.path.points[1][1])


def test_the_way_round_the_user_is_kept_until_the_other_is_a_tenth_faster():
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(4.0, 0.0))
    assert way_side(driver, Disc(0.0, -0.1, 1.27)) == 1.0
    assert way_side(driver, Disc(0.0, 0.1, 1.27)) == 1.0
    assert way_side(driver, Disc(0.0, 1.0, 1.27)) == -1.0
    assert way_side(driver, Disc(0.0, -0.1, 1.27)) == -1.0


def test_what_somebody_else_slowed_goes_on_from_the_measured_speed():
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(9.0, 0.0))
    for _ in range(20):
        command = driver.command(Pose2(0.0, 0.0), Twist2(1.5), None, 0.05)
    assert command.speed == pytest.approx(1.5)
    assert driver.command(Pose2(0.0, 0.0), STILL, None, 0.05).speed == pytest.approx(0.05)


@pytest.mark.requirement(52)
def test_no_command_is_sent_from_which_braking_would_end_in_the_user():
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(9.0, 0.0))
    driver.command(Pose2(0.0, 0.0), Twist2(1.5), None, 0.05)
    command = driver.command(Pose2(0.0, 0.0), Twist2(1.5), Disc(2.4, 0.0, 1.27), 0.05)
    assert command.speed < 1.46


class Faster(LocalPlanner):
    """Wants to go faster along x in every cycle."""

    def _begin(self):
        pass

    def _wanted(self, pose, now, user, dt):
        return Twist2(now.vx + self._limits.acceleration * dt)


@pytest.mark.requirement(52)
@pytest.mark.parametrize(
    ("gap", "speed"),
    # from 1.05, 1.025, 1, 0.975 and 0.95 m/s it stops after 0.603, 0.576, 0.55, 0.525, 0.5 m
    [(0.61, 1.05), (0.58, 1.025), (0.56, 1.0), (0.53, 0.975), (0.505, 0.95), (0.4, 0.95)],
)
def test_of_a_velocity_that_is_too_fast_as_much_is_sent_as_can_be_braked_from(gap, speed):
    driver = Faster(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(9.0, 0.0))
    user = Disc(gap + 1.27, 0.0, 1.27)
    command = driver.command(Pose2(0.0, 0.0), Twist2(1.0), user, 0.05)
    assert command.vx == pytest.approx(speed)


def test_a_user_who_comes_too_near_is_left_straight_away():
    result = go(FREE, Pose2(1.0, 0.1), Pose2(5.0, 0.0), Disc(0.0, 0.0, 1.27))
    assert result.arrived
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(-5.0, 0.0))
    command = driver.command(Pose2(0.6, 0.8), STILL, USER, 0.05)
    assert command.vx / command.vy == pytest.approx(0.75, rel=1e-6)


@pytest.mark.requirement(2)
@settings(deadline=None, max_examples=25, derandomize=True)
@given(start=places, goal=places, yaw=yaws, goal_yaw=yaws)
@example(start=(5.0, 4.5), goal=(8.0, 1.0), yaw=1.0, goal_yaw=0.0)
def test_in_differential_mode_the_robot_never_goes_sideways_and_arrives(start, goal, yaw, goal_yaw):
    assume(LAB.plan(start, goal) is not None)
    assume(LAB.is_free(start))
    driver = ProfilePlanner(LAB, Limits(), Tolerance(), "differential")
    driver.go_to(Pose2(*goal, goal_yaw))
    pose, twist = Pose2(*start, yaw), STILL
    for _ in range(1200):
        before, twist = twist, driver.command(pose, twist, None, 0.05)
        assert twist.vy == 0.0
        assert abs(twist.vx - before.vx) <= 0.05 + 1e-9
        assert abs(twist.vx * twist.wz) <= 1.1
        look = pose.yaw + 0.5 * twist.wz * 0.05
        mean = 0.5 * (before.vx + twist.vx) * 0.05
        x, y = pose.x + mean * math.cos(look), pose.y + mean * math.sin(look)
        pose = Pose2(x, y, wrap(pose.yaw + twist.wz * 0.05))
        assert LAB.clearance((x, y)) >= 1.0 - 0.02
        if driver.status == "arrived":
            break
    assert driver.status == "arrived"


@pytest.mark.requirement(2)
def test_the_mode_may_be_changed_while_driving():
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(0.0, 5.0))
    assert driver.command(Pose2(0.0, 0.0), STILL, None, 0.05).vy > 0.0
    driver.mode = "differential"
    assert driver.command(Pose2(0.0, 0.0), STILL, None, 0.05).vy == 0.0


@pytest.mark.parametrize(
    "pose", [Pose2(math.nan, 0.0), Pose2(0.0, math.inf), Pose2(0.0, 0.0, math.nan)]
)
def test_a_pose_that_is_no_number_is_refused(pose):
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(1.0, 1.0))
    with pytest.raises(ValueError, match="pose"):
        driver.command(pose, STILL, None, 0.05)


def test_a_command_without_a_goal_is_a_mistake_that_is_named():
    with pytest.raises(ValueError, match="go_to"):
        ProfilePlanner(FREE, Limits(), Tolerance()).command(Pose2(0.0, 0.0), STILL, None, 0.05)


def test_the_same_inputs_give_the_same_bits():
    runs = [go(FREE, CASES["S3"].start, CASES["S3"].goal, USER) for _ in range(2)]
    assert runs[0] == runs[1]


def test_where_the_user_stands_on_the_goal_the_robot_still_leaves_the_users_disc():
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(-0.2, 0.0))
    command = driver.command(Pose2(1.0, 0.0), STILL, USER, 0.05)
    assert driver.status == "blocked"
    assert command.vx == pytest.approx(0.05)


@pytest.mark.requirement(39, 52)
def test_a_goal_at_the_edge_of_the_users_disc_is_reached_while_their_pose_jumps():
    """The disc ends at the goal by each measured pose; it is avoided where it is reckoned to be."""
    goal, start = Pose2(7.0, 5.0), Pose2(3.5, 5.0)
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(goal)

    for tick in range(30):
        x, y = 8.31 - 0.044 * (tick < 10), 5.0 + 0.002 * (tick % 3)
        disc = Disc(x, y, math.dist((x, y), (goal.x, goal.y)))
        driver.command(start, STILL, disc, 1.0 / 30.0)
        assert driver.path is not None, tick


@pytest.mark.requirement(34, 39, 52)
@pytest.mark.parametrize("depth", [0.0005, 0.003, 0.02])
def test_beside_the_end_of_a_wall_a_robot_leaves_the_users_disc(depth):
    """It is a little too near to the wall, and straight away from the user it passes its end."""
    start, user = Pose2(6.65 - 1.0 + depth, 7.9), Disc(6.65 - 1.0, 9.4, 1.8)
    outcome = go(LAB, start, Pose2(8.6, 8.0), user)
    assert outcome.arrived
