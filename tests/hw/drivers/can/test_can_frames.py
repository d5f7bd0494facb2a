"""Frames byte by byte, written down by hand from CiA 301, CiA 402 and the bumper's DBC."""

import math

import pytest
from hypothesis import given, strategies as st

from hw.drivers.can.can_bumper import ZONES, CanBumper, crc8
from hw.drivers.can.ds402 import Ds402Drive, Setting, state_of
from hw.drivers.can.sdo import ANSWER_NS, TRIES, SdoCheck, SdoWrite, Writer

SETTING = Setting(master=127, silence_ms=80, ramp=1_000_000)
WELL = "41 00 00 00 10 00 00"
MS = 1_000_000


def well(counter, head=WELL):
    data = bytearray.fromhex(head)
    data[0] = data[0] & 0xF0 | counter % 16
    return bytes(data) + bytes((crc8(data),))


class Sent(list):
    def __call__(self, identifier, data):
        self.append((identifier, bytes(data).hex(" ")))


def test_a_write_of_one_two_and_four_bytes():
    assert SdoWrite(0x6060, 0, 1, 3).frame.hex(" ") == "2f 60 60 00 03 00 00 00"
    assert SdoWrite(0x6007, 0, 2, 3).frame.hex(" ") == "2b 07 60 00 03 00 00 00"
    assert SdoWrite(0x1016, 1, 4, 0x007F0050).frame.hex(" ") == "23 16 10 01 50 00 7f 00"
    assert SdoWrite(0x60FF, 0, 4, -2).frame.hex(" ") == "23 ff 60 00 fe ff ff ff"


def test_settings_of_a_drive_map_its_process_data_and_go_with_sync():
    frames = [write.frame.hex(" ") for write in SETTING.writes(3)[1:]]
    assert frames[:2] == ["2b 17 10 00 32 00 00 00", "23 16 10 01 50 00 7f 00"]
    assert frames[2] == "2f 29 10 01 01 00 00 00"
    assert frames[3:9] == [
        "23 00 14 01 03 02 00 80",  # receive: off
        "2f 00 16 00 00 00 00 00",
        "23 00 16 01 10 00 40 60",  # control word, 16 bits
        "23 00 16 02 20 00 ff 60",  # target velocity, 32 bits
        "2f 00 16 00 02 00 00 00",
        "2f 00 14 02 01 00 00 00",  # with each SYNC
    ]
    assert frames[9] == "23 00 14 01 03 02 00 00"
    assert "23 00 1a 01 10 00 41 60" in frames
    assert "23 00 1a 02 20 00 6c 60" in frames
    assert "23 00 18 01 83 01 00 00" in frames
    assert "23 85 60 00 40 42 0f 00" in frames  # quick-stop ramp


def test_targets_and_orders_of_a_drive():
    sent = Sent()
    drive = Ds402Drive(3, "rear left", SETTING, sent)
    drive.send_command(0x0F, -256)
    drive.command(1)
    assert sent == [(0x203, "0f 00 00 ff ff ff"), (0, "01 03")]


@pytest.mark.parametrize(
    ("status", "state"),
    [
        (0x0200, "not ready"), (0x0250, "switch on disabled"), (0x0231, "ready to switch on"),
        (0x0233, "switched on"), (0x0237, "operation enabled"), (0x0217, "quick stop"),
        (0x021F, "fault reaction"), (0x0218, "fault"), (0x1637, "operation enabled"),
    ],
)  # fmt: skip
def test_states_by_their_status_words(status, state):
    assert state_of(status) == state


def test_control_words_lead_from_a_fault_to_operation_step_by_step():
    drive = Ds402Drive(1, "front left", SETTING, lambda *_: None)
    drive.configured = True
    drive.start(0)
    words = []
    for status in (0x218, 0x218, 0x218, 0x250, 0x231, 0x233, 0x237):
        drive.on_told(status.to_bytes(2, "little") + bytes(4), 0)
        words.append(drive.control())
    assert words == [0x80, 0x00, 0x80, 0x06, 0x07, 0x0F, 0x0F]
    drive.hold()
    assert drive.control() == 0x02


def test_a_heartbeat_that_stays_away_is_a_fault_after_150_ms_though_velocities_come():
    drive = Ds402Drive(1, "front left", SETTING, lambda *_: None)
    drive.configured = True
    drive.start(0)
    for now in range(0, 150 * MS + 1, 10 * MS):
        drive.on_told(bytes.fromhex("37 02 00 00 00 00"), now)
        drive.poll(now)
        assert drive.fault is None
    drive.poll(151 * MS)
    assert drive.fault == "drive 1 (front left): has no heartbeat"
    assert drive.control() == 0x02


def test_a_drive_that_leaves_the_operational_state_of_the_network_is_a_fault():
    drive = Ds402Drive(1, "front left", SETTING, lambda *_: None)
    drive.configured = True
    drive.start(0)
    drive.on_heartbeat(b"\x05", 0)
    drive.on_told(bytes.fromhex("37 02 00 00 00 00"), 0)
    assert drive.enabled
    drive.on_heartbeat(b"\x7f", 1)
    assert drive.fault == "drive 1 (front left): is pre-operational"
    assert not drive.enabled


def test_a_writer_sends_the_next_once_the_last_is_answered():
    sent = Sent()
    writer = Writer(5, sent)
    writer.begin([SdoWrite(0x6060, 0, 1, 3), SdoWrite(0x6007, 0, 2, 3)])
    writer.poll(0)
    writer.poll(10)
    assert [identifier for identifier, _ in sent] == [0x605]
    writer.on_answer(bytes.fromhex("60 17 10 00 00 00 00 00"), 20)  # of another object
    assert len(sent) == 1
    writer.on_answer(bytes.fromhex("60 60 60 00 00 00 00 00"), 20)
    assert len(sent) == 2
    writer.on_answer(bytes.fromhex("60 07 60 00 00 00 00 00"), 30)
    assert writer.done
    assert writer.fault is None


def test_a_refused_write_is_told_with_its_reason():
    writer = Writer(5, lambda *_: None)
    writer.begin([SdoWrite(0x6007, 0, 2, 9)])
    writer.poll(0)
    writer.on_answer(bytes.fromhex("80 07 60 00 30 00 09 06"), 1)
    assert writer.fault.startswith("refuses object 0x6007:0: Code 0x06090030")


def test_bits_that_are_the_nodes_own_are_read_first_and_written_back():
    sent = Sent()
    writer = Writer(5, sent)
    writer.begin([SdoWrite(0x1800, 1, 4, 0x8000_0185, keeps=0x4000_0000)])
    writer.poll(0)
    writer.on_answer(bytes.fromhex("60 00 18 01 00 00 00 00"), 1)  # of an earlier write
    writer.on_answer(bytes.fromhex("43 00 18 01 23 01 00 c0"), 1)
    writer.on_answer(bytes.fromhex("43 00 18 01 23 01 00 00"), 1)  # of a request that was repeated
    assert sent == [(0x605, "40 00 18 01 00 00 00 00"), (0x605, "23 00 18 01 85 01 00 c0")]
    assert not writer.done
    writer.on_answer(bytes.fromhex("60 00 18 01 00 00 00 00"), 2)
    assert writer.done


@pytest.mark.parametrize("code", ["00 00 02 06", "11 00 09 06"])
def test_what_a_node_may_lack_is_left_out_and_named(code):
    optional = SdoWrite(0x1029, 1, 1, 1, 0, "so what", optional=True)
    for write in (optional, SdoWrite(0x1029, 1, 1, 1, 0, "do this"), SdoWrite(0x1029, 1, 1, 1)):
        writer = Writer(5, lambda *_: None)
        writer.begin([write])
        writer.poll(0)
        writer.on_answer(bytes.fromhex(f"80 29 10 01 {code}"), 1)
        assert writer.done is write.optional
        assert writer.lacking == ([write] if write.optional else [])
        told = "has no object 0x1029:1: do this" if write.lack else "refuses object 0x1029:1: "
        assert write.optional or writer.fault.startswith(told)


def test_an_optional_object_that_refuses_its_value_is_a_fault():
    writer = Writer(5, lambda *_: None)
    writer.begin([SdoWrite(0x6007, 0, 2, 3, 0, "so what", optional=True)])
    writer.poll(0)
    writer.on_answer(bytes.fromhex("80 07 60 00 30 00 09 06"), 1)
    assert writer.fault.startswith("refuses object 0x6007:0: Code 0x06090030")


@pytest.mark.parametrize(
    ("answer", "fault"),
    [
        ("43 a9 60 00 00 47 b4 00", "rpm"),
        ("43 a9 60 00 00 03 b5 00", None),
        ("80 a9 60 00 00 00 02 06", None),
    ],
)
def test_a_value_that_was_read_may_refuse_a_node(answer, fault):
    sent = Sent()
    writer = Writer(5, sent)
    writer.begin([SdoCheck(0x60A9, 0, {0x00B44700: "rpm"}.get), SdoWrite(0x6060, 0, 1, 3)])
    writer.poll(0)
    writer.on_answer(bytes.fromhex(answer), 1)
    assert writer.fault == fault
    assert len(sent) == (1 if fault else 2)


def test_a_write_without_an_answer_is_sent_again_and_then_given_up():
    sent = Sent()
    writer = Writer(5, sent)
    writer.begin([SdoWrite(0x6007, 0, 2, 3)])
    for n in range(TRIES + 1):
        writer.poll(n * ANSWER_NS)
    assert len(sent) == TRIES
    assert writer.fault == "does not answer (object 0x6007)"


@given(st.lists(st.binary(max_size=8), max_size=30))
def test_whatever_comes_a_drive_raises_nothing_and_is_not_enabled_by_it(frames):
    drive = Ds402Drive(1, "front left", SETTING, lambda *_: None)
    for now, data in enumerate(frames):
        for take in (drive.on_heartbeat, drive.on_emergency, drive.on_answer, drive.on_told):
            take(data, now)
        drive.poll(now)
        assert not drive.enabled
        assert drive.control() == 0x02


def test_the_check_sum_is_that_of_sae_j1850():
    assert crc8(b"123456789") == 0x4B
    assert crc8(bytes(4)) == 0x59


def test_a_status_of_the_bumper_byte_by_byte():
    board = CanBumper(lambda *_: None)
    assert board.frame == 0x110
    board.on_frame(well(7, "47 00 00 00 10 00 00"), 0)
    assert board.fault is None
    board.on_frame(well(8, "78 02 fa 00 12 00 00"), 0)  # line open, latched, tested; zone 1; 25 N
    assert board.fault == "bumper: touched at front left"
    assert [hit.bearing for hit in board.hits()] == [pytest.approx(math.pi / 4)]


def test_a_reset_goes_out_once_the_line_is_closed_and_counts_up():
    sent = Sent()
    board = CanBumper(sent)
    for n in range(8):
        board.on_frame(well(n, "61 00 00 00 10 00 00"), n)
        board.poll(n)
    assert board.fault == "bumper: the board has latched a touch"
    assert board.acknowledge()
    board.on_frame(well(8, "61 00 00 00 10 00 00"), 8)
    assert sent == [(0x111, f"01 {crc8(bytes([1])):02x}"), (0x111, f"02 {crc8(bytes([2])):02x}")]
    board.on_frame(well(9), 9)
    board.poll(9)
    assert board.fault is None


def test_two_lost_frames_are_no_fault_and_a_third_is():
    board = CanBumper(lambda *_: None)
    for counter in (1, 2, 5, 6):
        board.on_frame(well(counter), 0)
    assert board.fault is None
    board.on_frame(well(10), 0)
    assert board.fault == "bumper: the counter jumps"


def test_silence_counts_from_the_last_frame():
    board = CanBumper(lambda *_: None)
    board.poll(0)
    board.poll(60 * MS)
    assert board.fault is None
    board.on_frame(well(1), 60 * MS)
    board.poll(120 * MS)
    assert board.fault is None
    board.poll(121 * MS)
    assert board.fault == "bumper: no frames"


def test_a_fault_of_the_frames_ends_only_after_good_ones_in_a_row():
    board = CanBumper(lambda *_: None)
    for n in range(3):
        board.on_frame(well(n), n)
    board.on_frame(b"\0" * 8, 3)
    for n in range(3, 7):
        board.on_frame(well(n), n)
        assert not board.acknowledge()
    board.on_frame(well(7), 8)
    assert board.acknowledge()


@given(st.lists(st.binary(min_size=0, max_size=8), max_size=20))
def test_no_bytes_of_chance_pass_for_a_board_that_is_well(frames):
    board = CanBumper(lambda *_: None)
    for n, data in enumerate(frames):
        board.on_frame(data, n)
        board.poll(n)
    good = [data for data in frames if len(data) == 8 and crc8(data[:7]) == data[7]]
    assert board.fault is not None or len(good) == len(frames)


@given(st.binary(min_size=7, max_size=7), st.integers(0, 63))
def test_a_changed_bit_is_found(head, bit):
    data = bytearray(head + bytes((crc8(head),)))
    data[bit // 8] ^= 1 << bit % 8
    assert crc8(data[:7]) != data[7]


@given(st.integers(0, 7))
def test_each_zone_has_its_bearing_and_its_name(zone):
    board = CanBumper(lambda *_: None)
    board.on_frame(well(1, f"71 {1 << zone:02x} fa 00 10 00 00"), 0)
    [hit] = board.hits()
    assert math.cos(hit.bearing - zone * math.pi / 4) == pytest.approx(1.0)
    assert board.fault == f"bumper: touched at {ZONES[zone]}"
