"""States in FlexBE's manner that use topics, services and actions."""

from pathlib import Path

import pytest

from cobodeck import flexbe_states
from cobodeck.flexbe_states import load_topics, wired_topics
from cobodeck.testing import ChartTester
from cobodeck.validation import FileChecker
from hw import Pose2, Twist2

TALKS = """
import rospy
from flexbe_core import EventState, Logger
from flexbe_core.proxy import ProxyPublisher, ProxySubscriberCached
from flexbe_core.proxy import ProxyServiceCaller, ProxyActionClient
from geometry_msgs.msg import Twist, PoseStamped, Pose, Point, Quaternion
from nav_msgs.msg import Odometry
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerRequest
from tea_msgs.msg import PourAction, PourGoal
from tea_msgs.action import Pour
from actionlib_msgs.msg import GoalStatus
from tf.transformations import euler_from_quaternion, quaternion_from_euler

class Drive(EventState):
    def __init__(self, topic='/cmd_vel', speed=0.5):
        super().__init__(outcomes=['done'])
        self._topic = topic
        self._pub = ProxyPublisher({self._topic: Twist})
        self._twist = Twist()
        self._twist.linear.x = speed
    def execute(self, userdata):
        self._pub.publish(self._topic, self._twist)

class Say(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'])
        self._pub = rospy.Publisher('/say', String, queue_size=1)
    def execute(self, userdata):
        self._pub.publish('tea is ready')
        return 'done'

class Where(EventState):
    def __init__(self, topic):
        super().__init__(outcomes=['done'], output_keys=['yaw'])
        self._topic = topic
        self._sub = ProxySubscriberCached({self._topic: Odometry})
    def on_enter(self, userdata):
        self._sub.remove_last_msg(self._topic)
    def execute(self, userdata):
        if self._sub.has_msg(self._topic):
            pose = self._sub.get_last_msg(self._topic).pose.pose
            turn = pose.orientation
            userdata.yaw = euler_from_quaternion([turn.x, turn.y, turn.z, turn.w])[2]
            return 'done'

class Bells(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'], output_keys=['heard'])
        self._heard = []
        ProxySubscriberCached().subscribe('/bell', String, self.ring, buffered=True)
    def ring(self, message):
        self._heard.append(message.data)
    def execute(self, userdata):
        if len(self._heard) == 3:
            kept = []
            while ProxySubscriberCached.has_buffered('/bell'):
                kept.append(ProxySubscriberCached.get_from_buffer('/bell').data)
            userdata.heard = [self._heard, kept]
            return 'done'

class Level(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'], output_keys=['level'])
        self._sub = ProxySubscriberCached({'level': None})
    def execute(self, userdata):
        if self._sub.has_msg('level'):
            userdata.level = self._sub.get_last_msg('level').percentage
            return 'done'

class Open(EventState):
    def __init__(self, service='/lid'):
        super().__init__(outcomes=['opened', 'failed'])
        self._service = service
        self._srv = ProxyServiceCaller({self._service: Trigger})
    def execute(self, userdata):
        answer = self._srv.call(self._service, TriggerRequest())
        return 'opened' if answer.success else 'failed'

class OpenLater(EventState):
    def __init__(self):
        super().__init__(outcomes=['opened', 'failed'])
        self._srv = ProxyServiceCaller({'/lid': Trigger})
    def on_enter(self, userdata):
        assert not self._srv.done('/lid')
        self._srv.call_async('/lid', TriggerRequest())
    def execute(self, userdata):
        if self._srv.done('/lid'):
            answer = self._srv.result('/lid')
            return 'opened' if answer.success and not self._srv.done('/lid') else 'failed'

class PourTea(EventState):
    def __init__(self, share):
        super().__init__(outcomes=['poured', 'failed'])
        self._client = ProxyActionClient({'/pour': PourAction})
        self._share = share
    def on_enter(self, userdata):
        self._client.send_goal('/pour', PourGoal(share=self._share))
    def execute(self, userdata):
        if self._client.has_feedback('/pour'):
            Logger.loghint('poured %s' % self._client.get_feedback('/pour').data)
        if self._client.has_result('/pour'):
            ok = self._client.get_state('/pour') == GoalStatus.SUCCEEDED
            return 'poured' if ok else 'failed'
    def on_exit(self, userdata):
        if not self._client.has_result('/pour'):
            self._client.cancel('/pour')

class Strength(EventState):
    def __init__(self):
        super().__init__(outcomes=['done', 'none'])
        self.strength = rospy.get_param('/strength')
    def execute(self, userdata):
        return 'done' if self.strength == 3 and not rospy.has_param('/no') else 'none'
"""
SETS = """
import rospy
from flexbe_core import EventState

class Sets(EventState):
    def __init__(self):
        super().__init__(outcomes=['set', 'new'])
    def execute(self, userdata):
        if rospy.get_param('/strength') == 7 and not rospy.has_param('names'):
            return 'set'
        rospy.set_param('strength', 7)
        rospy.delete_param('/names')
        return 'new'
"""
LOST = """
from flexbe_core import EventState
from flexbe_core.proxy import ProxyPublisher
class Shout(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'])
        self._pub = ProxyPublisher({'/shout': None})
"""


MODULES = {"talks": TALKS, "lost": LOST, "sets": SETS}


def test_what_is_published_commands_a_part(tea) -> None:
    sim = tea.start("{do: Drive, timeout: 0.1 s, next: {timeout: .done, done: .done}}")
    sim.tick(6)
    assert ("drive", Twist2(0.5, 0.0, 0.0)) in sim.parts["base"].commands
    assert set(sim.parts) == {"base"}


def test_fields_take_a_message_apart(tea) -> None:
    sim = tea.start("{do: Say, next: {done: .done}}")
    sim.tick(2)
    assert ("say", "tea is ready") in sim.parts["speaker"].commands


def test_a_signal_is_heard_as_a_message(tea) -> None:
    sim = tea.start(
        "{do: Where, with: {topic: odom}, next: {done: .done}}",
        signals={"base.pose": Pose2(1.0, 2.0, 0.7)},
    )
    sim.tick(3)
    assert sim.outcome is None  # it was removed on entry
    sim.signal("base.pose", Pose2(1.0, 2.0, 0.3))
    sim.tick(2)
    assert sim.outcome == "done"


def test_each_event_is_delivered_once(tea) -> None:
    sim = tea.start("{do: Bells, next: {done: .done}}")
    for ring in ("one", "two", "three"):
        sim.tick()
        sim.signal("bell", ring)
    sim.tick(2)
    assert sim.outcome == "done", sim.run.errors


def test_fields_put_a_message_together(tea) -> None:
    sim = tea.start("{do: Level, next: {done: .done}}", signals={"level": 0.4})
    sim.tick(2)
    assert sim.outcome == "done", sim.run.errors


@pytest.mark.parametrize(("answer", "outcome"), [(True, "opened"), (False, "failed")])
def test_a_service_answers_at_once(tea, answer: bool, outcome: str) -> None:
    sim = tea.start("{do: Open, next: {opened: .opened, failed: .failed}}", "opened, failed")
    sim.parts["pot"].open = lambda: {"success": answer}
    sim.tick(2)
    assert sim.outcome == outcome


def test_an_answer_is_fetched_later_and_once(tea) -> None:
    sim = tea.start("{do: OpenLater, next: {opened: .opened, failed: .failed}}", "opened, failed")
    sim.parts["pot"].open = lambda: {"success": True}
    sim.tick(3)
    assert sim.outcome == "opened", sim.run.errors


@pytest.mark.parametrize(("result", "outcome"), [({"ml": 200}, "poured"), (False, "failed")])
def test_an_action_ends_by_its_signal(tea, result: object, outcome: str) -> None:
    node = "{do: PourTea, with: {share: 0.5}, next: {poured: .poured, failed: .failed}}"
    sim = tea.start(node, "poured, failed", signals={"poured": {"ml": 1}})
    sim.tick(2)
    sim.signal("poured.share", 0.2)
    sim.tick(2)
    assert sim.outcome is None
    sim.signal("poured", result)
    sim.tick(2)
    assert sim.outcome == outcome
    first = sim.parts["pot"].commands[1]
    assert (first[0], first[1].share) == ("pour", 0.5)


def test_an_action_is_given_up_when_its_state_is_left(tea) -> None:
    node = (
        "{do: PourTea, with: {share: 1}, timeout: 0.1 s,"
        " next: {poured: .done, failed: .done, timeout: .done}}"
    )
    sim = tea.start(node)
    sim.tick(3)
    before = sim.parts["pot"].commands.count(("stop",))
    sim.tick(4)
    assert sim.outcome == "done"
    assert sim.parts["pot"].commands.count(("stop",)) == before + 2  # given up, then the end


def test_parameters_are_in_the_table(tea) -> None:
    sim = tea.start("{do: Strength, next: {done: .done, none: a}}")
    sim.tick(2)
    assert sim.outcome == "done"


def test_parameters_that_a_state_sets_are_for_its_run(tea) -> None:
    chart = """
chart: twice
outcomes: [done]
states:
  a: {do: Sets, next: {new: b, set: a}}
  b: {do: Sets, next: {set: .done, new: b}}
"""
    for _ in range(2):
        sim = ChartTester(tea.folder, tea.folder).start(chart, real=["a", "b"])
        sim.tick(3)
        assert sim.outcome == "done", sim.run.errors


def test_a_topic_that_the_table_lacks_is_told_with_its_line(tea) -> None:
    why = tea.catalogue.strangers["Shout"]
    assert "no topic '/shout'; add to topics.yaml, under `publishes`: `/shout: {part: NAME" in why
    with pytest.raises(AssertionError, match=r"no topic '/odo'; add to topics.yaml.*did you mean"):
        tea.start("{do: Where, with: {topic: /odo}, next: {done: .done}}")


def test_states_that_publish_to_one_part_clash_beside_each_other(tea) -> None:
    sim = ChartTester(tea.folder, tea.folder)
    chart = """
chart: both
outcomes: [done]
states:
  a:
    any:
      x: {do: Drive, next: {done: .done}}
      y: {do: Drive, with: {topic: cmd_vel}, next: {done: .done}}
    next: {done: .done}
"""
    with pytest.raises(AssertionError, match="base"):
        sim.start(chart)


def test_names_in_a_table_are_checked(fresh) -> None:
    file = fresh.folder / fresh.package / "topics.yaml"
    file.write_text(
        file.read_text().replace("signal: bell", "signal: bel").replace("part: pot", "part: pod")
    )
    found = FileChecker(fresh.catalogue, ()).findings(file, "topics")
    assert [finding.message for finding in found] == [
        "hears./bell.signal: there is no signal 'bel'",
        "calls./lid.part: there is no part 'pod'",
        "acts./pour.part: there is no part 'pod'",
    ]
    assert found[0].hint == "did you mean 'bell'?"
    assert load_topics([file]).find("hears", "bell").signal == "bel"


def test_commands_of_a_table_are_checked(fresh) -> None:
    file = fresh.folder / fresh.package / "topics.yaml"
    assert FileChecker(fresh.catalogue, ()).findings(file, "topics") == ()
    text = file.read_text().replace("command: drive", "command: drvie")
    text = text.replace("command: say", "command: sey").replace(
        "feedback:", "cancel: halt, feedback:"
    )
    file.write_text(text)
    found = FileChecker(fresh.catalogue, ()).findings(file, "topics")
    assert [finding.message for finding in found] == [
        "publishes./cmd_vel.command: the part 'base' has no method 'drvie'",
        "publishes./say.command: the part 'speaker' has no method 'sey'",
        "acts./pour.cancel: the part 'pot' has no method 'halt'",
    ]
    assert [finding.hint for finding in found[:2]] == [
        "did you mean 'drive'?",
        "did you mean 'say'?",
    ]


def test_the_table_of_the_page_can_be_carried_over_rosbridge(fresh) -> None:
    page = (Path(flexbe_states.__file__).parent / "README.md").read_text()
    text = page.partition("## Through rosbridge")[2].partition("```yaml\n")[2].partition("```")[0]
    file = fresh.folder / fresh.package / "topics.yaml"
    file.write_text(text)
    (fresh.folder / fresh.package / "__init__.py").write_text(SIGNALS_OF_PAGE)
    assert FileChecker(fresh.catalogue, ()).findings(file, "topics") == ()
    heard, sent = wired_topics(load_topics([file]))
    assert [(one.signal, one.value({"percentage": 0.5}), one.within) for one in heard] == [
        ("battery.level", 0.5, 2.0)
    ]
    assert [(one.command, one.message(text="tea")) for one in sent] == [("say", {"data": "tea"})]


SIGNALS_OF_PAGE = """
from engine import Measured

class Ros:
    signals = ()
    def stop(self): pass
    def samples(self, now_ns): return []
    def say(self, text): pass

PARTS = {"ros": Ros}
SIGNALS = (Measured("battery.level", float),)
"""
