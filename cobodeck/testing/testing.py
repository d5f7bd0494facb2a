"""Charts in virtual time for tests, with or without a simulated robot.

    def test_a_blocked_drive_is_tried_again(sim):
        sim.start("mine.yaml", script={"drive": ["blocked", "arrived"]})
        sim.until("rest", timeout=5)
        sim.assert_path("drive", "drive", "rest")

Without a scene every leaf follows the script, and runs on forever if the script has no outcome for
it; leaves named in `real` are real states, with stub parts and with signals from the test. With a
scene everything that the script does not name is real, on the simulated robot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cobodeck.loop import Loop
from cobodeck.project import Catalogue, catalogue, open_chart
from cobodeck.setup import Options
from cobodeck.testing.chart_only import HZ, chart_of_text, loop_alone
from cobodeck.testing.stub_parts import Parts
from engine.files import did_you_mean
from engine.machine import Leaf, LeafScript
from engine.operator import Operator
from engine.run import ChartRun
from engine.signals import Measured

ScriptedOutcome = str | tuple[str, Mapping[str, Any]] | Exception
Outcomes = ScriptedOutcome | Sequence[ScriptedOutcome]


class ChartTester:
    """Starts charts, lets virtual time pass, and reports what the charts did.

    Charts are looked up in `folder`, states and other charts in the project around `root`.
    """

    def __init__(self, folder: Path, root: Path, parts: Parts | None = None) -> None:
        self.folder, self.root = folder, root
        self.parts = parts if parts is not None else Parts()
        self.metrics: Callable[[], Mapping[str, Any]] | None = None
        self._known: Catalogue | None = None
        self._loop: Loop | None = None
        self._script: LeafScript | None = None

    # -- starting --------------------------------------------------------------------------------

    def start(  # noqa: PLR0913  one call says all there is to say about a run
        self,
        chart: str,
        script: Mapping[str, Outcomes] | None = None,
        *,
        real: Iterable[str] = (),
        signals: Mapping[str, Any] | None = None,
        parameters: Mapping[str, Any] | None = None,
        scene: str | None = None,
        robot: str | None = None,
        user: str | None = None,
        requests: int | None = None,
        profile: str | None = None,
    ) -> ChartTester:
        """Start a chart: a file beside the test, a name, or the YAML text itself.

        Args:
            chart: what to run; it is checked first.
            script: per leaf its outcomes, in the order in which they are used. A leaf is named by
                its path, the end of its path, or its class. An outcome may have outputs,
                `("found", {"goal": pose})`, or be an exception, which is raised.
            real: leaves, named likewise, that run unscripted although there is no scene.
            signals: initial values; the test feeds these signals from then on, derived ones too.
            parameters: of the chart.
            scene: run on the simulated robot in this scene.
            robot: a robot other than the scene's; without a scene there is no room.
            user: the person in the scene; by default the scene's own.
            requests: number of touches that the user asks for.
            profile: by default `tuned`.

        Raises:
            AssertionError, Problem: the chart has errors, or names something that does not exist.
        """
        alone = scene is None and robot is None
        if alone:
            known = self._catalogue()
            opened = chart_of_text(chart, known) if "\n" in chart else None
            opened = opened or open_chart(self._beside(chart), known)
            self._loop = loop_alone(*opened, known, self.parts, signals or {}, parameters)
        else:
            self._start_simulated(
                self._beside(chart), scene, robot, profile, Options(user, requests), parameters
            )
        for path, outcomes in self._script_for(script or {}, real, everything=alone).items():
            for outcome in outcomes:
                self._end(path, outcome)
        return self

    def _start_simulated(
        self,
        chart: str,
        scene: str | None,
        robot: str | None,
        profile: str | None,
        options: Options,
        parameters: Mapping[str, Any] | None,
    ) -> None:
        from cobodeck.evaluate import Evaluator
        from cobodeck.run import stage
        from cobodeck.setup import open_setup

        setup = open_setup(chart, scene, profile, HZ, robot, known=self._catalogue())
        self._loop = stage(setup, options, parameters)
        for observer in self._loop.observers:
            if isinstance(observer, Evaluator):
                self.metrics = observer.report

    def _beside(self, chart: str) -> str:
        """The file of this name beside the test if there is one, else the name itself."""
        file = self.folder / chart
        return str(file) if file.is_file() else chart

    def _catalogue(self) -> Catalogue:
        if self._known is None:
            self._known = catalogue(self.root)
        return self._known

    def _script_for(
        self, script: Mapping[str, Outcomes], real: Iterable[str], *, everything: bool
    ) -> dict[str, list[ScriptedOutcome]]:
        machine = self.run.machine
        played = {
            leaf.path: [outcomes] if isinstance(outcomes, str | tuple | Exception) else outcomes
            for name, outcomes in script.items()
            for leaf in self._leaves(name)
        }
        kept = {leaf.path for name in real for leaf in self._leaves(name)}
        self._script = LeafScript(machine)
        for path, stand_in in self._script.stand_ins.items():
            if path not in kept and (everything or path in played):
                self.run.put_in(path, stand_in)
        return {path: list(outcomes) for path, outcomes in played.items()}

    # -- while it runs ---------------------------------------------------------------------------

    @property
    def loop(self) -> Loop:
        """The loop that runs the chart."""
        assert self._loop is not None, "start a chart first: sim.start(…)"
        return self._loop

    @property
    def run(self) -> ChartRun:
        """The engine's run."""
        return self.loop.wired.run

    @property
    def now(self) -> float:
        """Virtual time since the start, s."""
        return max(0, self.loop.now_ns) / 1e9

    @property
    def outcome(self) -> str | None:
        """The outcome of the chart, once it has ended."""
        return self.run.outcome

    @property
    def results(self) -> Mapping[str, Any]:
        """The outputs of the chart."""
        return self.run.results

    @property
    def active(self) -> list[str]:
        """The paths of the running leaves."""
        return self.run.active

    @property
    def operator(self) -> Operator:
        """The operator's commands."""
        return Operator(self.run)

    def tick(self, count: int = 1) -> None:
        """Let `count` ticks pass."""
        for _ in range(count):
            self.loop.tick()

    def wait(self, seconds: float) -> None:
        """Let virtual time pass, s."""
        self.tick(round(seconds * HZ))

    def until(self, where: str | Callable[[], object], timeout: float = 10.0) -> None:
        """Let time pass until a node is active, the chart has an outcome, or a condition holds.

        `where` is a node's path, its name, an outcome of the chart, or a function. A node counts as
        reached if it is active already, or if it is entered from now on, even if left within the
        same tick; a node that was left before counts only once it is entered again.

        Raises:
            AssertionError: it did not happen within `timeout`, s.
        """
        end = self.loop.ticks + max(1, round(timeout * HZ))
        reached = where if callable(where) else self._reaching(where)
        while not reached():
            assert self.loop.ticks < end, (
                f"{where!r} was not reached within {timeout:g} s; {self._story()}"
            )
            self.tick()

    def signal(self, name: str, value: Any) -> None:
        """Deliver a sample of a measured signal at the next tick.

        Derived and estimated signals can be fed too, once `start(signals={name: value})` takes
        them over.
        """
        declared = self.run.board.declared
        hint = did_you_mean(name, declared)
        assert name in declared, f"no signal {name!r} is read by this chart; {hint}"
        kind = type(declared[name]).__name__.lower()
        assert isinstance(declared[name], Measured), (
            f"{name!r} is {kind}; take it over with start(signals={{{name!r}: …}})"
        )
        self.loop.wired.inlet.put(name, value, self.loop.next_ns)

    def end(self, name: str, outcome: str | Exception, **outputs: Any) -> None:
        """Let a scripted leaf end with an outcome at its next step."""
        for leaf in self._leaves(name):
            self._end(leaf.path, outcome if isinstance(outcome, Exception) else (outcome, outputs))

    def _end(self, path: str, outcome: ScriptedOutcome) -> None:
        assert self._script is not None
        if isinstance(outcome, Exception):
            self._script.end(path, outcome)
            return
        name, outputs = (outcome, {}) if isinstance(outcome, str) else outcome
        known = self.run.machine.vertices[path]
        assert isinstance(known, Leaf)
        declared = known.interface.outcomes
        assert name in declared, f"{path} has no outcome {name!r}; {did_you_mean(name, declared)}"
        self._script.end(path, name, **outputs)

    # -- what happened ---------------------------------------------------------------------------

    def path(self, *names: str) -> list[str]:
        """The nodes entered, in order: all leaves, or only the nodes named."""
        if not names:
            return self.run.trace.path()
        entered = [record.subject for record in self.run.trace if record.kind == "enter"]
        matched = [next((n for n in names if _is_named(path, n)), None) for path in entered]
        return [name for name in matched if name is not None]

    def assert_path(self, *names: str) -> None:
        """Assert that the nodes named were entered exactly so, in order; others are ignored."""
        for name in names:
            self._require(name)
        found = self.path(*dict.fromkeys(names))
        assert found == list(names), (
            f"expected {' -> '.join(names)}\n"
            f"     got {' -> '.join(found) or 'nothing'}\n{self._story()}"
        )

    def finish(self) -> None:
        """Stop the run if it has not ended."""
        if self._loop is not None and self.outcome is None:
            self.operator.stop()
            self.tick()

    def _reaching(self, where: str) -> Callable[[], bool]:
        outcomes = {*self.run.machine.chart.outcomes, "error"}
        if where not in outcomes or any(_is_named(p, where) for p in self.run.machine.vertices):
            self._require(where, outcomes)
        before = sum(1 for _ in self.run.trace)

        def reached() -> bool:
            if self.run.outcome == where:
                return True
            active: set[str] = set()
            for n, record in enumerate(self.run.trace):
                if not _is_named(record.subject, where):
                    continue
                if record.kind == "enter":
                    active.add(record.subject)
                    if n >= before:
                        return True
                elif record.kind == "exit":
                    active.discard(record.subject)
            return bool(active)

        return reached

    def _require(self, name: str, also: Iterable[str] = ()) -> None:
        vertices = self.run.machine.vertices
        known = {path.rpartition("/")[2] for path in vertices} | set(vertices) | set(also)
        found = any(_is_named(path, name) for path in vertices)
        assert found, f"no node {name!r} in the chart; {did_you_mean(name, known - {''})}"

    def _leaves(self, name: str) -> list[Leaf]:
        leaves = self._leaves_of_run()
        found = [v for v in leaves if _is_named(v.path, name) or v.interface.name == name]
        known = {v.path for v in leaves} | {v.interface.name for v in leaves}
        assert found, f"no leaf {name!r} in the chart; {did_you_mean(name, known)}"
        return found

    def _leaves_of_run(self) -> list[Leaf]:
        return self.run.machine.leaves

    def _story(self) -> str:
        shown = self.path()[-12:]
        active = ", ".join(self.active) or f"nothing, outcome {self.outcome}"
        raised = "".join(f"; raised: {error}" for error in self.run.errors[-1:])
        return f"at {self.now:.2f} s; active: {active}; last entered: {' -> '.join(shown)}{raised}"


def _is_named(path: str, name: str) -> bool:
    return path == name or path.endswith("/" + name)
