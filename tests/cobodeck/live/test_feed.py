"""A reader that stalls costs the run nothing, and is right again once it reads."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from threading import Thread

from cobodeck.live.clients import PageMessage
from cobodeck.live.feed import Feed, Whole, frames
from cobodeck.live.model import RunModel
from cobodeck.live.sources.seen_lanes import SeenLanes
from cobodeck.live.sources.seen_run import SeenRun, Texts
from cobodeck.pictures.run.watch import used_charts
from cobodeck.record.read.reader import Group
from cobodeck.setup.options import Options
from engine.operator import Operator
from tests.cobodeck.live.folding import Folding, recorded, require_same, study, study_with
from tests.waiting import until

BOUND = 20_000
CHART = """
chart: called
outcomes: [done]
data: {shown: {type: UserPose, initial: none}}
states:
  look: {watch: Wait, with: {time: 0.5 s}, next: {over: inform}}
  inform: {use: inform, out: {user: shown}, next: {restarted: .done}}
"""


class Reader:
    """Reads a feed to its end, once it has begun, and folds it."""

    def __init__(self, end: socket.socket) -> None:
        self._end = end
        self.model = RunModel()
        self.seen: SeenRun | None = None
        self.kinds: list[str] = []
        self.told: list[tuple[str, object]] = []
        self._thread = Thread(target=lambda: asyncio.run(self._read()), daemon=True)

    def begin(self) -> None:
        self._thread.start()

    async def _read(self) -> None:
        stream, writer = await asyncio.open_unix_connection(sock=self._end)
        async for kind, content in frames(stream):
            self.kinds.append(kind)
            if isinstance(content, Group):
                self.model.add(content)
                if self.seen is not None:
                    self.seen.add(content)
            elif isinstance(content, Whole):
                self.model.renew(content)
                if self.seen is not None:
                    self.seen.renew(content)
            else:
                self.told.append((kind, content))
        writer.close()


def open_lanes(told: Iterator[PageMessage]) -> dict[str, float]:
    """The lanes of charts that run, and since when, s."""
    lanes = next(told)["lanes"]
    spans = ((lane["path"], span) for lane in lanes for span in lane["spans"])
    return {path: start for path, (start, end, _) in spans if end is None}


def test_a_stalled_reader_costs_ticks_of_its_own_and_is_right_again() -> None:
    ours, theirs = socket.socketpair()
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    each = count(0.0, 1.0).__next__  # so that no two ticks are sent together
    feed, folding, setup = Feed(ours, BOUND, each), Folding(), study_with(CHART)
    loop, _ = recorded(setup, Options(seed=3), folding, feed)
    feed.attend(loop)
    reader, largest = Reader(theirs), 0
    while feed.dropped < 100:
        loop.tick()
        largest = max(largest, feed.waiting)
    assert largest < BOUND + 100_000
    assert reader.kinds == []
    for speed in (2.0, 3.0):
        feed.tell("status", {"speed": speed})
    for number in range(3):
        feed.tell("ack", {"id": number})
    machine = loop.wired.run.machine
    assert not Operator(loop.wired.run).replace(machine.changed(machine.chart, machine.library))
    loop.plant.parts["stop_line"].pull("somebody")
    loop.tick()
    texts = Texts(Path("run"), folding.header, folding.attachments)
    reader.seen = SeenRun(texts, setup.catalogue)

    reader.begin()
    until(lambda: loop.tick() is None and "whole" in reader.kinds)
    for _ in range(5):
        loop.tick()
    feed.flush()
    until(lambda: reader.model.at_ns == loop.now_ns)

    require_same(reader.model, loop)
    assert reader.model.active == folding.model.active
    assert reader.model.newest.keys() == folding.model.newest.keys()
    lanes = SeenLanes(used_charts(machine.chart, machine.library))
    for group in folding.groups:
        lanes.add(group)
    assert open_lanes(reader.seen.over_time()) == open_lanes(lanes.all())
    assert reader.seen.version() == 1
    assert reader.model.stop
    _, *beside = reader.told
    assert beside == [("status", {"speed": 3.0}), *(("ack", {"id": n}) for n in range(3))]
    loop.wired.run.close()
    feed.close()


def test_ticks_at_once_are_sent_together_and_before_what_follows() -> None:
    ours, theirs = socket.socketpair()
    now = 0.0
    feed, folding, reader = Feed(ours, now=lambda: now), Folding(), Reader(theirs)
    loop, _ = recorded(study(), Options(tier=0), folding, feed)
    loop.tick()
    given = feed._given
    for _ in range(3):
        loop.tick()
    assert feed._given == given
    now = 1.0
    loop.tick()
    assert feed._given > given
    loop.tick()
    feed.tell("say", "here")
    reader.begin()

    until(lambda: "say" in reader.kinds)

    assert reader.kinds == ["begin", *["tick"] * 6, "say"]
    assert reader.model.state() == folding.model.state()
    loop.wired.run.close()
    feed.close()


def test_a_feed_that_is_given_up_waits_for_nobody() -> None:
    """It happens within a tick, and its reader may be stalled."""
    ours, theirs = socket.socketpair()
    feed = Feed(ours)
    feed.begin({"filling": "x" * (4 << 20)}, {})
    assert "the run goes on" in (feed.give_up(OSError("full")) or "")
    given = feed._given
    feed.tell("say", "unheard")
    assert feed._given == given
    assert feed._thread.is_alive()  # it still writes to the stalled reader
    theirs.close()
    feed.close()


def test_a_reader_that_is_gone_ends_the_feed_and_not_the_run() -> None:
    ours, theirs = socket.socketpair()
    feed, folding, told = Feed(ours), Folding(), list[str]()
    loop, recorder = recorded(study(), Options(tier=0), folding, feed)
    recorder._tell = told.append
    loop.tick()
    theirs.close()

    until(lambda: loop.tick() is None and feed.error is not None)
    for _ in range(5):
        loop.tick()

    assert [line.partition(":")[0] for line in told] == ["no live page any more, the run goes on"]
    assert folding.model.at_ns == loop.now_ns
    loop.wired.run.close()
    feed.close()


def test_a_broken_file_leaves_the_other() -> None:
    class Broken(Folding):
        def end_tick(self, now_ns: int) -> None:
            raise OSError("full")

        def give_up(self, error: Exception | None = None) -> str | None:
            return None if error is None else f"no record: {error}"

    broken, folding, told = Broken(), Folding(), list[str]()
    loop, recorder = recorded(study(), Options(tier=0), broken, folding)
    recorder._tell = told.append

    for _ in range(5):
        loop.tick()

    assert told == ["no record: full"]
    assert folding.model.at_ns == loop.now_ns
    assert recorder.finish({}) is None
    loop.wired.run.close()
