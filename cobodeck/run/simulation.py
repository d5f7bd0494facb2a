"""Runs a chart to its end and collects the figures. Wall time affects nothing but the report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cobodeck.checks import small_floor
from cobodeck.evaluate import (
    NOTHING,
    Evaluator,
    LocalizationWatch,
    SeparationWatch,
    StuckWatch,
    escape_figures,
    refusal_figures,
    shown_figures,
)
from cobodeck.fitness import require
from cobodeck.loop import Clock, Loop, ValueTap, Wired
from cobodeck.project import reached
from cobodeck.run.build_run import localizing, stage
from cobodeck.run.shadow import Shadow
from cobodeck.setup import FULL, Options, Setup, warm_up
from engine.run import Raised
from engine.signals import Usage
from hw.people import with_manner

if TYPE_CHECKING:  # its libraries are loaded only where a record is kept
    from cobodeck.record.write import Recorder


class Spent(NamedTuple):
    """Time by the wall clock, and of the CPU in this thread, s."""

    wall_s: float
    cpu_s: float

    @classmethod
    def now(cls) -> Spent:
        """Both clocks now."""
        return cls(time.perf_counter(), time.thread_time())

    def since(self) -> Spent:
        """What has been spent since then."""
        wall_s, cpu_s = Spent.now()
        return Spent(wall_s - self.wall_s, cpu_s - self.cpu_s)


@dataclass(frozen=True, slots=True)
class RunResult:
    """The outcome of a run; `record_file` is None if no record was kept."""

    figures: Mapping[str, Any]
    loop: Loop
    record_file: Path | None = None

    @property
    def wired(self) -> Wired:
        """The run with its board."""
        return self.loop.wired

    @property
    def usage(self) -> dict[str, Usage]:
        """Signals built, computed and skipped."""
        return self.wired.board.usage()


def simulate(  # noqa: PLR0913  one call says all there is to say about a run
    setup: Setup,
    options: Options,
    progress: Callable[[str, float | None], None] | None = None,
    clock: Clock | None = None,
    around: Callable[[Loop], AbstractContextManager[object]] = nullcontext,
    tell: Callable[[Raised], None] | None = None,
    recorder: Recorder | None = None,
    shadow: Shadow | None = None,
) -> RunResult:
    """Run until the user is done, the chart has ended, or the time is up.

    Args:
        setup: what to run.
        options: how.
        progress: called now and then with the time in the run, as text, and the share done, 0 to 1.
        clock: virtual time by default.
        around: a context in which the loop runs, such as one that ends it on a signal.
        tell: called with each error of states and parts, as it occurs.
        recorder: records the run; its file is completed at the end.
        shadow: decides beside the run, and commands nothing.
    """
    try:
        loop = _staged(setup, options, clock, recorder, shadow)
    except BaseException:
        if recorder is not None:
            recorder.give_up()
        raise
    loop.tell = tell
    if recorder is not None:
        recorder.attend(loop)
    figures, begin = None, Spent.now()
    try:
        with around(loop):
            end_ns = loop.go(round(options.duration_s * 1e9), _with_share(loop, options, progress))
        figures = figures_of(setup, options, loop, end_ns / 1e9, begin.since())
        if shadow is not None:
            figures["shadow"] = shadow.figures()
    finally:
        file = None if recorder is None else recorder.finish(figures)
    return RunResult(figures, loop, file)


def _with_share(
    loop: Loop, options: Options, progress: Callable[[str, float | None], None] | None
) -> Callable[[str], None] | None:
    """A progress callback that adds the share done: of the duration or of the requests."""
    if progress is None:
        return None
    evaluators = [watch for watch in loop.observers if isinstance(watch, Evaluator)]

    def report(text: str) -> None:
        shares = [loop.now_ns / (options.duration_s * 1e9)]
        if options.requests:
            shares += [len(watch.requests.asked) / options.requests for watch in evaluators]
        progress(text, max(shares))

    return report


def _staged(
    setup: Setup,
    options: Options,
    clock: Clock | None,
    recorder: Recorder | None,
    shadow: Shadow | None,
) -> Loop:
    if options.tier:
        require("simulate", setup=setup)
        setup = localizing(setup, options)
        warm_up(setup, setup.machine())  # before devices are opened and clocks run
        if shadow is not None:
            warm_up(shadow.setup, shadow.setup.machine())
    taps: list[ValueTap] = [one.tap for one in (shadow, recorder) if one is not None]
    loop = stage(setup, options, clock=clock, tap=one_in_the_other(taps))
    if shadow is not None:
        try:
            shadow.attend(loop, setup.localizing, eager=options.eager)
        except BaseException:
            loop.plant.close()
            raise
        if recorder is not None:
            shadow.note = recorder.shadow
    return loop


def one_in_the_other(taps: Sequence[ValueTap]) -> ValueTap | None:
    """A tap that wraps a part by each of these, the first one innermost; None without any."""
    if not taps:
        return None

    def tap(name: str, part: Any) -> Any:
        for one in taps:
            part = one(name, part)
        return part

    return tap


def figures_of(
    setup: Setup, options: Options, loop: Loop, sim_s: float, spent: Spent
) -> dict[str, Any]:
    """The figures of a finished run, by their names in JSON; `spent` is the loop's time."""
    wall_s = spent.wall_s
    run, board = loop.wired.run, loop.wired.board
    return {
        "chart": setup.chart.name,
        "inputs": dict(setup.inputs),
        "scene": None if setup.scene is None else setup.scene.name,
        "robot": setup.robot.name,
        "user": options.user or (None if setup.scene is None else setup.scene.user),
        "profile": setup.profile.name,
        "set": list(setup.profile.sets),
        "chart_values": _chart_values(setup),
        "small_floor": small_floor(setup) if options.tier else None,
        "mount_error": _mount_error(setup, options),
        "tier": options.tier,
        "seed": options.seed,
        "tick_hz": setup.tick_hz,
        "sim_s": sim_s,
        "wall_s": wall_s,
        "realtime_factor": sim_s / wall_s if wall_s > 0.0 else None,
        "cpu_us_per_tick": 1e6 * spent.cpu_s / loop.ticks if loop.ticks else None,
        "ticks": loop.ticks,
        "left_out": loop.left_out,
        "missed": loop.missed,
        "outcome": run.outcome,
        "ended": _ended(options, loop, sim_s),
        "objects_seen": _objects_seen(setup, options, loop),
        "refused_samples": loop.wired.inlet.refused,
        "errors": [{"at_s": e.time / 1e9, "node": e.path, "error": str(e)} for e in run.errors],
        "transitions": sum(record.kind == "move" for record in run.trace),
        "trace_sha256": run.trace.sha256(),
        **escape_figures(run),
        **(_judged(setup, loop) if options.tier else NOTHING),
        **_manner(setup, options, loop),
        "overruns": None if loop.stopwatch is None else loop.stopwatch.overruns,
        "signals": {
            name: {"evaluated": usage.evaluated, "skipped": usage.skipped}
            for name, usage in board.usage().items()
        },
    }


def _chart_values(setup: Setup) -> dict[str, dict[str, Any]]:
    """Parameters of charts for which the profile or `--set` has other values than the charts."""
    used = {name: setup.library[name] for name in reached({setup.chart.name}, setup.library)}
    values = setup.profile.chart_values(used)
    return {name: value._asdict() for name, value in values.items()}


def _mount_error(setup: Setup, options: Options) -> dict[str, list[float]]:
    """Where mounts differ from the files, [x, y, yaw], m and rad, in a run with sensors."""
    off = setup.profile.plant.sensing.mount_error if options.tier >= FULL else {}
    return {name: [pose.x, pose.y, pose.yaw] for name, pose in off.items()}


def _ended(options: Options, loop: Loop, sim_s: float) -> str:
    """What ended the run: `outcome` of the chart, `time`, `user` (who is done), `broken off`."""
    if loop.wired.run.outcome is not None:
        return "outcome"
    if round(sim_s * 1e9) >= round(options.duration_s * 1e9):
        return "time"
    return "user" if loop.plant.finished else "broken off"


def _objects_seen(setup: Setup, options: Options, loop: Loop) -> bool | None:
    """Whether anything scans for the objects of the scene; None if it has none."""
    if not options.tier or setup.scene is None or not setup.scene.objects:
        return None
    return "base.scan" in loop.wired.inlet.flowing


def _manner(setup: Setup, options: Options, loop: Loop) -> dict[str, Any]:
    """How the simulated person treats the robot, and how late they see the sign, s."""
    source = options.user or (None if setup.scene is None else setup.scene.user)
    truth = loop.plant.truth
    simulated = options.plays_dummy or (truth is not None and truth.body is not None)
    manner = with_manner(source)[1] if simulated and source is not None else None
    return {
        "manner": None if manner is None else manner.name,
        "reaction_s": None if manner is None else manner.reaction(options.seed),
    }


def _judged(setup: Setup, loop: Loop) -> dict[str, Any]:
    """Figures of robot and person, without those that do not exist or cannot be known."""
    guard = loop.plant.guard
    found: dict[str, Any] = {"localization": None, "stuck": None}
    if guard is not None:
        limits = guard.chain.limits
        found["governor"] = limits.governor and limits.watched
        found["person_watched"] = limits.watched
    for observer in loop.observers:
        if isinstance(observer, SeparationWatch):
            found["separation"] = observer.report()
        if isinstance(observer, StuckWatch):
            observer.watch(loop.now_ns)  # what ended in the last tick
            found["stuck"] = observer.found
        if isinstance(observer, LocalizationWatch):
            found["localization"] = observer.report()
        if isinstance(observer, Evaluator):
            observer.finish()
            found |= observer.report()
            if observer.person:
                shown = None if found["signs"] is None else observer.shown
                found |= shown_figures(loop.wired.run, shown)
                found |= refusal_figures(setup, loop.wired.run, observer.requests.unserved)
    faults: list[str] = getattr(loop.plant.parts.get("operator"), "faults", [])
    found["faults"] = len(faults)
    found["fault_names"] = {name: faults.count(name) for name in dict.fromkeys(faults)}
    return found
