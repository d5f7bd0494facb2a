"""A log with one writer and several readers."""

import threading

from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Twist2
from hw.safety.cycle_log import CycleLog
from hw.safety.cycle_record import GRANTED, SEPARATION, SPEED, SafetyRecord


class Log(CycleLog):
    """Of cycles that differ by their stamps only."""

    def append(self, stamp):
        super().append(SafetyRecord(stamp, STILL, STILL))


class Reader:
    def __init__(self, log):
        self.reader = log.reader()

    @property
    def missed(self):
        return self.reader.missed

    def read_new(self):
        return [record.stamp_ns for record in self.reader.read_new()]


def test_a_record_is_read_as_it_was_written():
    log, command = CycleLog(3), Twist2(1.0, -0.5, 0.25)
    reader = log.reader()
    whole = SafetyRecord(5, command, command)
    less = SafetyRecord(
        10**18 + 1, command, Twist2(0.5), 0.75, 0.5, 1.5, 1.25, 0.125, (GRANTED, SPEED, SEPARATION)
    )
    for record in (whole, less):
        log.append(record)

    assert reader.read_new() == [whole, less]
    log.append(less._replace(reasons=("moon", SPEED)))
    log.append(whole)
    known, again = reader.read_new()
    assert known.reasons == (SPEED,)
    assert again.admitted is again.command


def test_every_reader_gets_every_entry_once_and_in_order():
    log = Log(8)
    first, second = Reader(log), Reader(log)
    log.append(1)
    assert first.read_new() == [1]
    log.append(2)
    assert first.read_new() == [2]
    assert second.read_new() == [1, 2]
    assert (first.read_new(), second.read_new()) == ([], [])
    assert (first.missed, second.missed) == (0, 0)


def test_a_reader_who_comes_later_finds_what_the_log_still_holds():
    log = Log(3)
    for n in range(5):
        log.append(n)
    late = Reader(log)
    assert late.read_new() == [2, 3, 4]
    assert late.missed == 0


@settings(deadline=None)
@given(st.lists(st.integers(0, 9), max_size=20), st.integers(1, 6))
def test_what_a_slow_reader_missed_is_counted_and_the_rest_is_the_newest(bursts, size):
    log, written, taken = Log(size), 0, 0
    reader = Reader(log)
    for burst in bursts:
        for _ in range(burst):
            log.append(written)
            written += 1
        found = reader.read_new()
        assert found == list(range(written - min(burst, size), written))
        taken += len(found)
        assert taken + reader.missed == written


def test_readers_in_other_threads_lose_nothing_uncounted_while_the_log_grows():
    log, entries = Log(64), 20_000
    readers = [Reader(log) for _ in range(3)]
    found = [[] for _ in readers]
    done = threading.Event()

    def follow(n):
        while not done.is_set():
            found[n] += readers[n].read_new()
        found[n] += readers[n].read_new()

    threads = [threading.Thread(target=follow, args=(n,)) for n in range(len(readers))]
    for thread in threads:
        thread.start()
    for n in range(entries):
        log.append(n)
    done.set()
    for thread in threads:
        thread.join()
    for reader, got in zip(readers, found, strict=True):
        assert got == sorted(set(got))
        assert len(got) + reader.missed == entries
        assert got[-1] == entries - 1
