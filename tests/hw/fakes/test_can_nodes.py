"""The fake nodes as somebody sees them who knows nothing of our driver: bytes on a bus."""

import can
import pytest

from hw.fakes.can.bumper_node import FakeBumper, check_sum
from hw.fakes.can.can_wire import open_wire
from hw.fakes.can.nodes import Nodes

MS = 1_000_000
START = b"\x01\x01"


class Bus:
    """Four nodes and a board, and a bus to talk to them."""

    def __init__(self, name):
        settings = {"interface": "virtual", "channel": f"fakes {name}"}
        self.wire = open_wire(settings)
        self.own = can.Bus(ignore_config=True, **settings)
        self.nodes = Nodes(self.wire)
        self.now_ns = 0

    def send(self, identifier, data):
        self.own.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def step(self, span_ns=0):
        self.now_ns += span_ns
        self.nodes.on_frames(self.wire.poll(), self.now_ns)
        self.nodes.step(self.now_ns)
        found = []
        while (message := self.own.recv(0)) is not None:
            found.append((message.arbitration_id, bytes(message.data).hex(" ")))
        return found

    def write(self, frame):
        self.send(0x601, bytes.fromhex(frame))
        [answer] = [data for identifier, data in self.step() if identifier == 0x581]
        return answer

    def sync(self, control=None, target=0):
        """Process data of node 1, and what it tells."""
        if control is not None:
            self.send(0x201, control.to_bytes(2, "little") + target.to_bytes(4, "little"))
        self.send(0x80, b"")
        return [data for identifier, data in self.step(10 * MS) if identifier == 0x181]

    def close(self):
        self.own.shutdown()
        self.wire.close()


@pytest.fixture
def bus(request):
    made = Bus(request.node.name)
    yield made
    made.close()


@pytest.fixture
def mapped(bus):
    bus.step()
    for frame in (
        "2f 00 16 00 00 00 00 00", "23 00 16 01 10 00 40 60", "23 00 16 02 20 00 ff 60",
        "2f 00 16 00 02 00 00 00", "2f 00 14 02 01 00 00 00", "23 00 14 01 01 02 00 00",
        "2f 00 1a 00 00 00 00 00", "23 00 1a 01 10 00 41 60", "23 00 1a 02 20 00 6c 60",
        "2f 00 1a 00 02 00 00 00", "2f 00 18 02 01 00 00 00", "23 00 18 01 81 01 00 00",
        "2f 60 60 00 03 00 00 00", "23 85 60 00 40 42 0f 00", "23 83 60 00 40 42 0f 00",
        "23 84 60 00 40 42 0f 00",
    ):  # fmt: skip
        assert bus.write(frame).startswith("60 ")
    bus.send(0, START)
    bus.step()
    return bus


def enabled(bus):
    for control in (0x06, 0x07, 0x0F):
        bus.sync(control)
    return bus


def test_they_start_with_a_boot_up_message_and_beat_when_told_to(bus):
    assert [(0x700 + n, "00") for n in (1, 2, 3, 4)] == [f for f in bus.step() if f[0] > 0x700]
    assert bus.write("2b 17 10 00 32 00 00 00") == "60 17 10 00 00 00 00 00"
    beats = [frame for _ in range(20) for frame in bus.step(10 * MS) if frame[0] == 0x701]
    assert beats == [(0x701, "7f")] * 4
    bus.send(0, START)
    bus.step()
    assert (0x701, "05") in [frame for _ in range(6) for frame in bus.step(10 * MS)]


def test_a_strange_object_and_a_wrong_length_are_refused(bus):
    bus.step()
    assert bus.write("2b 34 12 00 32 00 00 00") == "80 34 12 00 00 00 02 06"
    assert bus.write("2f 17 10 00 32 00 00 00") == "80 17 10 00 10 00 07 06"
    assert bus.write("40 00 10 00 00 00 00 00") == "43 00 10 00 92 01 02 00"


def test_states_follow_the_control_words_and_the_velocity_its_ramp(mapped):
    assert mapped.sync() == ["50 02 00 00 00 00"]
    assert mapped.sync(0x0F) == ["50 02 00 00 00 00"]  # not from there
    assert [mapped.sync(word)[0][:5] for word in (0x06, 0x07, 0x0F)] == ["31 02", "33 02", "37 02"]
    mapped.sync(0x0F, 100_000)
    told = [int.from_bytes(bytes.fromhex(mapped.sync()[0])[2:], "little") for _ in range(12)]
    assert told == [10_000 * n for n in range(1, 11)] + [100_000, 100_000]


def test_a_quick_stop_brakes_and_ends_without_power(mapped):
    enabled(mapped)
    for _ in range(5):
        mapped.sync(0x0F, 50_000)
    mapped.sync(0x02)
    states = [mapped.sync(0x0F, 50_000)[0][:5] for _ in range(8)]
    assert states[0] == "17 02"
    assert states[-1] == "50 02"  # 0x0F alone leads nowhere


def test_a_master_that_is_silent_is_told_of_and_stops_the_wheel(mapped):
    mapped.write("23 16 10 01 50 00 7f 00")
    mapped.write("2b 07 60 00 03 00 00 00")
    enabled(mapped)
    mapped.send(0x77F, b"\x05")
    for _ in range(8):
        assert mapped.sync(0x0F, 50_000)[0].startswith("37 02")
    frames = [frame for _ in range(2) for frame in mapped.step(10 * MS)]
    assert (0x81, "30 81 11 00 00 00 00 00") in frames
    for _ in range(20):
        mapped.step(10 * MS)
    assert mapped.nodes.drives[1].velocity == 0.0
    assert mapped.sync(0x0F, 50_000) == []  # pre-operational: no process data


def test_an_error_is_an_emergency_frame_and_ends_by_the_edge_of_the_reset(mapped):
    enabled(mapped)
    mapped.nodes.fault("emcy", (1, 0x3210))
    assert (0x81, "10 32 01 00 00 00 00 00") in mapped.step()
    assert mapped.sync(0x0F)[0].startswith("18 02")
    mapped.send(0x201, bytes.fromhex("80 00 00 00 00 00"))
    mapped.send(0x80, b"")
    frames = mapped.step(10 * MS)
    assert (0x81, "00 00 00 00 00 00 00 00") in frames
    assert (0x181, "50 02 00 00 00 00") in frames
    mapped.nodes.fault("emcy", 1)
    mapped.step(10 * MS)
    assert mapped.sync(0x80)[0].startswith("18 02")  # the bit is set all the time: no edge


def test_faults_that_nobody_knows_are_refused(bus):
    with pytest.raises(ValueError, match="no fault is named 'typo'"):
        bus.nodes.fault("typo")


def test_lost_frames_are_lost_by_chance_and_none_once_all_is_well(mapped):
    enabled(mapped)
    mapped.nodes.fault("drop", 0.5)
    assert 20 < sum(len(mapped.sync()) for _ in range(100)) < 80
    mapped.nodes.fault("well")
    assert sum(len(mapped.sync()) for _ in range(100)) == 100


def test_frames_of_the_board_by_hand():
    sent, line = [], []
    board = FakeBumper(lambda identifier, data: sent.append((identifier, data)), line.append)
    board.step(0)
    board.step(10 * MS)
    board.touch(1.6)
    board.step(11 * MS)
    assert [data[:7].hex(" ") for _, data in sent] == [
        "41 00 00 00 00 00 00",
        "72 04 fa 00 01 00 00",
    ]
    assert all(identifier == 0x110 and check_sum(data[:7]) == data[7] for identifier, data in sent)
    assert line == [True]
    board.release()
    board.on_frame(0x111, bytes((1, check_sum(b"\x01"))))
    assert board.latched  # its line is open still
    board.unlatch()
    assert line == [True, False]
    board.on_frame(0x111, bytes((2, 0)))
    assert board.latched  # wrong check sum
    board.on_frame(0x111, bytes((2, check_sum(b"\x02"))))
    assert not board.latched


def test_the_check_sum_has_its_standard_value():
    assert check_sum(b"123456789") == 0x4B
