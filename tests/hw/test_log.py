"""A log with one writer and several readers."""

import threading

from hypothesis import given, strategies as st

from hw.log import Log


def test_every_reader_gets_every_entry_once_and_in_order():
    log = Log(8)
    first, second = log.reader(), log.reader()
    log.append("a")
    assert first.read_new() == ["a"]
    log.append("b")
    assert first.read_new() == ["b"]
    assert second.read_new() == ["a", "b"]
    assert (first.read_new(), second.read_new()) == ([], [])
    assert (first.missed, second.missed) == (0, 0)


def test_an_overwritten_or_unwritten_entry_is_none_instead_of_another_entry():
    log = Log(2)
    for n in range(3):
        log.append(n)
    assert [log.entry(n) for n in range(4)] == [None, (1,), (2,), None]


def test_a_reader_who_comes_later_finds_what_the_log_still_holds():
    log = Log(3)
    for n in range(5):
        log.append(n)
    late = log.reader()
    assert late.read_new() == [2, 3, 4]
    assert late.missed == 0


@given(st.lists(st.integers(0, 9), max_size=20), st.integers(1, 6))
def test_what_a_slow_reader_missed_is_counted_and_the_rest_is_the_newest(bursts, size):
    log, written, taken = Log(size), 0, 0
    reader = log.reader()
    for burst in bursts:
        for _ in range(burst):
            log.append(written)
            written += 1
        found = reader.read_new()
        assert found == list(range(written - min(burst, size), written))
        taken += len(found)
        assert taken + reader.missed == written


def test_readers_in_other_threads_lose_nothing_uncounted_while_the_log_grows():
    log, entries = Log(64), 50_000
    readers = [log.reader() for _ in range(3)]
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
