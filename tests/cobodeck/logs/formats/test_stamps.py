"""Stamps of clocks that jump, wrap, repeat or are unset, against the times that they stand for."""

from hypothesis import given, strategies as st

from cobodeck.logs.formats.stamps import LONGEST_PAUSE_NS, Stamp, straightened

PERIOD = 100_000_000
"""Interval of the scans, ns; the wheels tell twice as often."""


def drive(scans=60):
    """True times of scans, each between two wheel messages, as (stream, ns)."""
    told = []
    for n in range(scans):
        told += [("wheels", n * PERIOD), ("wheels", n * PERIOD + 50_000_000)]
        told.append(("scan", n * PERIOD + 60_000_000))
    return told


def read(told):
    remarks = []
    stamps = straightened([Stamp(name, at, name == "scan") for name, at in told], remarks.append)
    return stamps, remarks


def near(stamps, told, within):
    """All stamps equal the true times, from the first on, within so many ns."""
    begin = told[0][1]
    return all(
        abs(at - (true - begin)) <= within for at, (_, true) in zip(stamps, told, strict=True)
    )


def test_right_stamps_stay_as_they_are():
    told = drive()
    stamps, remarks = read([(name, at + 5_000) for name, at in told])

    assert stamps == [at for _, at in told]
    assert remarks == []


@given(
    st.lists(st.tuples(st.integers(1, 179), st.integers(-(10**10), 10**10)), min_size=1, max_size=4)
)
def test_a_clock_that_is_set_any_number_of_times_goes_on_where_it_was(sets):
    told = drive()
    jumps = {at: by * 10**9 for at, by in sets if by < -10 or by * 10**9 > 2 * LONGEST_PAUSE_NS}
    offset, seen = 0, []
    for number, (name, at) in enumerate(told):
        offset += jumps.get(number, 0)
        seen.append((name, at + offset))
    stamps, remarks = read(seen)

    late = 2 * PERIOD * len(jumps)
    single = any(0 < later - at <= 6 for at in jumps for later in jumps)
    if not single:  # else a stamp between two jumps is one that is wrong alone
        assert near(stamps, told, late)
        assert sum(remark.startswith("the clock jumps") for remark in remarks) == (len(jumps) > 0)


def test_a_counter_that_wraps_goes_on():
    told = drive()
    wrapped = [(name, (at + 2**32 * 1000 - 3 * 10**9) % (2**32 * 1000)) for name, at in told]
    stamps, [remark] = read(wrapped)

    assert near(stamps, told, PERIOD)
    assert "by -4294" in remark


def test_one_stamp_far_off_is_left_out_alone():
    for off in (10**18, -(10**12), 3 * 10**9):
        told = drive()
        told[50] = (told[50][0], told[50][1] + off)
        stamps, [remark] = read(told)

        assert stamps[50] is None
        assert stamps[:50] + stamps[51:] == [at for _, at in drive()[:50] + drive()[51:]]
        assert remark.startswith("1 messages were left out")


def test_stamps_that_are_all_alike_are_numbered_by_the_scans():
    for at in (0, None, 10**18):
        told = drive()
        stamps, [remark] = read([(name, at) for name, _ in told])

        assert near(stamps, told, PERIOD)
        assert stamps == sorted(stamps)
        assert len(set(stamps)) == len(told)
        assert "180 messages were numbered" in remark


def test_a_clock_of_whole_seconds_is_read_finer():
    told = drive()
    stamps, [remark] = read([(name, at // 10**9 * 10**9) for name, at in told])

    assert near(stamps, told, PERIOD)
    assert "repeat" in remark


def test_stamps_of_nought_before_the_clock_is_set():
    told = drive()
    seen = [(name, 0 if n < 60 else at + 10**18) for n, (name, at) in enumerate(told)]
    stamps, remarks = read(seen)

    assert near(stamps, told, 2 * PERIOD)
    assert any("the clock jumps" in remark for remark in remarks)
    assert any("numbered" in remark for remark in remarks)


def test_streams_by_another_clock_are_shifted():
    told = drive()
    seen = [(name, at + (10**18 if name == "wheels" else 0)) for name, at in told]
    stamps, [remark] = read(seen)

    assert near(stamps, told, 2 * PERIOD)
    assert "another clock" in remark


def test_messages_need_not_come_in_order_of_their_stamps():
    told = sorted(drive())  # all scans first
    assert read(told) == ([at for _, at in told], [])


def test_a_pause_stays_and_is_told():
    told = [(name, at + (80 * 10**9 if n > 90 else 0)) for n, (name, at) in enumerate(drive())]
    stamps, [remark] = read(told)

    assert stamps == [at for _, at in told]
    assert "nothing for 80" in remark
