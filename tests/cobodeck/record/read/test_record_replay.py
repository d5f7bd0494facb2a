"""A run done again from its record is the same; what is not as recorded is told at its place."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar

import foxglove
import pytest
from foxglove import Channel, Context, Schema
from mcap.reader import make_reader

from cobodeck.loop.clocks import Clock
from cobodeck.loop.loop import Loop
from cobodeck.record.format.record_header import changes
from cobodeck.record.read.reader import Record
from cobodeck.record.read.record_replay import Replay, setup_of, stage_replay
from cobodeck.record.read.sample_feed import ALTERED
from cobodeck.record.write.start import recorder
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from cobodeck.terminal.console import Problem
from engine.files.text import noting
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from hw.sim.sim_arm import SimArm

WALKS = Path(__file__).parents[4].parent / "shared" / "data" / "walking"
ROOT = Path(__file__).parents[4]
AT = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
FOR_EVER = 1 << 61
Act = Callable[[Operator, ChartRun, Setup], object]


@dataclass
class Operated:
    """An observer that lets an operator act at instants of the grid, s."""

    acts: dict[float, Act]
    loop: Loop | None = None
    setup: Setup | None = None
    said: list[object] = field(default_factory=list)

    def watch(self, now_ns: int) -> None:
        assert self.loop is not None
        assert self.setup is not None
        for at in [at for at in self.acts if at * 1e9 <= now_ns]:
            run = self.loop.wired.run
            self.said.append(self.acts.pop(at)(Operator(run), run, self.setup))


class Jittering:
    """A clock that is late now and then, once by half a second, and is often woken in between."""

    waits: ClassVar[bool] = True

    def __init__(self, seed: int) -> None:
        self._chance = random.Random(seed)
        self._now = 0

    def wait(self, until_ns: int) -> int:
        chance = self._chance.random()
        late = 500_000_000 if chance > 0.995 else 7_000_000 if chance > 0.9 else 200_000
        early = self._chance.random() < 0.3
        left = max(0, until_ns - self._now)
        self._now += left // 2 if early and left > 2 else left + late
        return self._now

    def wake(self) -> None:
        """Woken by chance."""


def recorded(
    path: Path,
    options: Options,
    acts: dict[float, Act] | None = None,
    clock: Clock | None = None,
    **given: Any,
) -> RunResult:
    """A run with its record."""
    with noting():
        setup = open_setup(**given)
        problems: list[str] = []
        writer = recorder(setup, options, path, AT, problems.append)
        assert writer is not None
        operated = Operated(dict(acts or {}))
        attend = writer.attend

        def attended(loop: Loop) -> None:
            attend(loop)
            operated.loop, operated.setup = loop, setup
            loop.observers = (operated, *loop.observers)

        writer.attend = attended  # type: ignore[method-assign]
        result = simulate(setup, options, clock=clock, recorder=writer)
    assert problems == []
    assert not any(operated.said), operated.said
    assert result.record_file == path
    return result


def replayed(path: Path) -> Replay:
    """A replay of a record, at its end."""
    replay = stage_replay(Record(path))
    replay.loop.go(FOR_EVER)
    return replay


def profile(folder: Path, **plant: str) -> str:
    """A profile like `tuned`, on another plant."""
    lines = "".join(f"\n  {name}: {value}" for name, value in plant.items())
    file = folder / "other.yaml"
    file.write_text(f"profile: tuned\nbase: tuned\nplant:{lines or ' {}'}\n")
    return str(file)


def walk(name: str) -> str:
    if not WALKS.is_dir():
        pytest.skip("the recorded walks are not here")
    return str(WALKS / name)


def lock(operator: Operator, run: ChartRun, setup: Setup) -> object:
    return operator.lock("chase")


def other_machine(operator: Operator, run: ChartRun, setup: Setup) -> object:
    return operator.replace(run.machine.changed(setup.chart, setup.library))


def granted(*times: float) -> dict[float, Act]:
    return dict.fromkeys(times, grant_all)


def grant_all(operator: Operator, run: ChartRun, setup: Setup) -> object:
    return [said for path in operator.waiting() if (said := operator.consent(path))]


SHORT = Options(duration_s=9.0)
RUNS: dict[str, Callable[[Path, Path], RunResult]] = {
    "cornering": lambda path, _: recorded(
        path, Options(requests=1, duration_s=40.0), scene="lab_a"
    ),
    "study": lambda path, _: recorded(path, Options(requests=1, duration_s=25.0), scene="study"),
    "recorded walk": lambda path, _: recorded(
        path, Options(user=walk("tum_room3.txt"), requests=1, duration_s=15.0), scene="lab_a"
    ),
    "random": lambda path, _: recorded(
        path, Options(user="random", seed=3, duration_s=15.0), scene="lab_a"
    ),
    "random, other room": lambda path, _: recorded(
        path, Options(user="random", seed=5, duration_s=15.0), scene="lab_b"
    ),
    "paper": lambda path, _: recorded(
        path, Options(requests=1, duration_s=25.0), scene="study", profile="paper"
    ),
    "delay and noise": lambda path, folder: recorded(
        path,
        Options(requests=1, duration_s=20.0, seed=7),
        scene="study",
        profile=profile(folder, tracking_delay="67 ms", tracking_noise="2 cm", pose_noise="1 cm"),
    ),
    "latency": lambda path, folder: recorded(
        path,
        Options(requests=1, duration_s=20.0),
        scene="study",
        profile=profile(folder, latency="20 ms", tracking_delay="40 ms"),
    ),
    "every signal computed": lambda path, _: recorded(
        path, Options(duration_s=5.0, eager=True), scene="lab_a"
    ),
    "all sensors": lambda path, _: recorded(
        path, Options(requests=1, duration_s=25.0, tier=2, seed=2), scene="study"
    ),
    "all sensors, out of tracking": lambda path, _: recorded(
        path, Options(duration_s=20.0, tier=2), scene="tracked_area"
    ),
    "virtual wall": lambda path, _: recorded(path, SHORT, scene="virtual_wall"),
    "a base that stands": lambda path, _: recorded(
        path, Options(duration_s=9.0, frozen_base=True), scene="lab_a"
    ),
    "logic": lambda path, _: recorded(path, Options(tier=0, seed=4, duration_s=300.0)),
    "mock": lambda path, _: recorded(path, Options(duration_s=9.0, mock=True), scene="lab_a"),
    "mock in real time": lambda path, _: recorded(
        path, Options(duration_s=9.0, mock=True), clock=Jittering(1), scene="lab_a"
    ),
    "paused": lambda path, _: recorded(
        path,
        SHORT,
        {2.0: lambda op, *_: op.pause(), 5.0: lambda op, *_: op.resume()},
        scene="lab_a",
    ),
    "forced": lambda path, _: recorded(
        path, SHORT, {3.0: lambda op, *_: op.force("chase", "failed")}, scene="lab_a"
    ),
    "locked": lambda path, _: recorded(
        path,
        SHORT,
        {0.5: lock, **granted(*range(1, 8)), 8.0: lambda op, *_: op.unlock("chase")},
        scene="lab_a",
    ),
    "replaced chart": lambda path, _: recorded(path, SHORT, {4.0: other_machine}, scene="lab_a"),
    "stopped": lambda path, _: recorded(path, SHORT, {4.0: lambda op, *_: op.stop()}),
    "autonomy": lambda path, _: recorded(
        path, SHORT, {1.0: lambda op, *_: op.set_level("low")}, scene="lab_a"
    ),
}


@pytest.mark.requirement(19, 57)
@pytest.mark.parametrize("name", RUNS)
@pytest.mark.few(3)
def test_a_run_done_again_is_the_same(name: str, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    result = RUNS[name](path, tmp_path)

    replay = replayed(path)

    assert replay.difference is None, str(replay.difference)
    assert replay.loop.wired.run.trace.sha256() == result.figures["trace_sha256"]
    assert replay.checker.records > 0


AS_BEFORE = """
import sys
from cobodeck.record.format import class_names
class_names.renamed = str  # classes were written with the names of their modules
from cobodeck.__main__ import main
sys.exit(main(sys.argv[1:]))
"""


def test_an_older_record_that_names_modules_is_replayed(tmp_path: Path) -> None:
    path = tmp_path / "older.mcap"
    asked = ["simulate", "--tier", "2", "--duration", "3", "--seed", "3", "--record", str(path)]
    subprocess.run([sys.executable, "-c", AS_BEFORE, *asked], cwd=ROOT, check=True)
    with path.open("rb") as file:
        calls = [m.data for _, _, m in make_reader(file).iter_messages(["parts"])]
    assert any(b'{"hw.geometry.Twist2":' in call for call in calls)

    replay = replayed(path)

    assert replay.difference is None, str(replay.difference)
    assert replay.checker.records > 0


@pytest.mark.slow
def test_a_part_that_raises_raises_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def follow(self: SimArm, points: object) -> None:
        raise RuntimeError("the controller is gone", 7)

    path = tmp_path / "run.mcap"
    with monkeypatch.context() as patch:
        patch.setattr(SimArm, "follow", follow)
        result = recorded(path, Options(requests=1, duration_s=40.0), scene="study")
    assert {error["error"].partition(": ")[2] for error in result.figures["errors"]} == {
        "RuntimeError: ('the controller is gone', 7)"
    }

    replay = replayed(path)

    assert replay.difference is None, str(replay.difference)
    again = [(e.time, e.path, e.text) for e in replay.loop.wired.run.errors]
    assert again == [(e.time, e.path, e.text) for e in result.wired.run.errors]


OWN = """
from dataclasses import dataclass

from engine.state import Action, Monitor, On, Until
from engine.signals.signal_kinds import Measured
from hw.samples import Sample


class Odd(Exception):
    def __init__(self, *, why: str) -> None:
        super().__init__(why)


@dataclass(frozen=True)
class Reading:
    grams: float
    labels: list


class Scale:
    signals = ("scale.weight",)

    def __init__(self):
        self.unit, self.count = "g", 0
        self.limit = None

    def weigh(self, times, *, gently=False):
        self.count += 1
        if self.count % 5 == 0:
            raise Odd(why=f"too often: {self.count}")
        return {"reading": Reading(1.5 * self.count * times, [gently, None, float("inf")])}

    def samples(self, now_ns):
        if now_ns > 600_000_000:
            raise OSError(5, "pulled out")
        return [Sample("scale.weight", now_ns, Reading(now_ns / 7.0, [1, 2.0]))]

    def stop(self):
        pass


SIGNALS = (Measured("scale.weight", type=Reading),)
PARTS = {"scale": Scale}


class Weigh(Action):
    \"\"\"Weighs.\"\"\"

    outcomes = ("done",)
    commands = ("scale",)
    reads = {"scale.weight": None}

    def run(self, ctx):
        scale = ctx.part("scale")
        total = 0.0
        for n in range(100):
            scale.limit = n
            try:
                reading = scale.weigh(2, gently=n % 2 == 0)["reading"]
                total += reading.grams if scale.unit == "g" else 0.0
                assert isinstance(reading, Reading) and type(reading.labels) is list
            except Odd as odd:
                total -= len(str(odd))
            if hasattr(scale, "warp"):
                return "done"
            value = ctx.value("scale.weight")
            if total > 100.0 + (0.0 if value is None else value.grams * 1e-9):
                return "done"
            yield Until(ctx.after(0.1))


class Heavy(Monitor):
    \"\"\"Waits for a load.\"\"\"

    outcomes = ("heavy",)

    def run(self, ctx):
        while True:
            yield On("scale.weight")


class Breaks(Action):
    \"\"\"Raises.\"\"\"

    outcomes = ("done",)

    def run(self, ctx):
        yield
        raise ValueError("on purpose")


class BreaksOff(Action):
    \"\"\"As if somebody had pressed Ctrl-C.\"\"\"

    outcomes = ("done",)
    commands = ("scale",)

    def run(self, ctx):
        yield Until(ctx.after(0.3))
        raise KeyboardInterrupt
"""
BROKEN_OFF = """
chart: broken_off
states:
  breaks: {do: BreaksOff, next: {done: again, error: again}}
  again: {do: Weigh, next: {done: breaks}}
"""
CHART = """
chart: weighing
states:
  weigh: {do: Weigh, next: {done: again}}
  again: {do: Weigh, timeout: 2 s, next: {done: breaks, timeout: breaks}}
  breaks: {do: Breaks, next: {done: breaks}}
"""
TICKING = """
chart: ticking
states:
  weigh: {do: Weigh, timeout: 317 ms, next: {done: weigh, timeout: weigh}}
"""


@pytest.fixture
def own_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with a part that answers, is looked at, set, raises, and is pulled out."""
    folder = tmp_path / "weighing"
    folder.mkdir()
    (folder / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nweighing = "weighing_states"\n'
    )
    (folder / "weighing_states.py").write_text(OWN)
    (folder / "weighing.yaml").write_text(CHART)
    (folder / "broken_off.yaml").write_text(BROKEN_OFF)
    (folder / "ticking.yaml").write_text(TICKING)
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, "weighing_states", raising=False)
    return folder


def test_answers_looks_and_failures_of_parts_of_ones_own_are_given_again(
    own_project: Path, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    options = Options(duration_s=9.0)
    result = recorded(path, options, chart="weighing.yaml", robot="rbkairos_ur10")
    told = [json.loads(t.data) for g in Record(path).groups() for t in g.told if t.topic == "parts"]
    kinds = {call["what"] for call in told}
    assert kinds >= {"weigh", ".unit", ".limit =", ".warp", "stop"}
    assert result.figures["outcome"] == "error"
    assert len(result.figures["errors"]) == 2  # the state's, and the part's

    replay = replayed(path)

    assert replay.difference is None, str(replay.difference)
    again = [(e.path, e.kind, e.text) for e in replay.loop.wired.run.errors]
    assert again == [(e.path, e.kind, e.text) for e in result.wired.run.errors]


@pytest.mark.parametrize("lacking", ["Weigh", "Breaks", "Heavy"])
def test_what_a_project_gave_is_looked_for_in_its_folder(
    lacking: str, own_project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.mcap"
    watched = CHART + "  unused: {watch: Heavy, next: {heavy: breaks}}\n"
    (own_project / "weighing.yaml").write_text(watched)
    recorded(path, Options(duration_s=1.0), chart="weighing.yaml", robot="rbkairos_ur10")
    states = own_project / "weighing_states.py"
    states.write_text(OWN.replace(f"class {lacking}(", f"class Other{lacking}("))
    monkeypatch.delitem(sys.modules, "weighing_states")

    with pytest.raises(Problem, match=f"no states {lacking}; go to the folder of their project"):
        setup_of(Record(path))


def test_real_time_misses_and_adds_ticks_and_is_the_same_again(
    own_project: Path, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    options = Options(duration_s=30.0, mock=True)
    given = {"chart": "ticking.yaml", "robot": "rbkairos_ur10"}
    result = recorded(path, options, clock=Jittering(2), **given)

    replay = replayed(path)

    kinds = {group.ticked.kind for group in Record(path).groups()}
    assert kinds >= {"grid", "added", "taken", "end"}
    assert replay.difference is None, str(replay.difference)
    assert (replay.loop.missed, replay.loop.added) == (result.loop.missed, result.loop.added)
    assert replay.loop.missed > 0


def test_an_answer_that_cannot_be_written_down_is_told(own_project: Path, tmp_path: Path) -> None:
    file = own_project / "weighing_states.py"
    file.write_text(OWN.replace("times, [gently", "times, [object(), gently"))
    path = tmp_path / "run.mcap"
    recorded(path, Options(duration_s=2.0), chart="weighing.yaml", robot="rbkairos_ur10")

    replay = replayed(path)

    assert replay.difference is not None
    assert replay.difference.what == "the answer of scale.weigh"


def test_a_state_that_is_broken_off_ends_the_run_in_the_same_tick_again(
    own_project: Path, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    options = Options(duration_s=9.0)
    result = recorded(path, options, chart="broken_off.yaml", robot="rbkairos_ur10")

    replay = replayed(path)

    assert result.figures["outcome"] == replay.loop.wired.run.outcome == "stopped"
    assert replay.difference is None, str(replay.difference)
    assert replay.checker.ticks == result.loop.ticks - result.loop.left_out


def test_a_file_that_has_changed_is_told_and_the_one_of_then_is_used(
    own_project: Path, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    given = {"chart": "weighing.yaml", "robot": "rbkairos_ur10"}
    recorded(path, Options(duration_s=1.0), **given)
    (own_project / "weighing.yaml").write_text("chart: [")

    replay = replayed(path)

    told = "weighing.yaml has changed; the record's own is used"
    assert changes(Record(path).header, replay.setup) == [told]
    assert replay.difference is None


def test_a_run_with_an_operator_at_the_terminal_is_recorded(
    own_project: Path, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    typed = tmp_path / "typed"
    typed.write_text("")
    with typed.open() as console:
        options = Options(duration_s=1.0, mock=True, console=console)
        recorded(path, options, chart="ticking.yaml", robot="rbkairos_ur10")

    assert replayed(path).difference is None


def test_states_that_have_other_outcomes_now_are_told(own_project: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recorded(path, Options(duration_s=1.0), chart="weighing.yaml", robot="rbkairos_ur10")
    file = own_project / "weighing_states.py"
    file.write_text(OWN.replace('"done"', '"weighed"'))
    del sys.modules["weighing_states"]

    with pytest.raises(Problem, match="cannot run with the present states"):
        replayed(path)


Change = Callable[[str, dict[str, Any]], dict[str, Any] | None]
"""What becomes of a message of a topic; None: it is left out."""


def altered(path: Path, change: Change) -> Path:
    """A copy of a record in which messages were changed by somebody else's tools."""
    copy = path.with_name("altered.mcap")
    copy.unlink(missing_ok=True)
    context, channels = Context(), dict[tuple[str, str], Channel]()
    with path.open("rb") as stream, foxglove.open_mcap(copy, context=context) as writer:
        reader = make_reader(stream)
        for metadata in reader.iter_metadata():
            writer.write_metadata(metadata.name, metadata.metadata)
        for a in reader.iter_attachments():
            writer.attach(
                log_time=0, create_time=0, name=a.name, media_type=a.media_type, data=a.data
            )
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert schema is not None
            found = change(channel.topic, json.loads(message.data))
            if found is None:
                continue
            key = channel.topic, schema.name
            if key not in channels:
                made = Schema(name=schema.name, encoding=schema.encoding, data=schema.data)
                channels[key] = Channel(
                    channel.topic, schema=made, message_encoding="json", context=context
                )
            data = json.dumps(found).encode()
            channels[key].log(data, log_time=message.log_time)
    return copy


@dataclass
class First:
    """Changes the first message of a topic after an instant, ns; `at_ns` is that of its tick."""

    topic: str
    change: Callable[[dict[str, Any]], dict[str, Any] | None]
    after_ns: int = 0
    at_ns: int | None = None
    _done: bool = False
    _now: int = 0

    def __call__(self, topic: str, message: dict[str, Any]) -> dict[str, Any] | None:
        changed = topic == self.topic and not self._done and self._now >= self.after_ns
        self._done = self._done or changed
        if topic == "tick":
            self._now = message["at_ns"]
            if self._done and self.at_ns is None:
                self.at_ns = self._now
        return self.change(message) if changed else message


def moved(message: dict[str, Any]) -> dict[str, Any]:
    place = message["translation"] | {"x": message["translation"]["x"] + 0.01}
    return message | {"translation": place}


ALTERATIONS: dict[str, First] = {
    "a sample": First("signal/base.pose", moved, 3 * 10**9),
    "a sample that is missing": First("signal/user.pose", lambda _: None, 3 * 10**9),
    "a command": First("operator", lambda m: m | {"command": "Pause", "arguments": {"$dict": []}}),
    "a command that is missing": First("operator", lambda _: None),
    "a command that there is not": First("operator", lambda m: m | {"command": "Dance"}),
    "a tick": First("tick", lambda m: m | {"at_ns": m["at_ns"] + 1}, 3 * 10**9),
    "a tick that is missing": First("tick", lambda _: None, 3 * 10**9),
    "a call": First("parts", lambda m: m | {"args": [1]}, 3 * 10**9),
    "a call that is missing": First("parts", lambda _: None, 3 * 10**9),
    "a line of the trace": First("trace", lambda m: {"line": [*m["line"][:-1], "x"]}, 3 * 10**9),
    "a cycle of the chain": First("safety", lambda m: m | {"needed": 9.0}, 3 * 10**9),
    "the truth": First("truth", lambda m: m | {"speed": 9.0}, 3 * 10**9),
    "a message that is none": First("signal/user.pose", lambda m: {"no": 1}, 3 * 10**9),
}


@pytest.fixture(scope="module")
def forced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record with a command."""
    path = tmp_path_factory.mktemp("forced") / "run.mcap"
    recorded(path, SHORT, {5.0: lambda op, *_: op.force("chase", "failed")}, scene="lab_a")
    return path


@pytest.mark.parametrize("what", ALTERATIONS)
@pytest.mark.few(7)
def test_what_was_altered_is_told_at_its_place(what: str, forced: Path) -> None:
    first = ALTERATIONS[what]
    replay = replayed(altered(forced, first))

    assert first.at_ns is not None
    assert replay.difference is not None
    assert abs(replay.difference.at_ns - first.at_ns) <= 34 * 10**6
    assert ALTERED in replay.difference.what


def test_a_copy_in_which_nothing_was_altered_is_the_same(forced: Path) -> None:
    assert replayed(altered(forced, lambda _, message: message)).difference is None
