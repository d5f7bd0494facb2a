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

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from cobodeck.loop import Loop
from cobodeck.project import Catalogue, catalogue, open_chart
from cobodeck.setup import Options, Setup, open_setup
from cobodeck.terminal import Problem
from cobodeck.testing.chart_only import HZ, chart_of_text, loop_alone, require_inputs
from cobodeck.testing.edge_coverage import EdgeCoverage
from cobodeck.testing.scripted_leaves import Outcomes, ScriptedLeaves, is_named
from cobodeck.testing.signal_feed import SignalFeed, require_seconds
from cobodeck.testing.story import story
from cobodeck.testing.stub_parts import Parts
from cobodeck.testing.visits import entered, reaching, require_node
from engine.files.declared import Mismatch
from engine.operator import Operator
from engine.run import ChartRun

__tracebackhide__ = True  # a failing test shows its own line, and one message


class _Started(NamedTuple):
    """A run that has been started, and what the test does to it."""

    loop: Loop
    feed: SignalFeed
    scripted: ScriptedLeaves


class ChartTester:
    """Starts charts, lets virtual time pass, and reports what the charts did.

    Charts are looked up in `folder`, states and other charts in the project around `root`.
    `covers`, if given, counts the edges that the charts take.
    """

    def __init__(
        self,
        folder: Path,
        root: Path,
        parts: Parts | None = None,
        covers: EdgeCoverage | None = None,
    ) -> None:
        self.folder, self.root = folder, root
        self.parts = parts if parts is not None else Parts()
        self.covers = covers
        self.metrics: Callable[[], Mapping[str, Any]] | None = None
        self._started: _Started | None = None

    def __repr__(self) -> str:
        if self._started is None:
            return "<sim, not started>"
        ended = f"ended with {self.outcome!r}" if self.outcome else "nothing runs"
        doing = ", ".join(self.active) or ended
        return f"<sim of {self.run.machine.chart.name} at {self.now:.2f} s: {doing}>"

    # -- starting --------------------------------------------------------------------------------

    def start(  # noqa: PLR0913  one call says all there is to say about a run
        self,
        chart: str,
        script: Mapping[str, Outcomes] | None = None,
        *,
        real: Iterable[str] = (),
        signals: Mapping[str, Any] | None = None,
        parameters: Mapping[str, Any] | None = None,
        inputs: Mapping[str, Any] | None = None,
        scene: str | None = None,
        robot: str | None = None,
        user: str | None = None,
        requests: int | None = None,
        profile: str | None = None,
        tier: int = 1,
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
            inputs: of the chart, as written in a chart or as Python has them.
            scene: run on the simulated robot in this scene.
            robot: a robot other than the scene's; without a scene there is no room.
            user: the person in the scene; by default the scene's own.
            requests: number of touches that the user asks for.
            profile: by default `tuned`.
            tier: 1, 2 with all sensors, or 3 with physics, too.

        Raises:
            AssertionError, Problem: the chart has errors, an input has no value, or something is
                named that does not exist.
        """
        self._note_edges()
        alone = scene is None and robot is None
        if signals and not alone:
            raise AssertionError("signals= is for charts without a robot; here its parts measure")
        try:
            known = _known_around(self.root)
            if alone:
                opened = chart_of_text(chart, known) if "\n" in chart else None
                opened = opened or open_chart(self._beside(chart), known)
                loop = loop_alone(*opened, known, self.parts, signals or {}, parameters, inputs)
            else:
                file = self._beside(chart)
                setup = open_setup(file, scene, profile, HZ, robot, known=known, inputs=inputs)
                require_inputs(setup.machine(parameters))
                loop = self._simulated(setup, Options(user, requests, tier=tier), parameters)
        except Problem as problem:
            raise problem.with_traceback(None) from None
        except Mismatch as mismatch:
            raise AssertionError(f"the chart cannot start: {mismatch}") from None
        scripted = ScriptedLeaves(loop.wired.run)
        self._started = _Started(loop, SignalFeed(loop), scripted)
        scripted.play(script or {}, real, everything=alone)
        return self

    def _simulated(
        self, setup: Setup, options: Options, parameters: Mapping[str, Any] | None
    ) -> Loop:
        from cobodeck.evaluate import Evaluator, run_figures
        from cobodeck.run import stage

        loop = stage(setup, options, parameters)
        for observer in loop.observers:
            if isinstance(observer, Evaluator):
                self.metrics = partial(run_figures, observer, loop.wired.run)
        return loop

    def _beside(self, chart: str) -> str:
        """The file of this name beside the test if there is one, else the name itself."""
        file = self.folder / chart
        return str(file) if file.is_file() else chart

    # -- while it runs ---------------------------------------------------------------------------

    @property
    def loop(self) -> Loop:
        """The loop that runs the chart."""
        return self._begun.loop

    @property
    def _begun(self) -> _Started:
        if self._started is None:
            raise AssertionError("start a chart first: sim.start(…)")
        return self._started

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
        loop, feed, _ = self._begun
        for _ in range(count):
            feed.deliver()
            loop.tick()

    def wait(self, seconds: float) -> None:
        """Let virtual time pass, s."""
        require_seconds("seconds", seconds)
        self.tick(round(seconds * HZ))

    def until(self, where: str | Callable[[], object], timeout: float = 10.0) -> None:
        """Let time pass until a node is active, the chart has an outcome, or a condition holds.

        `where` is a node's path, its name, an outcome of the chart, or a function. A node counts as
        reached if it is active already, or if it is entered from now on, even if left within the
        same tick; a node that was left before counts only once it is entered again.

        Raises:
            AssertionError: it did not happen within `timeout`, s.
        """
        require_seconds("timeout", timeout)
        begin, end = self.now, self.loop.ticks + max(1, round(timeout * HZ))
        reached = where if callable(where) else reaching(self.run, where)
        while not reached():
            if self.loop.ticks >= end:
                what = "the condition" if callable(where) else repr(where)
                raise AssertionError(
                    f"{what} was not reached within {timeout:g} s, from {begin:.2f} s"
                    f" to {self.now:.2f} s\n{story(self.run)}"
                )
            self.tick()

    def signal(self, name: str, value: Any, hold: float | bool = False) -> None:
        """Deliver a sample of a measured signal at the next tick.

        Derived and estimated signals can be fed too, once `start(signals={name: value})` takes
        them over.

        Args:
            name: of the signal.
            value: of its type, or None for "nothing".
            hold: `True` delivers it anew at every tick until the test feeds this signal again, so
                that it is never too old; a number does so for as long, s.

        Raises:
            AssertionError: the chart reads no such signal, or the value is of another type.
        """
        if hold is False:
            self._begun.feed.sample(name, value)
        else:
            self._begun.feed.hold(name, {0.0: value}, math.inf if hold is True else hold)

    def series(self, name: str, values: Mapping[float, Any]) -> None:
        """Let a measured signal take one value after the other, each held until the next one.

        `sim.series("user.distance", {0: 3.0, 1.5: 0.5})` holds 3 m, and from 1.5 s later on 0.5 m.
        Requires of signal and values the same as `signal`.
        """
        self._begun.feed.hold(name, values)

    def end(self, name: str, outcome: str | Exception, **outputs: Any) -> None:
        """Let a scripted leaf end with an outcome at its next step."""
        self.loop  # noqa: B018  started?
        ended = outcome if isinstance(outcome, Exception) else (outcome, outputs)
        self._begun.scripted.end(name, ended)

    def time_out(self, name: str) -> None:
        """Let the timeout of a node that runs be over at the next tick, however long it is."""
        run = self.run
        named = (node for node in run.entered if is_named(node.path, name))
        due = [node for node in named if node.vertex.timeout_ns is not None]
        if not due:
            require_node(run, name)
            raise AssertionError(f"no timeout of {name!r} runs\n{story(run)}")
        for node in due:
            run.life.set_deadline(node, run.board.chart_now)

    # -- what happened ---------------------------------------------------------------------------

    def path(self, *names: str) -> list[str]:
        """The nodes entered, in order: all leaves, or only the nodes named."""
        if not names:
            return self.run.trace.path()
        return entered(self.run, names)

    def assert_path(self, *names: str) -> None:
        """Assert that the nodes named were entered exactly so, in order; others are ignored."""
        for name in names:
            require_node(self.run, name)
        found = self.path(*dict.fromkeys(names))
        if found != list(names):
            raise AssertionError(
                f"expected {' -> '.join(names)}\n"
                f"     got {' -> '.join(found) or 'nothing'}\n"
                f"at {self.now:.2f} s:\n{story(self.run)}"
            )

    def finish(self) -> None:
        """Stop the run if it has not ended."""
        self._note_edges()
        if self._started is not None and self.outcome is None:
            self.operator.stop()
            self.loop.tick()

    def _note_edges(self) -> None:
        if self.covers is not None and self._started is not None:
            self.covers.add(self.run)


@cache
def _known_around(root: Path) -> Catalogue:
    """What charts in a project can name, looked up once, as the code of its states is read once."""
    return catalogue(root)
