"""The figures of a run as text for people."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from cobodeck.run.shadow import shadow_rows
from cobodeck.run.topics import COMPANY, ESCAPES, REQUESTS, TOPICS
from cobodeck.terminal import table
from engine.files import written_text

SHOWN = 3
"""Number of contacts and of drop-outs that are listed individually."""


def summary(
    figures: Mapping[str, Any],
    ended_by: tuple[str, str] | None = None,
    topics: Collection[str] = TOPICS,
) -> str:
    """The figures as text.

    Args:
        figures: of the run, by their names in JSON.
        ended_by: the node that led to the outcome, and its own outcome.
        topics: what the chart deals with; of others only what happened all the same is told.
    """
    f = figures
    where = f["chart"]
    if f["tier"]:
        where += f" in {f['scene']}" if f["scene"] else f" on {f['robot']}"
    if "requests" in f and f["tier"] and not f["measured"]:  # measured people have no name
        where += f" with {f['user']}"
    governor = "governor on" if f.get("governor") else "governor off"
    profile = ", ".join((f["profile"], *f["set"]))
    title = f"{where}: {profile} ({governor}), tier {f['tier']}, {f['tick_hz']} Hz"
    if f["measured"]:
        title += "; measured, not true"
    speed = f"{f['realtime_factor']:.0f} times real time" if f["realtime_factor"] else "-"
    rows = [
        *((("inputs", _inputs(f["inputs"])),) if f["inputs"] else ()),
        *_chart_values(f.get("chart_values", {})),
        ("simulated", f"{f['sim_s']:.1f} s in {f['wall_s']:.2f} s, {speed}{_cpu(f)}"),
        *(_person_rows(f, topics) if f["tier"] and "requests" in f else ()),
        *(_robot_rows(f) if f["tier"] else ()),
        ("transitions", f"{f['transitions']} in {f['ticks']} ticks{_ticks(f)}"),
        ("errors", _errors(f["errors"])),
        *((("refused samples", _faults(f["refused_samples"])),) if f["refused_samples"] else ()),
        ("outcome", _outcome(f, ended_by)),
        *shadow_rows(f),
        ("trace", f"{f['trace_sha256'][:16]} in {f['trace_file'] or '-'}"),
        *((("record", f["record_file"]),) if f["record_file"] else ()),
    ]
    return f"{title}\n\n{table(rows)}"


def _inputs(inputs: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}: {written_text(value)}" for name, value in inputs.items())


def _chart_values(values: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    """The parameters of charts that have other values than the charts say."""
    told = [f"{name}: {found['value']} ({found['origin']})" for name, found in values.items()]
    return [("chart values" if n == 0 else "", one) for n, one in enumerate(told)]


def _person_rows(f: Mapping[str, Any], topics: Collection[str]) -> list[tuple[str, str]]:
    rows = []
    if REQUESTS in topics or f["served"]:
        rows += [("requests served", _served(f)), *_walled(f)]
        rows.append(("response", _spread(f["response_s"], "s")))
        rows.append(("… of the arm", _spread(f["arm_s"], "s")))
        if f["close_drives"]["number"]:
            rows.append(("close drives", _close_drives(f["close_drives"])))
    if COMPANY in topics:
        rows.append(("beside the user", _share(f)))
    if ESCAPES in topics:
        rows.append(("escapes", f"{f['escapes']}, of which {f['escape_failures']} failed"))
        rows.append(("time of an escape", _spread(f["escape_time_s"], "s")))
    if ESCAPES in topics or f["situations"]:
        rows.append(("escape situations", _known(f["situations"])))
        rows.append(("time to safety", _spread(f["time_to_safety_s"], "s")))
    return [
        *rows,
        ("contacts", _contacts(f)),
        *(("", _contact(contact)) for contact in _worst(f["contact_list"] or ())),
        ("tracking lost", _dropouts(f["dropouts"])),
        *((("manner", _manner(f)),) if f["manner"] else ()),
    ]


def _manner(f: Mapping[str, Any]) -> str:
    late = "ignores the stop sign" if f["reaction_s"] is None else f"{f['reaction_s']:.2f} s late"
    return f"{f['manner']}, {late}"


def _robot_rows(f: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [("faults", _faults(f["fault_names"]))]
    rows += _blocked(f["hits"] or (), "ran into", _hit)
    rows += _blocked(f["stuck"] or (), "no way on", _stuck)
    if f["objects_seen"] is False:
        rows.append(("objects", "not seen: tier 1 has no scanners; --tier 2 has"))
    if f["distance_m"] is not None:
        energy = "" if f["energy_j"] is None else f", {f['energy_j'] / 1000:.1f} kJ"
        rows.insert(0, ("travelled", f"{f['distance_m']:.1f} m{energy}"))
    if f.get("localization") is not None:
        rows.append(("pose of the robot", _localization(f["localization"])))
    if f.get("small_floor"):
        rows.append(("floor", f["small_floor"]))
    if f.get("mount_error"):
        rows.append(("true mounts", _mounts(f["mount_error"])))
    if not f.get("person_watched", True):
        rows.append(("person", "not watched: nothing keeps the base away from people"))
    return rows


def _blocked(
    found: Sequence[Mapping[str, Any]], title: str, told: Callable[[Mapping[str, Any]], str]
) -> list[tuple[str, str]]:
    """A row for each, the ones with the most tries first."""
    most = sorted(found, key=lambda one: -one["count"])[:SHOWN]
    rows = [(title if n == 0 else "", told(one)) for n, one in enumerate(most)]
    more = len(found) - len(most)
    return [*rows, *((("", f"and {more} more"),) if more else ())]


def _hit(hit: Mapping[str, Any]) -> str:
    return f"{hit['what']} at ({hit['x']:.1f}, {hit['y']:.1f}), {_times(hit)}"


def _stuck(one: Mapping[str, Any]) -> str:
    """Where a drive came to nothing, and why its goal will not do, or else what stood there."""
    near = f"{one['near']} at ({one['near_x']:.1f}, {one['near_y']:.1f})"
    why = one["goal"] or f"{max(0.0, one['gap_m']):.2f} m from {near}"
    where = f"at ({one['x']:.1f}, {one['y']:.1f})"
    return f"{one['node'] or 'the chart'} {one['outcome']} {where}, {why}, {_times(one)}"


def _times(one: Mapping[str, Any]) -> str:
    if one["count"] == 1:
        return f"at {one['at_s']:.1f} s"
    return f"{one['count']} times from {one['at_s']:.1f} to {one['until_s']:.1f} s"


def _localization(found: Mapping[str, Any]) -> str:
    """Error of the robot's own pose estimate."""
    if found["rmse_m"] is None:
        return "never known"
    parts = [f"off by {_mm(found['rmse_m'])} rms, {_mm(found['max_m'])} at most"]
    if found["reaching_p95_m"] is not None:
        parts.append(f"{_mm(found['reaching_p95_m'])} while reaching (95 %)")
    if found["drift"] is not None:
        parts.append(str(found["drift"]))
    if found["unknown_s"]:
        parts.append(f"not known for {found['unknown_s']:.1f} s")
    return ", ".join(parts)


def _mounts(off: Mapping[str, Sequence[float]]) -> str:
    """Differences of the true mounts from those of the files."""
    told = (
        f"{name} {_mm(x)}, {_mm(y)}, {math.degrees(yaw):.2f} deg off the files"
        for name, (x, y, yaw) in off.items()
    )
    return "; ".join(told)


def _mm(length: float | None) -> str:
    return "-" if length is None else f"{length * 1e3:.1f} mm"


def _ticks(f: Mapping[str, Any]) -> str:
    """Ticks left out, missed, and longer than a period."""
    counted = ((f["left_out"], "left out"), (f["missed"], "missed"), (f["overruns"], "overruns"))
    return "".join(f", {count} {what}" for count, what in counted if count)


def _errors(errors: Sequence[Mapping[str, Any]]) -> str:
    if not errors:
        return "none"
    first = errors[0]
    where = f"in {first['node'] or 'a part'} at {first['at_s']:.2f} s"
    return f"1, {where}" if len(errors) == 1 else f"{len(errors)}, the first {where}"


ENDED = {
    "user": "none; ended as asked: the person is done",
    "time": "none; ended as asked: the time is up",
}
"""How a run ended that has no outcome, by the figure `ended`."""


def _outcome(f: Mapping[str, Any], ended_by: tuple[str, str] | None) -> str:
    outcome: str | None = f["outcome"]
    if outcome is None:
        return ENDED.get(str(f["ended"]), "still running when the run was broken off")
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


def _walled(f: Mapping[str, Any]) -> list[tuple[str, str]]:
    """DEEPs that walls kept the prop from, with their distance from the wall, and what it needs."""
    found = [one for one in f["refused_requests"] if one["wall"]]
    rows = [("", _beside_wall(one)) for one in found[:SHOWN]]
    return [*rows, *([("", f"and {len(found) - SHOWN} more")] if len(found) > SHOWN else [])]


def _beside_wall(one: Mapping[str, Any]) -> str:
    wall = one["wall"]
    text = f"DEEP at ({one['x']:.1f}, {one['y']:.1f}): {wall['gap']:.2f} m from the wall at "
    text += f"({wall['x']:.1f}, {wall['y']:.1f})"
    if wall["needed"] is None:
        return f"{text}; walls around leave the robot no room"
    if wall["needed"] <= wall["gap"]:
        return f"{text}; a wall or the user stands between"
    return f"{text}; the robot needs {wall['needed']:.2f} m there"


def _spread(values: Mapping[str, float | None], unit: str) -> str:
    if values["mean"] is None:
        return "-"
    return f"{values['mean']:.2f} {unit} ({values['min']:.2f} to {values['max']:.2f})"


def _close_drives(found: Mapping[str, Any]) -> str:
    taken, beside = found["mean_s"], found["below_0_4_m_s"]
    return f"{found['number']}, {taken:.1f} s each, {beside:.1f} s of it within 0.4 m of the user"


def _cpu(f: Mapping[str, Any]) -> str:
    found = f.get("cpu_us_per_tick")
    return "" if found is None else f", {found:.0f} µs of CPU a tick"


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
    avoidable = f.get("contacts_avoidable")
    judged = f", avoidable {avoidable}" if f["contacts"] and avoidable is not None else ""
    return f"{f['contacts']}{caused}{slowly}{judged}, {gap}"


def _worst(contacts: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The contacts that are listed: those caused by the robot first."""
    causes = ("robot", "slow_arm", "person")
    return sorted(contacts, key=lambda contact: causes.index(contact["by"]))[:SHOWN]


def _contact(c: Mapping[str, Any]) -> str:
    granted = ", in a requested touch" if c["granted"] else ""
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
