"""Topics of a project's table through rosbridge, against the fake server."""

import asyncio
import sys
import threading
import time
from dataclasses import replace

import pytest

from cobodeck.__main__ import main
from cobodeck.flexbe_states import PlainRecord, load_topics, wired_topics
from cobodeck.real.health import fault_of
from cobodeck.terminal import OK
from hw.drivers.ros.ros_topics import RosTopics
from hw.fakes.kairos.rosbridge_server import FakeTopic, RosbridgeServer
from hw.geometry import Twist2
from tests.hw.drivers.rigs import Listener, opening, own_address

pytest.importorskip("roslibpy", reason="the extra 'ros' is not installed")
pytest.importorskip("websockets", reason="the extra 'live' is not installed")

TABLE = """
topics: rover
hears:
  /battery:
    {signal: battery, type: sensor_msgs/BatteryState, fields: {percentage: ""}, within: 0.3 s}
  /word: {signal: word, type: std_msgs/String}
  /goal: {signal: goal, type: rover_msgs/Goal}
  /odom: {signal: base.pose}
publishes:
  /say: {part: ros, command: say, type: std_msgs/String, fields: {text: data}}
  /turtle: {part: ros, command: drive, type: geometry_msgs/Twist}
  /cmd_vel: {part: base, command: drive}
"""
KINDS = {
    "/battery": "sensor_msgs/BatteryState",
    "/word": "std_msgs/String",
    "/goal": "rover_msgs/Goal",
    "/say": "std_msgs/String",
    "/turtle": "geometry_msgs/Twist",
}


class Rig:
    """A server in a thread, and the driver; `say` publishes there, `published` is what came."""

    def __init__(self, folder, kinds=KINDS, table=TABLE):
        self.file = folder / "topics.yaml"
        self.file.write_text(table)
        self.host, self.published = own_address(), []
        topics = {name: FakeTopic(kind) for name, kind in kinds.items()}
        for name, topic in topics.items():
            topic.on_message = lambda message, name=name: self.published.append((name, message))
        self.server = RosbridgeServer(topics)
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()
        asyncio.run_coroutine_threadsafe(self.server.listen(self.host, 9090), self.loop).result(5)
        self.told, self.part = [], None

    def open(self):
        topics = wired_topics(load_topics([self.file]))
        info = replace(opening(), topics=lambda: topics, tell=self.told.append)
        self.part = RosTopics(self.host, time.monotonic_ns, info)
        self.listener = Listener(self.part)
        return self.part

    def say(self, topic, message):
        self.loop.call_soon_threadsafe(self.server.publish, topic, message)

    def full(self):
        self.say("/battery", {"percentage": 0.5})

    def until(self, wanted, nudge=None):
        self.listener.until(wanted, nudge or self.full)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.part is not None:
            self.part.close()
        asyncio.run_coroutine_threadsafe(self.server.close(), self.loop).result(5)
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join(5)
        self.loop.close()


def test_topics_become_signals_and_commands_are_published(tmp_path):
    with Rig(tmp_path) as rig:
        part = rig.open()
        assert part.signals == ("battery", "word", "goal")
        rig.until(lambda: rig.listener.got)
        assert {(s.name, s.value) for s in rig.listener.got} == {("battery", 0.5)}
        rig.listener.got.clear()

        def talk():
            rig.full()
            rig.say("/word", {"data": "tea"})
            rig.say("/goal", {"at": {"x": 1.0}, "names": ["a", "b"]})
            part.say(text="ready")
            part.drive(Twist2(0.5, 0.0, 0.2))
            part.stop()

        names = lambda: {sample.name for sample in rig.listener.got}  # noqa: E731
        rig.until(lambda: len(names()) == 3 and len(rig.published) >= 3, talk)
        values = {sample.name: sample.value for sample in rig.listener.got}
        assert values["word"] == "tea"
        assert isinstance(values["goal"], PlainRecord)
        assert (values["goal"]["at"]["x"], values["goal"].names) == (1.0, ("a", "b"))
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        assert rig.published[:3] == [
            ("/say", {"data": "ready"}),
            ("/turtle", {"linear": zero | {"x": 0.5}, "angular": zero | {"z": 0.2}}),
            ("/turtle", {"linear": zero, "angular": zero}),
        ]
        assert fault_of(part) is None
        time_before = time.monotonic()
        rig.until(lambda: part.fault is not None, lambda: None)
        assert part.fault == "/battery: silent for more than 0.3 s"
        assert time.monotonic() - time_before >= 0.2
        rig.until(lambda: part.fault is None)


def test_a_server_that_is_absent_is_told(tmp_path):
    with Rig(tmp_path) as rig:
        rig.host = own_address()
        with pytest.raises(OSError, match=rf"rosbridge at {rig.host}:9090: .*refused"):
            rig.open()


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ("topics: rover\n", "no topic in the project's table has a type"),
        (TABLE.replace("drive, type", "say, type"), "the command 'say' is there already"),
    ],
)
def test_a_table_that_cannot_be_carried_is_told(tmp_path, table, told):
    with Rig(tmp_path, table=table) as rig, pytest.raises(ValueError, match=told):
        rig.open()


RUN = {
    "pyproject.toml": """
[project]
name = "rover"
version = "0"
[project.entry-points."cobodeck.states"]
rover_topics_run = "rover_topics_run"
""",
    "rover_topics_run/__init__.py": """
from engine import Measured

class Ros:
    signals = ()
    def stop(self): pass
    def samples(self, now_ns): return []
    def say(self, text): pass
    def drive(self, twist): pass

PARTS = {"ros": Ros}
SIGNALS = (Measured("battery", float), Measured("word", str), Measured("goal", object))
""",
    "rover_topics_run/echo.py": """
import rospy
from flexbe_core import EventState
from std_msgs.msg import String

class Echo(EventState):
    def __init__(self):
        super().__init__(outcomes=['done'])
        self.word = None
        self._pub = rospy.Publisher('/say', String, queue_size=1)
        rospy.Subscriber('/word', String, self.hear)
    def hear(self, message):
        self.word = message.data
    def execute(self, userdata):
        if self.word:
            self._pub.publish(self.word.upper())
            return 'done'
""",
    "echo.yaml": """
chart: echo
about: Says what it hears, louder.
outcomes: [done]
states:
  echo: {do: Echo, next: {done: .done}}
""",
}


@pytest.mark.slow
def test_a_flexbe_state_hears_and_publishes_in_a_run(tmp_path, monkeypatch, capsys):
    for name, text in RUN.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / ".git").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    with Rig(tmp_path) as rig:
        (tmp_path / "rover.yaml").write_text(
            "connection: rover\nabout: A robot with rosbridge.\nmodel: rbkairos_ur10\n"
            f"parts: {{ros: {{driver: RosTopics, host: {rig.host}}}}}\n"
        )
        over = threading.Event()

        def talk():
            while not over.wait(0.05):
                rig.full()
                rig.say("/word", {"data": "tea"})

        talking = threading.Thread(target=talk)
        talking.start()
        try:
            code = main(["run", "echo", "--robot", "rover.yaml"])
        finally:
            over.set()
            talking.join()
    assert code == OK, capsys.readouterr().err
    assert rig.published == [("/say", {"data": "TEA"})]


@pytest.mark.slow
def test_a_topic_of_another_type_is_told_with_what_the_server_says(tmp_path):
    with Rig(tmp_path, KINDS | {"/battery": "std_msgs/Float32"}) as rig:
        part = rig.open()
        said = "cannot subscribe to /battery as sensor_msgs/BatteryState"
        with pytest.raises(OSError, match=f"/battery: silent .*rosbridge says: {said}"):
            part.wait()


@pytest.mark.slow
def test_messages_of_another_type_are_a_fault_until_right_ones_come(tmp_path):
    with Rig(tmp_path) as rig:
        part = rig.open()
        rig.until(lambda: part.fault is None)
        rig.until(
            lambda: part.fault is not None and "what it sends" in part.fault,
            lambda: rig.say("/battery", {"charge": 1.0}),
        )
        wrong = "/battery: what it sends is no sensor_msgs/BatteryState: KeyError: 'percentage'"
        assert part.fault == wrong
        rig.until(lambda: part.fault is None)


@pytest.mark.slow
def test_a_lost_connection_is_a_fault_and_is_opened_again(tmp_path):
    with Rig(tmp_path) as rig:
        part = rig.open()
        rig.until(lambda: part.fault is None)
        rig.loop.call_soon_threadsafe(rig.server.drop)
        rig.until(lambda: part.fault == f"rosbridge at {rig.host}:9090: no connection")
        rig.until(lambda: part.fault is None)
        assert part.acknowledge()
