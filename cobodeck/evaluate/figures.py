"""Figures of a run: statistics, contacts, and figures from the trace alone.

Figures of events that did not occur are `None`, never 0.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from cobodeck.evaluate.separation_figures import SeparationWatch
from cobodeck.project import nodes_of
from engine.machine import Box
from engine.run import ChartRun
from hw import BASE, Contact, Hit
from hw.safety import CycleLog

MOVING = 0.2
"""A slower user starts no Escape situation, and stands, m/s."""
SPREAD = ("mean", "sd", "min", "max")
"""The statistics of `spread`."""


OF_THE_MACHINE = ("wall_s", "realtime_factor", "cpu_us_per_tick")
"""Figures of the machine rather than of the run."""


def spread(values: Iterable[float], names: tuple[str, ...]) -> dict[str, float | None]:
    """Mean, sample standard deviation, minimum and maximum; `None` where undefined."""
    found = list(values)
    if not found:
        return dict.fromkeys(names)
    figures: dict[str, float | None] = {
        "mean": statistics.fmean(found),
        "sd": statistics.stdev(found) if len(found) > 1 else None,
        "min": min(found),
        "max": max(found),
    }
    return {name: figures[name] for name in names}


def contact_figures(contacts: Sequence[Contact] | None) -> dict[str, Any]:
    """The numbers of contacts, in all and by cause, and a list; None where they are not known.

    `arm_closing_m_s` is the highest speed at which a part of the arm closed in on a person whom it
    touched, but for the prop in a touch that they had requested; at least 0, None without.
    Which were avoidable is found from the record of the run, on demand.
    """
    causes = None if contacts is None else [contact.by for contact in contacts]
    of_arm = [contact.robot_closing for contact in contacts or () if contact.part != BASE]
    return {
        "contacts": None if causes is None else len(causes),
        "contacts_by_robot": None if causes is None else causes.count("robot"),
        "contacts_slow_arm": None if causes is None else causes.count("slow_arm"),
        "contacts_avoidable": None,
        "arm_closing_m_s": max(0.0, *of_arm) if of_arm else None,
        "contact_list": None if contacts is None else [_listed(c) for c in contacts],
    }


def _listed(contact: Contact) -> dict[str, Any]:
    return {
        "at_s": contact.at_ns / 1e9,
        "x": contact.x,
        "y": contact.y,
        "part": contact.part,
        "by": contact.by,
        "robot_closing_m_s": contact.robot_closing,
        "person_closing_m_s": contact.person_closing,
        "granted": contact.granted,
        "who": contact.who,
    }


def hit_figures(hits: Sequence[Hit] | None) -> list[dict[str, Any]] | None:
    """Walls and things that held the robot, when and where; None where they are not known."""
    if hits is None:
        return None
    return [
        {
            "at_s": hit.at_ns / 1e9,
            "until_s": hit.until_ns / 1e9,
            "what": hit.what,
            "x": hit.x,
            "y": hit.y,
            "count": hit.count,
        }
        for hit in hits
    ]


class Visit(NamedTuple):
    """One execution of a used chart: entry and end, ns since the start, and its outcome.

    End and outcome are None if it has not ended or was aborted.
    """

    entered_ns: int
    ended_ns: int | None = None
    outcome: str | None = None


def boxes_of(run: ChartRun, behaviour: str) -> frozenset[str]:
    """Paths of the nodes that use a chart of this behaviour, whichever variant it is."""
    boxes = (vertex for vertex in run.machine.vertices.values() if isinstance(vertex, Box))
    return nodes_of(behaviour, {box.path: box.chart for box in boxes if box.chart is not None})


def visits(run: ChartRun, behaviour: str) -> list[Visit]:
    """The executions of the charts of a behaviour, in order of entry."""
    paths = boxes_of(run, behaviour)
    found: list[Visit] = []
    newest: dict[str, int] = {}
    for record in run.trace:
        if record.subject not in paths:
            continue
        if record.kind == "enter":
            newest[record.subject] = len(found)
            found.append(Visit(record.time))
        elif record.kind == "outcome" and record.subject in newest:
            n = newest[record.subject]
            found[n] = Visit(found[n].entered_ns, record.time, record.detail[0])
    return found


def escape_figures(run: ChartRun) -> dict[str, Any]:
    """Numbers of Escapes, failed ones, Informs and loops; s that those took that ended `safe`.

    In the list the time and outcome of an Escape are None if it has not ended, or was left.
    """
    escapes = visits(run, "escape")
    times = (
        (escape.ended_ns - escape.entered_ns) / 1e9
        for escape in escapes
        if escape.outcome == "safe" and escape.ended_ns is not None
    )
    failed = [escape.ended_ns or 0 for escape in escapes if escape.outcome == "failed"]
    rounds = zip(failed, failed[LOOPS:], strict=False)
    return {
        "escapes": len(escapes),
        "escape_failures": len(failed),
        "escape_time_s": spread(times, ("mean", "min", "max")),
        "informs": len(visits(run, "inform")),
        "loops": sum(later - sooner <= LOOP_NS for sooner, later in rounds),
        "escape_list": [_visited(escape) for escape in escapes],
    }


def shown_figures(run: ChartRun, shown: Sequence[tuple[int, int]] | None) -> dict[str, Any]:
    """For how long the robot was shown to the person, s, and how much of it outside Inform (R18).

    `shown` are the spans, ns, in order; None if they are not known.
    """
    if shown is None:
        return dict.fromkeys(("shown_s", "shown_outside_inform_s"))
    whole = inside = 0
    informs = [(one.entered_ns, one.ended_ns) for one in visits(run, "inform")]
    for start, end in shown:
        whole += end - start
        for entered, ended in informs:
            inside += max(0, (end if ended is None else min(end, ended)) - max(start, entered))
    return {"shown_s": whole / 1e9, "shown_outside_inform_s": (whole - inside) / 1e9}


def _visited(escape: Visit) -> dict[str, Any]:
    ended = escape.ended_ns
    time_s = None if ended is None else (ended - escape.entered_ns) / 1e9
    return {"at_s": escape.entered_ns / 1e9, "time_s": time_s, "outcome": escape.outcome}


LOOPS, LOOP_NS = 2, 10_000_000_000
"""More failed Escapes, each with its Inform, than LOOPS within LOOP_NS are a loop (R117)."""
NOTHING: Mapping[str, Any] = {
    "measured": None,
    "governor": False,
    "person_watched": False,
    "requests": None,
    "served": None,
    "refused": None,
    "refusals": {},
    "refused_requests": [],
    "response_s": dict.fromkeys(SPREAD),
    "arm_s": dict.fromkeys(SPREAD),
    "request_list": None,
    "close_drives": dict.fromkeys(("number", "mean_s", "below_0_4_m_s")),
    "prop_error_m": dict.fromkeys(("mean", "max")),
    "prop_error_rad": dict.fromkeys(("mean", "max")),
    "distance_m": None,
    "energy_j": None,
    "signs": None,
    "signs_to_standing": None,
    "shown_s": None,
    "shown_outside_inform_s": None,
    "situations": None,
    "situations_open": None,
    "time_to_safety_s": dict.fromkeys(("mean", "min", "max")),
    **contact_figures(None),
    "wall_hits": None,
    "object_hits": None,
    "hits": None,
    "stuck": None,
    "min_gap_m": None,
    "least_gap_walking_m": None,
    "walking_s": None,
    "beside_share": None,
    "beside_share_3_4": None,
    "dropouts": [],
    "faults": None,
    "fault_names": {},
    "separation": SeparationWatch(CycleLog(1)).report(),
    "localization": None,
    "motion_sha256": None,
}
"""The figures of a run without a robot."""
