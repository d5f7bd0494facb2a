"""Puts the stamps of a log in order: unset, repeated and single wrong ones, and clocks that jump.

Messages come in their order in the file. Within a stream (a topic, a scanner) stamps should grow. A
step back starts an epoch: the clock was set back, or has wrapped. Messages are sorted by epoch and
stamp; a step between neighbours that is no pause becomes one scan period. All work is proportional
to the number of messages, never to a difference of stamps.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby, pairwise
from statistics import median
from typing import NamedTuple

PERIOD_NS = 100_000_000
"""Assumed interval between scans where stamps tell nothing, ns."""
LONGEST_PAUSE_NS = 600_000_000_000
"""Longest step of all stamps that can be a pause, ns; logs of key frames have some of 80 s. A robot
that is driven does not wait for longer: the clock was set, or the recording was stopped."""
_PAUSE_NS, _PAUSE_PERIODS = 5_000_000_000, 20
"""Steps above both, ns and periods of the scans, are told as pauses in logs of as many stamps."""
_BACK_NS = 500_000_000
"""Largest step back within a stream that is a delay and no clock set back, ns."""
_SHARED_NS = 5_000_000_000
"""Longest interval over which equal stamps are spread, ns: clocks that tell whole seconds."""
_NAMED = 3
"""Number of jumps that a remark lists."""


class Stamp(NamedTuple):
    """The stamp of a message, ns, None if unset; `stream` tells messages of one source apart."""

    stream: str
    stamp_ns: int | None
    is_scan: bool = False


class _Group(NamedTuple):
    """Messages, by number, that have the same stamp, ns, in the same epoch."""

    epoch: int
    stamp_ns: int
    members: tuple[int, ...]


def straightened(told: Sequence[Stamp], remark: Callable[[str], None]) -> list[int | None]:
    """Stamps of a log's messages, ns, that are right within the log; None for those to leave out.

    Args:
        told: the messages in their order in the file.
        remark: takes a sentence on everything that was changed.
    """
    stamps = _filled([one.stamp_ns for one in told])
    streams: dict[str, list[int]] = defaultdict(list)
    for number, one in enumerate(told):
        streams[one.stream].append(number)
    wrong = {n for numbers in streams.values() for n in _wrong(numbers, stamps)}
    if wrong:
        first = _seconds(stamps[min(wrong)])
        remark(
            f"{len(wrong)} messages were left out: their stamps are far off; the first is {first}"
        )
    kept = {name: [n for n in numbers if n not in wrong] for name, numbers in streams.items()}
    _shift(told, kept, stamps, remark)
    epochs = _epochs(told, [n for n in range(len(told)) if n not in wrong], stamps)
    order = sorted(epochs, key=lambda n: (epochs[n], stamps[n], n))
    groups = [
        _Group(*key, tuple(members))
        for key, members in groupby(order, key=lambda n: (epochs[n], stamps[n]))
    ]
    found = _walk(told, groups, _period(told, kept, stamps), remark)
    return [found.get(number) for number in range(len(told))]


def _filled(stamps: Sequence[int | None]) -> list[int]:
    """An unset stamp is that of the message before, or of the first one that has any."""
    last = next((stamp for stamp in stamps if stamp is not None), 0)
    found = []
    for stamp in stamps:
        last = last if stamp is None else stamp
        found.append(last)
    return found


def _wrong(numbers: Sequence[int], stamps: Sequence[int]) -> Iterator[int]:
    """Messages of a stream whose stamps do not lie between their neighbours', which fit."""
    for before, at, after in zip(numbers, numbers[1:], numbers[2:], strict=False):
        low, high = stamps[before], stamps[after]
        fits = low - _BACK_NS <= stamps[at] <= high + _BACK_NS
        if 0 <= high - low <= LONGEST_PAUSE_NS and not fits:
            yield at


def _shift(
    told: Sequence[Stamp],
    streams: Mapping[str, Sequence[int]],
    stamps: list[int],
    remark: Callable[[str], None],
) -> None:
    """Shift streams by another clock onto the scans', by their order in the file.

    Stamps of another clock are all farther than a pause from those of the scans, although the
    messages come between them.
    """
    main = next((one.stream for one in told if one.is_scan), None)
    if main is None or not streams[main]:
        return
    scans = streams[main]
    low, high = (pick(stamps[n] for n in scans) for pick in (min, max))
    for name, numbers in streams.items():
        own = [stamps[n] for n in numbers]
        if not own or (min(own) <= high + LONGEST_PAUSE_NS and max(own) >= low - LONGEST_PAUSE_NS):
            continue
        within = [n for n in numbers if scans[0] < n < scans[-1]]
        if 2 * len(within) <= len(numbers):
            continue
        before = (stamps[scans[bisect_left(scans, n) - 1]] - stamps[n] for n in within)
        offset = round(median(before))
        off = f"{_seconds(-offset)} off those of {main}"
        remark(f"the stamps of {name} are {off}: it has another clock, and is shifted by that")
        for n in numbers:
            stamps[n] += offset


def _epochs(told: Sequence[Stamp], numbers: Sequence[int], stamps: Sequence[int]) -> dict[int, int]:
    """Epochs of messages, by number: how often the clock was set back before.

    A stream that steps back, or begins, is in the epoch that others are in if its stamp is near
    theirs, else in a new one.
    """
    found: dict[int, int] = {}
    spans: list[tuple[int, int]] = []
    newest: dict[str, tuple[int, int]] = {}
    for number in numbers:
        stream, stamp = told[number].stream, stamps[number]
        epoch, last = newest.get(stream, (-1, stamp))
        if epoch < 0 or stamp < last - _BACK_NS:
            epoch, last = _joined(spans, epoch + 1, stamp), stamp
        if epoch == len(spans):
            spans.append((stamp, stamp))
        low, high = spans[epoch]
        spans[epoch] = min(low, stamp), max(high, stamp)
        newest[stream] = epoch, max(last, stamp)
        found[number] = epoch
    return found


def _joined(spans: Sequence[tuple[int, int]], first: int, stamp: int) -> int:
    """The epoch, from `first` on, to which a stamp is nearest; a new one if none is near."""

    def away(epoch: int) -> tuple[int, int]:
        low, high = spans[epoch]
        return max(low - stamp, stamp - high, 0), -epoch

    nearest = min(range(first, len(spans)), key=away, default=len(spans))
    if nearest < len(spans) and away(nearest)[0] > LONGEST_PAUSE_NS and stamp < spans[-1][1]:
        return len(spans)
    return nearest


def _period(
    told: Sequence[Stamp], streams: Mapping[str, Sequence[int]], stamps: Sequence[int]
) -> int:
    """Usual interval of the scans, ns; that of all streams if there are none.

    Messages with equal stamps share the time to the next stamp.
    """
    scanning = {one.stream for one in told if one.is_scan} or set(streams)
    steps: list[float] = []
    for name in scanning:
        runs = [(at, len(list(run))) for at, run in groupby(stamps[n] for n in streams[name])]
        between = ((after[0] - at, count) for (at, count), after in pairwise(runs))
        steps += [step / count for step, count in between if 0 < step <= LONGEST_PAUSE_NS]
    return round(median(steps)) if steps else PERIOD_NS


def _walk(
    told: Sequence[Stamp], groups: Sequence[_Group], period: int, remark: Callable[[str], None]
) -> dict[int, int]:
    """The stamps of all messages, by number, from group to group; see the module."""
    found: dict[int, int] = {}
    steps = [*map(_step, groups, groups[1:]), *([None] if groups else [])]
    at, again = 0, 0
    for group, step in zip(groups, steps, strict=True):
        count = _repeats(told, group)
        own = period * count
        length = own if step is None else step
        share = (own if length > _SHARED_NS else length) if count > 1 else 0
        again += len(group.members) if count > 1 else 0
        for place, member in enumerate(group.members):
            found[member] = at + share * place // len(group.members)
        at += length
    if again:
        remark(f"stamps repeat or are missing: {again} messages were numbered in order")
    _tell_steps(groups, steps, period, remark)
    return found


def _step(group: _Group, following: _Group) -> int | None:
    """Time from group to group, ns; None where the clock jumps."""
    step = following.stamp_ns - group.stamp_ns
    return step if following.epoch == group.epoch and step <= LONGEST_PAUSE_NS else None


def _repeats(told: Sequence[Stamp], group: _Group) -> int:
    """How often the busiest scanner has a stamp; without scans, in a log of one stamp, any."""
    scans = Counter(told[n].stream for n in group.members if told[n].is_scan)
    if not scans and len(group.members) == len(told):
        scans = Counter(told[n].stream for n in group.members)
    return max(scans.values(), default=1)


def _tell_steps(
    groups: Sequence[_Group],
    steps: Sequence[int | None],
    period: int,
    remark: Callable[[str], None],
) -> None:
    """Tell where the clock jumps, and where there may have been a pause."""
    jumps, pauses = list[str](), list[str]()
    for (group, following), step in zip(pairwise(groups), steps, strict=False):
        size, where = following.stamp_ns - group.stamp_ns, f"at {_seconds(group.stamp_ns)}"
        if step is None:
            jumps.append(f"by {_seconds(size)} {where}")
        elif len(groups) > _PAUSE_PERIODS and size > max(_PAUSE_NS, _PAUSE_PERIODS * period):
            pauses.append(f"for {_seconds(size)} {where}")
    if jumps:
        taken = f"each taken as {_seconds(period)}, the rest is used"
        remark(f"the clock jumps {_listed(jumps)}: {taken}")
    if pauses:
        remark(f"there is nothing {_listed(pauses)}: recording paused, or the clock was set")


def _listed(places: Sequence[str]) -> str:
    more = f" and {len(places) - _NAMED} more times" if len(places) > _NAMED else ""
    return ", ".join(places[:_NAMED]) + more


def _seconds(time_ns: int) -> str:
    return f"{time_ns / 1e9:.3f}".rstrip("0").rstrip(".") + " s"
