"""States in FlexBE's manner, run in charts."""

import sys

import pytest

from cobodeck.__main__ import main
from cobodeck.flexbe_states import PlainRecord, flexbe_modules
from cobodeck.terminal import USAGE, Problem

HOOKS = """
from flexbe_core import EventState, Logger

class Steps(EventState):
    def __init__(self, ticks=2):
        super(Steps, self).__init__(outcomes=['done'])
        self._ticks, self._left = ticks, 0
        Logger.loginfo('made %s' % self.name)
    def on_start(self): Logger.loginfo('start')
    def on_enter(self, userdata):
        Logger.loginfo('enter')
        self._left = self._ticks
    def execute(self, userdata):
        self._left -= 1
        if self._left < 0:
            return 'done'
    def on_exit(self, userdata): Logger.loginfo('exit')
    def on_pause(self, userdata): Logger.loginfo('pause')
    def on_resume(self, userdata): Logger.loginfo('resume')
    def on_stop(self): Logger.loginfo('stop')
"""


def notes(sim) -> list[str]:
    sim.run.trace.trim()
    return [record[3] for record in sim.run.trace.raw if record[0] == "note"]


def test_hooks_are_called_once_and_in_order(tea) -> None:
    sim = tea.start("{do: Steps, next: {done: .done}}")
    sim.tick(6)
    assert sim.outcome == "done"
    assert notes(sim) == ["made a", "start", "enter", "exit", "stop"]


def test_an_object_lives_across_entries(tea) -> None:
    sim = tea.start("{do: Steps, with: {ticks: 1}, next: {done: a}}")
    sim.tick(8)
    sim.run.close()
    heard = notes(sim)
    assert heard[:3] == ["made a", "start", "enter"]
    assert heard.count("enter") == heard.count("exit") > 2
    assert [heard.count(once) for once in ("made a", "start", "stop")] == [1, 1, 1]


def test_a_pause_is_heard_by_a_running_state(tea) -> None:
    sim = tea.start("{do: Steps, with: {ticks: 9}, next: {done: .done}}")
    sim.tick(2)
    sim.operator.pause()
    sim.tick(3)
    sim.operator.resume()
    sim.tick(2)
    assert notes(sim)[2:] == ["enter", "pause", "resume"]


def test_a_state_that_is_stopped_still_exits(tea) -> None:
    sim = tea.start(
        "{do: Steps, with: {ticks: 99}, timeout: 0.1 s, next: {done: .done, timeout: .done}}"
    )
    sim.tick(8)
    assert sim.outcome == "done"
    assert notes(sim)[2:] == ["enter", "exit", "stop"]


KEYS = """
from flexbe_core import EventState
from collections import deque

class Cup(object):
    def __init__(self): self.level = 0

class Fill(EventState):
    def __init__(self):
        super().__init__(outcomes=['done', 'empty'], input_keys=['amount', 'cups'],
                         output_keys=['sum', 'cups', 'kept'])
    def execute(self, userdata):
        assert 'amount' in userdata and 'kept' not in userdata
        cup = Cup()
        cup.level = userdata['amount'] + 1
        userdata['cups'].append(userdata.amount)
        userdata.sum = {'cup': cup, 'all': deque(userdata.cups)}
        return 'done'

class Level(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'], input_keys=['sum'], output_keys=['level'])
    def execute(self, userdata):
        userdata.level = userdata.sum['cup'].level * 10
        return 'done'

class Spill(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'], output_keys=['out'])
    def execute(self, userdata):
        userdata.other = 1
        return 'done'

class Lock(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'], output_keys=['out'])
    def execute(self, userdata):
        userdata.out = lambda: 1
        return 'done'
"""
TWO = """
chart: two
outcomes: [done]
inputs: {amount: any, cups: any}
outputs: {done: {level: any, sum: any, cups: any, kept: any}}
states:
  fill: {do: Fill, in: {amount: amount, cups: cups}, out: {sum: sum, cups: cups, kept: kept},
         next: {done: level, empty: level}}
  level: {do: Level, in: {sum: sum}, out: {level: level}, next: {done: .done}}
"""


def test_userdata_is_frozen_in_charts_and_free_in_states(tea) -> None:
    from cobodeck.testing import ChartTester

    cups = (1, 2)
    chart = TWO
    sim = ChartTester(tea.folder, tea.folder)
    sim.start(chart, real=["fill", "level"], inputs={"amount": 4, "cups": cups})
    sim.tick(5)
    assert sim.outcome == "done", sim.run.errors
    assert sim.results["level"] == 50
    assert sim.results["cups"] == (1, 2, 4)
    assert sim.results["kept"] is None
    assert cups == (1, 2)
    found = sim.results["sum"]
    assert isinstance(found, PlainRecord)
    assert (found["all"], found["cup"].level) == ((1, 2, 4), 5)


@pytest.mark.parametrize(
    ("state", "told"),
    [
        ("Spill", "userdata.other is set, and is not among its output keys: out"),
        ("Lock", "userdata.out: a function cannot be a value of a chart"),
    ],
)
def test_a_wrong_output_is_an_error(tea, state: str, told: str) -> None:
    sim = tea.start(f"{{do: {state}, next: {{done: .done, error: .done}}}}")
    sim.tick(3)
    assert told in str(next(iter(sim.run.errors)))


ARGUMENTS = """
from flexbe_core import EventState

class Choice(EventState):
    '''
    Chooses.

    -- outcomes  string[]  What there is.
    -- pick      int       Which one.
    -- wait      float     How long, s.

    <= later     not yet
    '''
    FIRST = 'later'
    def __init__(self, outcomes, pick=0, wait=0.1):
        super().__init__(outcomes=[self.FIRST] + outcomes)
        self._pick, self._all = pick, outcomes
    def execute(self, userdata):
        return self._all[self._pick]

class Ends(EventState):
    def __init__(self):
        super().__init__(outcomes=['error', 'timeout', 'very bad'])
    def execute(self, userdata):
        return 'very bad'

class ByKeys(EventState):
    def __init__(self, keys):
        super().__init__(outcomes=['done'], input_keys=keys)

class Fixed(ByKeys):
    def __init__(self):
        super().__init__(['x', 'y'])
    def execute(self, userdata):
        return 'done' if [userdata[key] for key in self._input_keys] == [1, 2] else None

class Computed(EventState):
    def __init__(self, count=2):
        super().__init__(outcomes=['end%d' % i for i in range(count)])
"""


def test_outcomes_may_be_arguments(tea) -> None:
    known = tea.catalogue
    choice = known.interfaces["Choice"]
    assert choice.outcomes == ("later", "$outcomes")
    kinds = {name: str(found.type) for name, found in choice.parameters.items()}
    assert kinds == {"outcomes": "list of text", "pick": "integer", "wait": "number"}
    assert "Which one." in choice.about
    assert known.interfaces["Computed"].outcomes == ("end0", "end1")
    sim = tea.start(
        "{do: Choice, with: {outcomes: [tea, milk], pick: 1},"
        " next: {tea: .tea, milk: .milk, later: .tea}}",
        "tea, milk",
    )
    sim.tick(3)
    assert sim.outcome == "milk"


def test_outcomes_of_the_engine_get_an_underscore(tea) -> None:
    sim = tea.start("{do: Ends, next: {error_: .a, timeout_: .b, very_bad: .c}}", "a, b, c")
    sim.tick(3)
    assert sim.outcome == "c"


def test_keys_that_are_arguments_are_given_by_a_derived_class(tea) -> None:
    why = tea.catalogue.strangers["ByKeys"]
    assert "its input keys depend on arguments" in why
    assert "class Mine(ByKeys)" in why
    sim = tea.start("{do: Fixed, in: {x: x, y: y}, next: {done: .done}}", inputs={"x": 1, "y": 2})
    sim.tick(3)
    assert sim.outcome == "done"


CLOCKS = """
import time
import rospy
from rospy.exceptions import ROSInterruptException
from flexbe_core import EventState
from rclpy.duration import Duration

class Waits(EventState):
    def __init__(self, seconds):
        super().__init__(outcomes=['done'])
        self._span, self._wanted = Duration(seconds=seconds), rospy.Duration(seconds)
    def on_enter(self, userdata):
        self._began, self._old = self._node.get_clock().now(), rospy.Time.now()
        self._rate.sleep()
    def execute(self, userdata):
        new = self._node.get_clock().now() - self._began >= self._span
        old = rospy.Time.now() - self._old >= self._wanted
        assert new == old == (rospy.get_time() - self._old.to_sec() >= self._wanted.to_sec() - 1e-9)
        assert abs(time.time() - rospy.get_time()) < 1e-9
        if new:
            print('waited', round((rospy.Time.now() - self._old).to_sec(), 1))
            return 'done'

class Blocked(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'])
    def execute(self, userdata):
        while True:
            rospy.sleep(0.3)

class Slow(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'])
        self.set_rate(2)
        self.count = 0
    def execute(self, userdata):
        self.count += 1
        return 'done' if self.count == 3 else None
"""


def test_time_is_that_of_the_run(tea) -> None:
    sim = tea.start("{do: Waits, with: {seconds: 1.5}, next: {done: .done}}")
    sim.until(lambda: sim.outcome, timeout=3)
    assert sim.now == pytest.approx(1.5, abs=0.07)
    assert notes(sim) == ["waited 1.5"]


def test_a_state_that_would_block_the_run_is_refused(tea) -> None:
    sim = tea.start("{do: Blocked, next: {done: .done, error: .done}}")
    sim.tick(3)
    assert "would hold up the whole run; return None from execute" in str(
        next(iter(sim.run.errors))
    )


def test_a_rate_is_kept(tea) -> None:
    sim = tea.start("{do: Slow, next: {done: .done}}")
    sim.until(lambda: sim.outcome, timeout=3)
    assert sim.now == pytest.approx(1.0, abs=0.1)


LATE = (
    HOOKS.replace("Steps", "Late")
    + """
    def on_enter(self, userdata):
        from std_msgs.msg import String
        from .steps import Steps
        Logger.logwarn(String(data='late ' + Steps.__name__).data)
"""
)
MODULES = {"steps": HOOKS, "keys": KEYS, "arguments": ARGUMENTS, "clocks": CLOCKS, "late": LATE}


def test_nothing_stands_in_for_others(tea) -> None:
    sim = tea.start("{do: Late, next: {done: .done}}")
    sim.tick(6)
    assert "warning: late Steps" in notes(sim)
    for name in ("flexbe_core", "rospy", "std_msgs", "std_msgs.msg", "rclpy"):
        assert name not in sys.modules


BROKEN = """from flexbe_core import EventState
class Lost(EventState):
    pass
raise OSError('no device')
"""


def test_a_module_of_a_package_that_raises_is_left_out_and_told(fresh) -> None:
    file = fresh.write("broken", BROKEN)
    fresh.write("steps", HOOKS)
    known = fresh.catalogue
    assert "Steps" in known.interfaces
    assert f"{file}:4: OSError: no device" in known.strangers["Lost"]
    assert f"{file}:4: OSError: no device" in known.doubts[0]


def test_a_module_that_is_named_and_raises_is_a_problem(fresh) -> None:
    file = fresh.write("broken", BROKEN)
    project = fresh.folder / "pyproject.toml"
    project.write_text(
        project.read_text().replace(f'"{fresh.package}"', f'"{fresh.package}.broken"')
    )
    with pytest.raises(Problem, match=f"{file}:4: OSError: no device"):
        _ = fresh.catalogue


def test_python_2_is_told_with_its_line(fresh) -> None:
    file = fresh.write("old", HOOKS + "\nprint 'old'\n")
    assert f"{file}:{len(HOOKS.splitlines()) + 2}" in fresh.catalogue.strangers["Steps"]


HELPED = """
from flexbe_core import EventState
from .calm import TOPIC

class Helped(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'])
    def execute(self, userdata):
        return 'done' if TOPIC == ('kettle', 1.5) else None
"""
CALM = "from .ros_helper import NAME, WAIT\nTOPIC = (NAME, WAIT.to_sec())\n"
ROS_HELPER = """
import rospy
from std_msgs.msg import String
NAME, WAIT = String(data='kettle').data, rospy.Duration(1.5)
"""
DERIVED = """
from . import helped
class Derived(helped.Helped):
    pass
"""


def test_helpers_of_states_find_what_they_import_from_ros(fresh) -> None:
    fresh.write("helped", HELPED)
    fresh.write("calm", CALM)
    fresh.write("ros_helper", ROS_HELPER)
    fresh.write("derived", DERIVED)  # its text names no module of FlexBE
    known = fresh.catalogue
    assert known.doubts == ()
    assert {"Helped", "Derived"} <= known.interfaces.keys()
    sim = fresh.start("{do: Derived, next: {done: .done}}")
    sim.tick(2)
    assert sim.outcome == "done"


def test_a_module_of_ones_own_that_only_mentions_flexbe_is_left_alone(fresh) -> None:
    own = "import time\n# once a state of flexbe_core\nMINE = time.monotonic\n"
    fresh.write("own", own)
    fresh.write("steps", HOOKS)
    assert fresh.catalogue.doubts == ()
    assert flexbe_modules(fresh.package) == (f"{fresh.package}.steps",)


def test_list_tells_why_a_state_was_left_out(fresh, monkeypatch, capsys) -> None:
    file = fresh.write("broken", BROKEN)
    monkeypatch.chdir(fresh.folder)
    assert main(["list", "states", "Lost"]) == USAGE
    assert f"no 'Lost' among the states: it cannot be imported: {file}:4" in capsys.readouterr().err


BAD = """
from flexbe_core import EventState

class TwoEnds(EventState):
    def __init__(self):
        super().__init__(outcomes=['very bad', 'very-bad'])

class TwoKeys(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'], input_keys=['a b', 'a_b'])

class Good(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'])
    def execute(self, userdata):
        return 'done'

class Good(EventState):
    def __init__(self):
        super().__init__(outcomes=['done', 'again'])
"""
SECOND = BAD[: BAD.index("class TwoEnds")] + BAD[BAD.index("class Good") :].partition("\n\n")[0]


def test_a_bad_class_is_left_out_alone_and_told(fresh) -> None:
    file = fresh.write("bad", BAD)
    copy = fresh.write("copied", SECOND + "\n")
    own = fresh.write("wait", SECOND.replace("Good", "Wait") + "\n")
    known = fresh.catalogue
    assert known.interfaces["Good"].outcomes == ("done", "again")
    assert known.module_of("Wait") == "states.watching.states"
    told = {
        "TwoEnds": f"{file}:4: its outcomes 'very bad' and 'very-bad' are both 'very_bad'",
        "TwoKeys": f"{file}:8: its input keys 'a b' and 'a_b' are both 'a_b' in a chart",
        "Good": f"{copy}:4: {fresh.package}.copied.Good: a state of this name is also in",
        "Wait": f"{own}:4: {fresh.package}.wait.Wait: a state of this name is also in",
    }
    for name, why in told.items():
        assert known.strangers[name].startswith(why)
        assert [doubt for doubt in known.doubts if doubt.startswith(why)]
    assert f"{file}:18: Good is defined again" in "\n".join(known.doubts)
    assert len(known.doubts) == 5


ODD = """
from flexbe_core import EventState

class Odd(EventState):
    '''
    Takes odd keys.

    ># self   int   the first
    ># a b    int   the second
    #> class  int   all of them
    <= error        it is too much
    '''
    def __init__(self):
        super().__init__(outcomes=['done', 'error'], input_keys=['self', 'ctx', 'a b', 'for'],
                         output_keys=['class', 'a b'])
    def execute(self, userdata):
        userdata['class'] = sum(userdata[key] for key in ('self', 'ctx', 'a b', 'for'))
        userdata['a b'] = 5
        return 'done' if userdata['class'] == 10 else 'error'
"""


def test_keys_that_no_chart_can_have_get_another_name(fresh) -> None:
    fresh.write("odd", ODD)
    odd = fresh.catalogue.interfaces["Odd"]
    assert tuple(odd.inputs) == ("self_key", "ctx_key", "a_b", "for")
    assert tuple(odd.outputs["done"]) == ("class", "a_b")
    assert odd.meanings["error_"] == "it is too much"
    assert odd.output_meanings["class"] == "all of them"
    sim = fresh.start(
        "{do: Odd, in: {self_key: p, ctx_key: q, a_b: r, for: s}, next: {done: .done, error_: a}}",
        inputs={"p": 1, "q": 2, "r": 3, "s": 4},
    )
    sim.tick(2)
    assert sim.outcome == "done", sim.run.errors
