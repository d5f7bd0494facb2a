"""Run a chart on the simulated robot, beside a scripted or recorded user."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, redirect_stdout
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.arguments import length, positive, seconds, word
from cobodeck.console import FAILED, OK, Progress, complain, show, show_json, table
from cobodeck.wiring import CHART, PROFILE, SCENE, TICK_HZ
from engine.errors import Raised

if TYPE_CHECKING:
    from cobodeck.clocks import Clock
    from cobodeck.loop import Loop
    from cobodeck.record.recorder import Recorder
    from cobodeck.simulate import Result
    from cobodeck.stage import Options
    from cobodeck.wiring import Setup

BLOCKED_S = 5.0
"""Longer ticks, s of wall time, are reported with what blocks them."""
SHOWN = 3
"""So many contacts and drop-outs are shown one by one."""
FAILURES = ("error", "failed")
"""Outcomes of a chart that make the command fail."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "chart", nargs="?", type=word, default=CHART, help=f"name or file; default {CHART}"
    )
    parser.add_argument("--scene", type=word, help=f"name or file; default {SCENE}")
    parser.add_argument(
        "--robot", type=word, help="name or file; default the scene's; without --scene: no room"
    )
    parser.add_argument(
        "--user", type=word, metavar="NAME|random|FILE[#id][@x,y,yaw]", help="default: the scene's"
    )
    parser.add_argument("--requests", type=positive, metavar="N", help="end after so many")
    parser.add_argument(
        "--profile", type=word, default=PROFILE, help=f"name or file; default {PROFILE}"
    )
    parser.add_argument(
        "--tier",
        type=int,
        default=1,
        choices=(0, 1),
        help="0: logic alone, leaves end by chance; 1: reduced; default 1",
    )
    parser.add_argument("--seed", type=int, default=0, help="of everything random; default 0")
    parser.add_argument(
        "--tick-hz", type=positive, default=TICK_HZ, metavar="HZ", help=f"default {TICK_HZ}"
    )
    about = "end by then; an hour, or three minutes a request, by default"
    parser.add_argument("--duration", type=seconds, metavar="S", help=about)
    parser.add_argument(
        "--stretch", type=length, metavar="M", help="make the longer side of a recording so long"
    )
    parser.add_argument(
        "--record",
        type=Path,
        metavar="FILE",
        help="X.mcap: all of the run; else its trace alone, by default in out/",
    )
    parser.add_argument("--explain", action="store_true", help="what was built and computed")
    parser.add_argument("--no-skip", action="store_true", help="compute every signal, always")
    parser.add_argument("--frozen-base", action="store_true", help="the base stands, to try tests")
    parser.add_argument("--json", action="store_true", help="for programs")


def run(args: argparse.Namespace) -> int:
    """Simulate, record, report."""
    from cobodeck.stage import LONGEST_S, Options

    options = Options(
        user=args.user,
        requests=args.requests,
        stretch_m=args.stretch,
        tier=args.tier,
        seed=args.seed,
        duration_s=args.duration or max(LONGEST_S, 180.0 * (args.requests or 0)),
        eager=args.no_skip,
        frozen_base=args.frozen_base,
    )
    return report_on(args, options)


def report_on(
    args: argparse.Namespace,
    options: Options,
    clock: Clock | None = None,
    blocked_s: float = BLOCKED_S,
) -> int:
    """Run, write the trace file, print the figures."""
    from cobodeck.warmup import keep_compiled_code

    problem = keep_compiled_code()
    if problem:
        complain(problem)
    from cobodeck.explain import explain

    result, setup = _run(args, options, clock, blocked_s)
    wanted: Path | None = getattr(args, "record", None)
    path = _write_trace(setup, options, result, wanted)
    figures = {**result.figures, "trace_file": path and str(path)}
    figures["record_file"] = result.record_file and str(result.record_file)
    if args.json:
        show_json(figures)
    else:
        show(summary(figures, result.wired.run.ended_by))
    if getattr(args, "explain", False):
        (complain if args.json else show)(explain(setup, result))
    not_recorded = wanted is not None and wanted not in (path, result.record_file)
    failed = figures["outcome"] in FAILURES or figures["errors"]
    return FAILED if not_recorded or failed else OK


def _write_trace(
    setup: Setup, options: Options, result: Result, wanted: Path | None
) -> Path | None:
    """Write the trace file; where it is, None if it cannot be written."""
    from cobodeck.record import trace_file
    from cobodeck.record.sink import is_record, numbered
    from cobodeck.record.start import FOLDER, default_name

    path = wanted
    if path is None or is_record(path):
        named = FOLDER / (default_name(setup, options, datetime.now()) + trace_file.ENDING)
        path = next(free for free in numbered(named) if not free.exists())
    try:
        trace_file.write(path, setup, result)
    except OSError as error:
        complain(f"no trace file: {path}: {error.strerror}")
        return None
    return path


def _recorder(
    args: argparse.Namespace, setup: Setup, options: Options, clock: Clock | None
) -> Recorder | None:
    """A run is always written down, a simulation if it is asked for."""
    from cobodeck.record.sink import is_record
    from cobodeck.record.start import recorder

    wanted: Path | None = args.record
    if wanted is not None and not is_record(wanted):
        return None
    if wanted is None and clock is None:
        return None
    return recorder(setup, options, wanted, datetime.now(), complain)


def _run(
    args: argparse.Namespace, options: Options, clock: Clock | None, blocked_s: float
) -> tuple[Result, Setup]:
    from cobodeck.simulate import simulate
    from cobodeck.wiring import open_setup

    body = getattr(args, "robot", None)
    if clock is not None:  # of `run`: what is named there is no body
        body = None if options.connection is None else options.connection.model
    setup = open_setup(args.chart, args.scene, args.profile, args.tick_hz, body)
    recorder = _recorder(args, setup, options, clock)
    progress = Progress("simulate")
    aside = redirect_stdout(sys.stderr) if args.json else nullcontext()  # what states print
    try:
        with aside:
            result = simulate(
                setup,
                options,
                progress.at,
                clock,
                partial(_looked_after, blocked_s),
                _show_error,
                recorder,
            )
    finally:
        progress.done()
    return result, setup


@contextmanager
def _looked_after(blocked_s: float, loop: Loop) -> Iterator[None]:
    """Signals end the run in order, and a tick that blocks is named."""
    from cobodeck.watchdog import ending_on_signals, naming_what_blocks

    with ending_on_signals(loop), naming_what_blocks(loop, blocked_s, complain):
        yield


def _show_error(error: Raised) -> None:
    complain(f"at {error.time / 1e9:.2f} s, {error.path or 'a part'}: {error}")


def summary(figures: Mapping[str, Any], ended_by: tuple[str, str] | None = None) -> str:
    """The figures for people; `ended_by` is the node that led to the outcome, and how it ended."""
    f = figures
    where = f["chart"]
    if f["tier"]:
        where += f" in {f['scene']}" if f["scene"] else f" on {f['robot']}"
    if "requests" in f and f["tier"]:
        where += f" with {f['user']}"
    governor = "governor on" if f.get("governor") else "governor off"
    title = f"{where}: {f['profile']} ({governor}), tier {f['tier']}, {f['tick_hz']} Hz"
    if f["measured"]:
        title += "; measured, not true"
    speed = f"{f['realtime_factor']:.0f} times real time" if f["realtime_factor"] else "-"
    rows = [
        ("simulated", f"{f['sim_s']:.1f} s in {f['wall_s']:.2f} s, {speed}"),
        *(_person_rows(f) if f["tier"] and "requests" in f else ()),
        *(_robot_rows(f) if f["tier"] else ()),
        ("transitions", f"{f['transitions']} in {f['ticks']} ticks{_ticks(f)}"),
        ("errors", _errors(f["errors"])),
        *((("not let in", _faults(f["refused_samples"])),) if f["refused_samples"] else ()),
        ("outcome", _outcome(f["outcome"], ended_by)),
        ("trace", f"{f['trace_sha256'][:16]} in {f['trace_file'] or '-'}"),
        *((("record", f["record_file"]),) if f["record_file"] else ()),
    ]
    return f"{title}\n\n{table(rows)}"


def _person_rows(f: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [
        ("requests served", _served(f)),
        ("response", _spread(f["response_s"], "s")),
        ("beside the user", _share(f)),
        ("escapes", f"{f['escapes']}, of which {f['escape_failures']} failed"),
        ("time of an escape", _spread(f["escape_time_s"], "s")),
        ("escape situations", _known(f["situations"])),
        ("time to safety", _spread(f["time_to_safety_s"], "s")),
        ("contacts", _contacts(f)),
        *(("", _contact(contact)) for contact in _worst(f["contact_list"] or ())),
        ("tracking lost", _dropouts(f["dropouts"])),
    ]


def _robot_rows(f: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [("faults", _faults(f["fault_names"]))]
    if f["distance_m"] is not None:
        energy = "" if f["energy_j"] is None else f", {f['energy_j'] / 1000:.1f} kJ"
        rows.insert(0, ("travelled", f"{f['distance_m']:.1f} m{energy}"))
    if not f.get("person_watched", True):
        rows.append(("person", "not watched: nothing keeps the base away from people"))
    return rows


def _ticks(f: Mapping[str, Any]) -> str:
    """Of the ticks: those left out, those missed, those that took too long."""
    counted = ((f["left_out"], "left out"), (f["missed"], "missed"), (f["overruns"], "overruns"))
    return "".join(f", {count} {what}" for count, what in counted if count)


def _errors(errors: Sequence[Mapping[str, Any]]) -> str:
    if not errors:
        return "none"
    more = f" (the first of {len(errors)})" if len(errors) > 1 else ""
    first = errors[0]
    return f"{first['error']} in {first['node'] or 'a part'} at {first['at_s']:.2f} s{more}"


def _outcome(outcome: str | None, ended_by: tuple[str, str] | None) -> str:
    if outcome is None:
        return "still running"
    if ended_by is None or not ended_by[0]:
        return outcome
    return f"{outcome}: {ended_by[0]} ended with {ended_by[1]}"


def _known(count: int | None) -> str:
    return "-" if count is None else str(count)


def _served(f: Mapping[str, Any]) -> str:
    if f["requests"] is None:
        return "-"
    refused = (f"; {count} refused: {reason}" for reason, count in f["refusals"].items())
    return f"{_known(f['served'])} of {f['requests']}{''.join(refused)}"


def _spread(values: Mapping[str, float | None], unit: str) -> str:
    if values["mean"] is None:
        return "-"
    return f"{values['mean']:.2f} {unit} ({values['min']:.2f} to {values['max']:.2f})"


def _share(f: Mapping[str, Any]) -> str:
    if f["beside_share"] is None:
        return "-"
    walked = f"1.5 to 4 m away for {f['beside_share']:.0%} of {f['walking_s']:.0f} s of walking"
    return f"{walked}, 3 to 4 m for {f['beside_share_3_4']:.0%}"


def _contacts(f: Mapping[str, Any]) -> str:
    gap = "" if f["min_gap_m"] is None else f"least gap {f['min_gap_m']:.2f} m"
    if f["contacts"] is None:
        return f"not known; {gap}" if gap else "not known"
    caused = f", of which {f['contacts_by_robot']} by the robot" if f["contacts"] else ""
    slow = f["contacts_slow_arm"]
    slowly = f" and {slow} by its arm, slowly" if slow else ""
    return f"{f['contacts']}{caused}{slowly}, {gap}"


def _worst(contacts: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """A few to be shown: those by the robot first."""
    causes = ("robot", "slow_arm", "person")
    return sorted(contacts, key=lambda contact: causes.index(contact["by"]))[:SHOWN]


def _contact(c: Mapping[str, Any]) -> str:
    granted = ", in a touch asked for" if c["granted"] else ""
    speeds = f"robot {c['robot_closing_m_s']:.2f} m/s, person {c['person_closing_m_s']:.2f} m/s"
    return f"{c['at_s']:.1f} s {c['part']} at ({c['x']:.1f}, {c['y']:.1f}), {speeds}{granted}"


def _dropouts(found: list[dict[str, float]] | None) -> str:
    if not found:
        return "-" if found is None else "never"
    shown = ", ".join(f"{d['from_s']:.1f} to {d['to_s']:.1f} s" for d in found[:SHOWN])
    more = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
    return f"{len(found)} times: {shown}{more}"


def _faults(names: Mapping[str, int]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in names.items()) or "none"
