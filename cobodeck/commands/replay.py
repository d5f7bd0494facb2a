"""Replay a recorded run with the present code.

Samples, ticks, commands and the answers of parts are taken from the record, and so are charts,
profile, room and robot. The trace, the times of the ticks and the calls of parts must come out
equal; if not, the first difference is reported.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.terminal import (
    FAILED,
    OK,
    Problem,
    ProgressLine,
    complain,
    json_options,
    new_record,
    shadow,
    show,
    show_json,
    table,
)

if TYPE_CHECKING:
    from cobodeck.loop import Loop, ValueTap
    from cobodeck.record.read import Record, Replay, ReplayMismatch
    from cobodeck.record.write import Recorder
    from cobodeck.run import Shadow
    from cobodeck.setup import Setup


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("file", type=Path, metavar="RECORD", help="X.mcap or X.mcap.part")
    parser.add_argument(
        "--check", action="store_true", help="exit code 1 if anything differs, or is damaged"
    )
    parser.add_argument(
        "--record", type=new_record, metavar="X.mcap", help="record the replay as well"
    )
    shadow(parser)
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Replay."""
    from cobodeck.project import catalogue
    from cobodeck.record.read import Record, setup_of, stage_replay
    from cobodeck.record.write import replay_recorder
    from cobodeck.run import one_in_the_other
    from cobodeck.setup import warm_up

    record = Record(args.file)
    if args.check:
        record.require_intact()
    setup = setup_of(record, catalogue(own=args.own))
    shadow = _shadow_of(args, record, setup)
    if record.header["options"]["tier"]:
        warm_up(setup, setup.machine())
    recorder = None
    if args.record is not None:
        recorder = replay_recorder(record, setup, args.record, datetime.now(), complain)
    taps: list[ValueTap] = [one.tap for one in (shadow, recorder) if one is not None]
    replay = stage_replay(record, setup, one_in_the_other(taps))
    if shadow is not None:
        shadow.attend(replay.loop, setup.localizing, eager=record.header["options"]["eager"])
        if recorder is not None:
            shadow.note = recorder.shadow
    figures, file = _run_to_end(replay, record, recorder)
    if shadow is not None:
        figures = {**figures, "shadow": shadow.figures()}
    found = _found(replay, record, figures, file)
    if args.json:
        show_json(found)
    else:
        show(_summary(replay, record, found))
    failed = (args.check and not found["equal"]) or (args.record is not None and file is None)
    return FAILED if failed else OK


def _shadow_of(args: argparse.Namespace, record: Record, setup: Setup) -> Shadow | None:
    """The chart that decides beside what was recorded; None without one.

    Raises:
        Problem: there are no signals to be seen.
    """
    if args.shadow is None:
        return None
    if not record.header["options"]["tier"]:
        raise Problem(f"--shadow: {record.path} is of --tier 0, and has no signals to be seen")
    from cobodeck.record.read import texts_of
    from cobodeck.run import Shadow
    from engine.files import instead

    with instead(texts_of(record)):
        return Shadow(setup.beside(args.shadow), complain)


def _run_to_end(
    replay: Replay, record: Record, recorder: Recorder | None
) -> tuple[Mapping[str, Any], Path | None]:
    """Run to the end; returns the figures and the file in which the replay was kept."""
    from cobodeck.run import Spent, figures_of
    from engine import NEVER_NS

    loop = replay.loop
    if recorder is not None:
        recorder.attend(loop)
    progress, begin = ProgressLine("replay"), Spent.now()
    try:
        end_ns = loop.go(NEVER_NS, _with_share(loop, record, progress))
    finally:
        progress.done()
    figures = figures_of(replay.setup, _options(record), loop, end_ns / 1e9, begin.since())
    guard = record.header["guard"]
    if guard is not None:
        figures["governor"] = guard["governor"] and guard["watched"]
        figures["person_watched"] = guard["watched"]
    return figures, None if recorder is None else recorder.finish(figures)


def _with_share(loop: Loop, record: Record, progress: ProgressLine) -> Callable[[str], None]:
    """A progress callback that adds the share done, if the record holds the run's length."""
    length_s = (record.figures() or {}).get("sim_s")

    def report(text: str) -> None:
        progress.at(text, loop.now_ns / 1e9 / length_s if length_s else None)

    return report


def _options(record: Record) -> Any:
    from cobodeck.setup import Options

    return Options(**record.header["options"])


def _found(
    replay: Replay, record: Record, figures: Mapping[str, Any], file: Path | None
) -> dict[str, Any]:
    from cobodeck.record.format import changes

    difference, checker = replay.difference, replay.checker
    return {
        "record": str(record.path),
        "since": changes(record.header, replay.setup),
        "broken": record.broken if difference is None else None,  # else it was not read to its end
        "ticks": checker.ticks,
        "calls": checker.calls,
        "records": checker.records,
        "equal": difference is None,
        "difference": None
        if difference is None
        else {"at_s": difference.at_ns / 1e9, **difference._asdict()},
        "trace_sha256": figures["trace_sha256"],
        "figures": figures,
        "record_file": file and str(file),
    }


def _summary(replay: Replay, record: Record, found: Mapping[str, Any]) -> str:
    from cobodeck.run import shadow_rows

    h, figures = record.header, found["figures"]
    where = f"in {h['scene']['name']}" if h["scene"] else f"on {h['robot']}"
    counts = f"{found['ticks']} ticks, {found['calls']} calls of parts"
    rows = [
        ("of", f"{h['plant']}: {h['chart']} {where}, {figures['sim_s']:.1f} s, {h['began']}"),
        *(("since then", change) for change in found["since"]),
        *((("the record", found["broken"]),) if found["broken"] else ()),
        ("replayed", f"{counts}, {found['records']} records of the trace"),
        *_result(replay.difference),
        ("trace", found["trace_sha256"][:16]),
        *shadow_rows(figures),
        *((("record", found["record_file"]),) if found["record_file"] else ()),
    ]
    return f"{record.path}\n\n{table(rows)}"


def _result(difference: ReplayMismatch | None) -> list[tuple[str, str]]:
    if difference is None:
        return [("result", "equal")]
    d = difference
    differs = ("differs", f"at {d.at_ns / 1e9:.3f} s, {d.what}")
    return [differs, ("  recorded", d.recorded), ("  replayed", d.replayed)]
