"""A chart run in virtual time for tests, with or without the robot.

    def test_a_blocked_drive_is_tried_again(sim):
        sim.start("mine.yaml", script={"drive": ["blocked", "arrived"]})
        sim.until("rest", timeout=5)
        sim.assert_path("drive", "drive", "rest")

Without a scene every leaf does as the script says, and stays busy where it says nothing; leaves
named in `real` are the real states, with stand-ins for their parts and with signals from the test.
With a scene everything is real but what the script names, on the simulated robot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cobodeck.catalogue import Catalogue, catalogue
from cobodeck.inlet import Inlet
from cobodeck.library import findings_of, load_beside, open_chart
from cobodeck.loop import Loop
from cobodeck.plants import Nothing
from cobodeck.stub_parts import Parts
from cobodeck.wiring import Wired
from engine.board import Board
from engine.chart import Chart
from engine.clock import TickGrid
from engine.files.finding import did_you_mean
from engine.load import load_text
from engine.machine import Leaf, Machine
from engine.operator import Operator
from engine.report import text as report_text
from engine.run import ChartRun
from engine.scripted import LeafScript
from engine.signals import Measured, Signal

ScriptedOutcome = str | tuple[str, Mapping[str, Any]] | Exception
Outcomes = ScriptedOutcome | Sequence[ScriptedOutcome]

HZ = 30


class Rehearsal:
    """Starts charts, lets time pass, and looks at what they did.

    Charts are looked for in `folder`, states and other charts in the project around `root`.
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
    ) -> Rehearsal:
        """Begin with a chart: a file beside the test, a name, or the YAML text itself.

        Args:
            chart: what to run; it is checked first.
            script: outcomes of leaves, by path, by the end of a path, or by class; one after the
                other. An outcome may come with outputs, `("found", {"goal": pose})`, or be an
                exception that is raised.
            real: leaves, named likewise, that are not scripted although there is no scene.
            signals: values at the start; these signals are then the test's, whatever they were.
            parameters: of the chart.
            scene: run on the simulated robot in this scene.
            robot: another body than the scene's; without a scene: in no room.
            user: who walks about in it; by default the scene's user.
            requests: how many touches the user asks for.
            profile: by default `tuned`.
        """
        if scene is not None or robot is not None:
            self._start_simulated(chart, scene, robot, user, requests, profile, parameters)
        else:
            self._start_alone(chart, signals or {}, parameters)
        alone = scene is None and robot is None
        scripted = self._script_for(script or {}, real, everything=alone)
        for path, outcomes in scripted.items():
            for outcome in outcomes:
                self._end(path, outcome)
        return self

    def _start_alone(
        self, chart: str, signals: Mapping[str, Any], parameters: Mapping[str, Any] | None
    ) -> None:
        opened, library = self._open(chart)
        known = self._catalogue()
        machine = Machine(opened, library, known.interfaces, parameters, known.types)
        declared = _declared(machine, known, signals)
        board = Board(declared)
        inlet = Inlet(board)
        for name, value in signals.items():
            inlet.put(name, value, 0)
        commands = {name for leaf in machine.leaves for name in leaf.interface.commands}
        run = ChartRun(machine, board, {name: self.parts[name] for name in sorted(commands)})
        self._loop = Loop(Nothing(self.parts), Wired(run, board, inlet), TickGrid(HZ))

    def _start_simulated(
        self,
        chart: str,
        scene: str | None,
        robot: str | None,
        user: str | None,
        requests: int | None,
        profile: str | None,
        parameters: Mapping[str, Any] | None,
    ) -> None:
        from cobodeck.metrics import Evaluator
        from cobodeck.options import Options
        from cobodeck.stage import stage
        from cobodeck.wiring import open_setup

        beside = self.folder / chart
        name = str(beside) if beside.is_file() else chart
        setup = open_setup(name, scene, profile, HZ, robot, known=self._catalogue())
        loop = stage(setup, Options(user, requests), parameters)
        self._loop = loop
        for observer in loop.observers:
            if isinstance(observer, Evaluator):
                self.metrics = observer.report

    def _open(self, chart: str) -> tuple[Chart, Mapping[str, Chart]]:
        known = self._catalogue()
        beside = self.folder / chart if "\n" not in chart else None
        if beside is not None:
            return open_chart(str(beside) if beside.is_file() else chart, known)
        library = load_text(chart, "<test>")
        for name, other in load_beside([], known).items():
            library.setdefault(name, other)
        errors = [
            finding
            for finding in findings_of(library, known, [Path("<test>")])
            if finding.severity == "error"
        ]
        assert not errors, f"the chart cannot run\n{report_text(errors, library.sources)}"
        return next(iter(library.values())), library

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
        """The loop that runs it."""
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
        """The paths of the leaves that are going on."""
        return self.run.active

    @property
    def operator(self) -> Operator:
        """The operator's commands."""
        return Operator(self.run)

    def tick(self, count: int = 1) -> None:
        """Let so many ticks pass."""
        for _ in range(count):
            self.loop.tick()

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self.tick(round(seconds * HZ))

    def until(self, where: str | Callable[[], object], timeout: float = 10.0) -> None:
        """Let time pass until a node is active, the chart has ended so, or a condition holds.

        `where` is a node's path, its name, an outcome of the chart, or a function. A node that is
        active already, or is entered and left within one tick from now on, is reached; one that was
        left before is not, until it is entered again.

        Raises:
            AssertionError: that did not happen within `timeout`, s.
        """
        end = self.loop.ticks + max(1, round(timeout * HZ))
        reached = where if callable(where) else self._reaching(where)
        while not reached():
            assert self.loop.ticks < end, (
                f"{where!r} was not reached within {timeout:g} s; {self._story()}"
            )
            self.tick()

    def signal(self, name: str, value: Any) -> None:
        """Deliver a sample of a measured signal, for the next tick.

        Others can be scripted too if `start(signals={name: value})` takes them over.
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
        """Of the nodes named, exactly these were entered, in this order; others do not count."""
        for name in names:
            self._require(name)
        found = self.path(*dict.fromkeys(names))
        assert found == list(names), (
            f"expected {' -> '.join(names)}\n"
            f"     got {' -> '.join(found) or 'nothing'}\n{self._story()}"
        )

    def finish(self) -> None:
        """Stop the run, if one goes on."""
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


def _declared(
    machine: Machine, known: Catalogue, taken_over: Mapping[str, Any]
) -> dict[str, Signal]:
    """The signals that the chart reads: those of one's own as they are, all others measured.

    A site that is given says who plans.
    """
    from behaviors.signals import MEASURED, planning

    shipped = (
        *MEASURED,
        *(planning(taken_over["environment"]) if "environment" in taken_over else ()),
    )
    others = (s for s in (*shipped, *known.own_signals) if s.name not in taken_over)
    own = {s.name: s for s in MEASURED} | {s.name: s for s in others}
    found: dict[str, Signal] = {}

    def add(name: str) -> None:
        if name in found:
            return
        signal = own.get(name) or Measured(name)
        for source in getattr(signal, "of", ()):
            add(source)
        found[name] = signal

    for name in taken_over:
        add(name)
    for leaf in machine.leaves:
        for name in leaf.interface.reads:
            add(name)
    return found
