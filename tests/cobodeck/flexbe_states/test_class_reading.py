import pytest

from cobodeck.flexbe_states import Described, FlexbeParameter, read_state_classes
from engine.files import FileError

WAIT = '''#!/usr/bin/env python
import rospy
from flexbe_core import EventState, Logger
from flexbe_core.proxy import ProxyActionClient


class Steep(EventState):
\t"""
\tLets tea steep.

\t-- minutes\tfloat\tHow long,
\t\t\tin minutes.
\t-- tea \tstring\tIts kind.
\t># cup\tobject\tWhat it is in.
\t#> colour\tstring\tHow dark.
\t<= done\t\tIt is strong.
\t"""
\tdef __init__(self, minutes, tea='green', extra=rospy.Duration(1)):
\t\tsuper(Steep, self).__init__(outcomes=['done', 'cold'],
\t\t\tinput_keys=['cup'], output_keys=['colour'])

\tdef execute(self, userdata):
\t\treturn 'done'

\tdef on_exit(self, userdata):
\t\tpass
'''


def read(body: str):
    return {found.name: found for found in read_state_classes(body, "tea.py")}


def state(init: str, parameters: str = "self") -> str:
    return f"class A(EventState):\n  def __init__({parameters}):\n    {init}\n"


def test_a_class_is_read_without_being_run() -> None:
    (found,) = read_state_classes(WAIT, "tea.py")
    assert (found.name, found.bases, found.file, found.line) == (
        "Steep",
        ("EventState",),
        "tea.py",
        7,
    )
    assert found.outcomes == ("done", "cold")
    assert (found.input_keys, found.output_keys) == (("cup",), ("colour",))
    assert found.parameters == (
        FlexbeParameter("minutes"),
        FlexbeParameter("tea", False, "green", "'green'"),
        FlexbeParameter("extra", False, None, "rospy.Duration(1)"),
    )
    assert [parameter.is_known for parameter in found.parameters] == [True, True, False]
    assert found.hooks == ("execute", "on_exit")
    assert found.imports == ("rospy", "flexbe_core")
    assert found.only_python_2 == 0


def test_the_docstring_describes_each_name() -> None:
    (found,) = read_state_classes(WAIT, "tea.py")
    about = found.about
    assert about.about == "Lets tea steep."
    assert about.parameters["minutes"] == Described("float", "How long, in minutes.")
    assert about.inputs == {"cup": Described("object", "What it is in.")}
    assert about.outputs == {"colour": Described("string", "How dark.")}
    assert about.outcomes == {"done": Described("", "It is strong.")}


@pytest.mark.parametrize(
    ("init", "outcomes"),
    [
        ("super().__init__(outcomes=['a', 'b'])", ("a", "b")),
        ("EventState.__init__(self, outcomes=('a',))", ("a",)),
        ("super().__init__(['a'] + ['b'])", ("a", "b")),
        ("super().__init__(outcomes=outcomes)", None),
        ("super().__init__(outcomes=sorted('ab'))", None),
        ("super().__init__(outcomes=['a'] + outcomes)", None),
        ("super().__init__(**given)", None),
        ("super().__init__()", ()),
        ("mine = ['x']; super().__init__(outcomes=mine)", ("x",)),
        ("super().__init__(outcomes=['a', 1])", None),
    ],
)
def test_outcomes_are_known_where_they_are_written_out(init: str, outcomes: object) -> None:
    assert read(state(init, "self, outcomes, **given"))["A"].outcomes == outcomes


def test_a_name_given_twice_is_not_known() -> None:
    found = read(state("mine = ['x']\n    mine = ['y']\n    super().__init__(outcomes=mine)"))
    assert found["A"].outcomes is None


def test_a_class_has_what_its_base_class_here_has() -> None:
    found = read(
        state("super().__init__(outcomes=['a'], input_keys=['k'])", "self, speed=1.0")
        + "  def on_stop(self):\n    pass\n"
        + "class B(A):\n  def execute(self, userdata):\n    return 'a'\n"
        + "class C(A):\n  def __init__(self):\n    super().__init__(2.0)\n"
    )
    assert found["B"].outcomes == ("a",)
    assert found["B"].input_keys == ("k",)
    assert [parameter.name for parameter in found["B"].parameters] == ["speed"]
    assert found["B"].hooks == ("execute", "on_stop")
    assert (found["C"].outcomes, found["C"].parameters) == (("a",), ())


def test_what_is_no_state_is_left_out() -> None:
    text = (
        "class Helper:\n  def execute(self, userdata): pass\n"
        "class Other(Thing):\n  def go(self): pass\n"
        "class Far(ImportedState):\n  def on_enter(self, userdata): pass\n"
    )
    assert list(read(text)) == ["Far"]


def test_python_2_is_read_and_told() -> None:
    text = state("super(A, self).__init__(outcomes=['a'])") + (
        "  def execute(self, userdata):\n"
        "    try:\n\tprint 'go', 0777\n    except ValueError, error:\n      raise IOError, 'gone'\n"
    )
    (found,) = read_state_classes(text, "old.py")
    assert found.outcomes == ("a",)
    assert found.only_python_2 == 6


def test_what_is_not_python_is_an_error_with_its_line() -> None:
    with pytest.raises(FileError, match=r"^bad\.py:2\b.*this is not Python 3"):
        read_state_classes("x = 1\nclass (:\n", "bad.py")


def test_names_that_parameters_give_are_known_in_a_derived_class() -> None:
    found = read(
        state(
            "super().__init__(outcomes=['no'] + outcomes, input_keys=keys)", "self, outcomes, keys"
        )
        + "class B(A):\n  def __init__(self, more=()):\n    super().__init__(['yes'], keys=['k'])\n"
    )
    assert found["A"].templates["outcomes"] == ("no", "$outcomes")
    assert found["A"].input_keys is None
    assert (found["B"].outcomes, found["B"].input_keys) == (("no", "yes"), ("k",))


TALKER = """
class Talker(EventState):
    def __init__(self, topic, scan='/scan'):
        super().__init__(outcomes=['done'])
        self._topic = topic
        self._pub = ProxyPublisher({self._topic: String})
        self._sub = ProxySubscriberCached({scan: LaserScan, '/odom': Odometry})
        self._act = ProxyActionClient({'/ns' + '/go': Go})
        self._srv = ProxyServiceCaller({f'/{topic}/clear': Empty})

class Hello(Talker):
    def __init__(self):
        super().__init__('/hello')
"""


def test_topics_are_read_with_the_parameters_that_name_them() -> None:
    found = read(TALKER)
    assert set(found["Talker"].topics) == {
        ("publishes", "$topic"),
        ("hears", "$scan"),
        ("hears", "/odom"),
        ("acts", "/ns/go"),
        ("calls", None),
    }
    assert ("publishes", "/hello") in found["Hello"].topics
    assert ("hears", "/scan") in found["Hello"].topics
