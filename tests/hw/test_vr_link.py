"""Clients of the VR link in virtual time: drops, second headsets, idle clients, hostile bytes."""

from __future__ import annotations

import json
import random
import struct

import pytest

from hw.drivers import gates
from hw.drivers.unity.client_slots import FULL, MOST_CLIENTS, MOST_OF_ONE, peers_of
from hw.drivers.unity.protocol.wire import LONGEST_BODY, LONGEST_NAME, LONGEST_SKIPPED
from hw.fakes.unity.unity_client import FLAG, POSE
from tests.hw.vr_link_rig import DEEP, LETS_GO_NS, MS, Headset, Link, S, order, pack
from tests.repeats import fewer

DROPS = (0.3, 1.0, 2.0, 5.0)
INSTANTS = tuple(1.0 + 0.2 * n for n in range(20))
"""From before the touch, which is asked for from 2 to 3.5 s, until after it."""
ELSEWHERE = (30.0, 5.0, 1.0)
LATCHED = "tracking of the user is lost"


def drop(how: str, length: float, at: float, answers: bool) -> dict[str, float]:
    """A drop of a headset's link while the base drives: how long what took to come back, s.

    `held`: what was sent arrives afterwards; `lost`: the application has noticed, the robot has
    not, and it connects anew; `closed`: both have.
    """
    link = Link(chain=True)
    headset = link.headset(plays=True, answers=answers)
    link.go(at)
    assert link.drives
    headset.is_away = True
    if how == "closed":
        headset.leave()
        link.go(0.01)
    link.is_up = False
    if how == "lost":
        headset.lose()
    before_ns = link.newest["user.pose"][0]
    link.go(length)
    link.is_up, headset.is_away = True, False
    link.go(0.02)
    if headset.line is None:  # given up by the robot: Unity waits for a second
        assert how == "held"
        assert link.until(lambda: headset.line is not None) <= 1.0
    took = {"tracked": link.until(lambda: link.is_tracked)}
    took["asked"] = link.until(lambda: (link.asked is None) is (headset.asks is None))
    link.go(0.5)
    if link.chain.chain.stopped is not None:
        assert link.chain.chain.stopped == LATCHED
        link.chain.order("reset", 7)
    took["drives"] = link.until(lambda: link.drives)
    took["silent"] = (first_after(link, before_ns) - before_ns) / S
    link.until(lambda: link.now_ns - link.begun_ns > LETS_GO_NS + S // 2)
    assert link.asked is None
    assert link.drives
    return took


def first_after(link: Link, before_ns: int) -> int:
    """When the person was seen first after an instant."""
    return next(at for name, at, _ in link.told if name == "user.pose" and at > before_ns)


def goes_on(how: str, length: float, at: float, answers: bool) -> None:
    took = drop(how, length, at, answers)
    assert max(took["tracked"], took["asked"], took["drives"]) <= 1.0, took


@pytest.mark.few(3)
@pytest.mark.requirement(48, 149)
@pytest.mark.parametrize(
    ("how", "length", "at", "answers"),
    [
        ("held", 2.0, 2.2, True),
        ("held", 5.0, 1.0, False),
        ("lost", 0.3, 1.8, False),
        ("lost", 1.0, 2.6, True),
        ("lost", 2.0, 3.2, False),
        ("closed", 2.0, 2.4, True),
    ],
)
def test_after_a_drop_the_session_goes_on_within_a_second(how, length, at, answers) -> None:
    """Of the return, or of the operator's acknowledgement where the chain has stopped for good."""
    goes_on(how, length, at, answers)


@pytest.mark.slow
@pytest.mark.requirement(48, 149)
@pytest.mark.parametrize("answers", [True, False])
@pytest.mark.parametrize("length", DROPS)
@pytest.mark.parametrize("how", ["held", "lost", "closed"])
def test_after_a_drop_at_any_instant_the_session_goes_on(how, length, answers) -> None:
    for at in fewer(INSTANTS):
        goes_on(how, length, at, answers)


def test_a_short_drop_stops_nobody_for_good_and_a_long_one_waits_for_the_operator() -> None:
    link = Link(chain=True)
    headset = link.headset()
    link.go(1.0)
    link.is_up = False
    link.go(0.3)
    link.is_up = True
    link.go(0.5)
    assert link.chain.chain.stopped is None
    link.is_up = False
    link.go(1.0)
    assert link.chain.chain.stopped == LATCHED
    assert link.chain.reset() == LATCHED  # before the return it is of no use
    link.is_up = True
    link.now_ns = link.chain.now
    assert link.until(lambda: link.is_tracked, 1.0) <= 1.0
    link.go(2.0)
    assert not link.drives
    assert link.chain.reset() is None
    assert headset.line is not None


# ---- one source, and who waits


def seen_of(link: Link) -> set[float]:
    return {round(person.body.x) for person in link.values("user.pose")}


@pytest.mark.few(1)
@pytest.mark.parametrize("second_host", ["10.0.0.7", "10.0.0.8"])
def test_of_two_live_headsets_the_first_stays_the_source_and_the_second_is_told(
    second_host,
) -> None:
    link = Link()
    first = link.headset()
    link.go(1.0)
    second = link.headset(second_host, ELSEWHERE)
    link.go(1.0)
    assert any("comes from 10.0.0.7" in text for text in second.texts())
    assert not any("clock_answer" in text for text in second.texts())  # each has its own clock
    assert "second source" in str(link.newest["vr.fault"][1])
    for stalled in (first, second, first):  # a game that loads still writes its keep-alives
        stalled.stalls = True
        link.go(4.0)
        stalled.stalls = False
        link.go(1.0)
    assert seen_of(link) == {40}
    assert first.texts() == []
    first.leave()
    first.is_away = True
    link.told.clear()
    assert link.until(lambda: link.values("user.pose")) <= 0.1
    link.go(0.5)
    assert seen_of(link) == {30}
    assert any("from now on" in text for text in second.texts("log"))


def test_who_was_there_before_a_headset_stalled_does_not_take_over_from_it() -> None:
    """Both behind one address; the link of the first hangs, but it is no former link."""
    link = Link()
    first = link.headset()
    link.go(1.0)
    link.headset(body=ELSEWHERE)
    link.go(1.0)
    first.line.held = True
    link.go(gates.CLIENT_SILENT_NS / S - 0.6)
    first.line.held = False
    link.go(1.0)
    assert seen_of(link) == {40}


def test_who_comes_while_a_headset_writes_keep_alives_only_does_not_take_over_from_it() -> None:
    link = Link()
    first = link.headset(answers=False)
    link.go(1.0)
    first.stalls = True
    link.go(0.5)
    second = link.headset(body=ELSEWHERE)
    link.go(4.0)
    first.stalls = False
    link.go(1.0)
    assert seen_of(link) == {40}
    assert second.texts()


def test_who_waited_first_is_the_next_source_whoever_leaves_how() -> None:
    link = Link()
    first = link.headset()
    link.go(0.7)
    second = link.headset("10.0.0.8", ELSEWHERE)
    link.go(0.7)
    third = link.headset("10.0.0.9", (20.0, 0.0, 1.0))
    link.go(0.7)
    first.write(*(order("remove_publisher", topic=f"vr/{name}") for name in ("head", "tailbone")))
    link.go(0.3)
    link.told.clear()
    link.go(0.5)
    assert seen_of(link) == {30}
    link.is_up = False  # dies without a word
    second.lose()
    second.is_away = True
    link.is_up = True
    link.go(3.6)
    link.told.clear()
    link.go(0.5)
    assert seen_of(link) == {20}
    assert third.texts("log")


def test_who_comes_back_gets_its_former_place_before_those_who_waited() -> None:
    link = Link()
    first = link.headset()
    link.go(0.7)
    other = link.headset("10.0.0.8", ELSEWHERE)
    link.go(0.7)
    first.lose()
    link.go(2.5)
    link.told.clear()
    link.go(4.0)
    assert seen_of(link) == {40}
    assert other.texts("log") == []


def test_another_address_does_not_take_over_from_who_is_silent_before_they_are_given_up() -> None:
    link = Link()
    first = link.headset()
    link.go(1.0)
    first.lose()
    first.is_away = True
    link.go(0.01)
    link.headset("10.0.0.8", ELSEWHERE)
    silence = link.until(lambda: 30 in seen_of(link))
    assert silence * S >= gates.CLIENT_SILENT_NS


def test_the_request_of_who_is_gone_ends_and_is_not_the_next_source_s() -> None:
    link = Link()
    first, second = link.headset(), link.headset("10.0.0.8", ELSEWHERE)
    link.go(1.0)
    first.asks = DEEP
    assert link.until(lambda: link.asked is not None) < 1.0
    first.leave()
    first.is_away = True
    link.go(0.1)
    assert link.asked is None
    second.asks = (29.5, 5.0, 1.3)
    assert link.until(lambda: link.asked is not None) < 1.0
    assert link.asked.x == 29.5


# ---- who may come, and how many


def test_another_address_than_the_peer_s_is_told_and_closed_and_nothing_of_it_is_taken() -> None:
    link = Link(peers=peers_of("10.0.0.7", "0.0.0.0"))
    stranger = link.headset("10.0.0.9", ELSEWHERE)
    stranger.is_away = True
    link.go(0.5)
    assert stranger.said[0][0] == "__handshake"  # else Unity looks no further
    assert "10.0.0.9 is not the `peer`" in stranger.texts()[0]
    assert stranger.is_closed or stranger.line is None
    assert "10.0.0.9 is not the `peer`" in str(link.newest["vr.fault"][1])
    assert link.bridge.sessions == []
    headset = link.headset("10.0.0.7")
    link.go(1.0)
    assert seen_of(link) == {40}
    assert headset.texts() == []


@pytest.mark.parametrize(
    ("peer", "host", "may", "may_not"),
    [
        (None, "127.0.0.1", "127.9.9.9", "10.0.0.7"),
        (None, "localhost", "127.0.0.1", "10.0.0.7"),
        (None, "0.0.0.0", "10.0.0.7", None),
        ("10.0.0.7", "0.0.0.0", "10.0.0.7", "127.0.0.1"),
        (["10.0.0.7", "10.1.0.0/16"], "0.0.0.0", "10.1.2.3", "10.2.0.0"),
    ],
)
def test_who_may_connect(peer, host, may, may_not) -> None:
    link = Link(peers=peers_of(peer, host))
    client = link.client(may)
    link.go(0.1)
    assert client.texts() == []
    if may_not is not None:
        client = link.client(may_not)
        link.go(0.1)
        assert client.texts()


@pytest.mark.parametrize("peer", ["the headset", "10.0.0.300", [], [7], ""])
def test_a_peer_that_is_no_address_is_named(peer) -> None:
    with pytest.raises(ValueError, match="peer: "):
        peers_of(peer, "0.0.0.0")


@pytest.mark.few(2)
@pytest.mark.parametrize("hosts", [1, 64])
@pytest.mark.parametrize("comes", ["first", "last"])
def test_sixty_four_idle_clients_do_not_keep_the_headset_out(hosts, comes) -> None:
    link = Link()
    headset = link.headset() if comes == "first" else None
    link.go(1.0)
    idle = [link.client(f"10.0.{n % hosts}.7") for n in range(64)]
    link.go(0.2)
    headset = headset or link.headset()
    link.go(1.0)
    assert headset.line is not None
    assert headset.texts() == []
    assert link.is_tracked
    assert len(link.clients.all) <= MOST_CLIENTS
    told = [client for client in idle if client.texts()]
    assert len(told) >= 64 - MOST_CLIENTS
    assert all(FULL in client.texts()[0] and client.is_closed for client in told)
    opened = headset.line
    link.go(gates.UNREGISTERED_NS / S)
    assert len(link.bridge.sessions) == 1
    assert headset.line is opened
    assert link.is_tracked


def test_who_says_something_but_registers_nothing_is_let_go_after_a_while() -> None:
    link = Link()
    client = link.client()
    for _ in range(30):
        client.write(bytes(8))
        link.go(0.5)
        if client.texts():
            break
    assert "registered nothing" in client.texts()[0]
    assert link.now_ns - link.begun_ns >= gates.UNREGISTERED_NS


def test_one_address_cannot_have_all_places() -> None:
    link = Link()
    many = []
    for _ in range(MOST_CLIENTS):
        many.append(link.headset("10.0.0.9", ELSEWHERE))
        link.go(0.05)
    assert len(link.bridge.sessions) == MOST_OF_ONE
    assert sum(FULL in text for one in many for text in one.texts()) >= MOST_OF_ONE
    assert link.bridge.is_source(link.session(many[0]))  # nobody takes the place of a source
    assert many[0].texts() == []
    other = link.headset("10.0.0.7")
    link.go(0.2)
    assert len(link.bridge.sessions) == MOST_OF_ONE + 1
    assert not any(FULL in text for text in other.texts())


# ---- bytes of any kind


def big(name: str, size: int) -> bytes:
    return struct.pack("<I", len(name)) + name.encode() + struct.pack("<I", size) + bytes(size)


@pytest.mark.few(2)
@pytest.mark.parametrize("name", ["vr/haptic_request", "vr/head", "camera/image", "__publish"])
def test_a_huge_message_is_left_out_and_told_and_the_link_stays(name) -> None:
    link = Link()
    headset = link.headset()
    link.go(1.0)
    headset.asks = DEEP
    assert link.until(lambda: link.asked is not None) < 1.0
    opened, count = headset.line, len(link.values("user.pose"))
    headset.asks = None
    headset.write(big(name, 1_500_000))
    link.go(0.5)
    assert headset.line is opened
    assert any(name in text for text in headset.texts())
    assert len(link.values("user.pose")) > count + 10
    assert (link.asked is None) is (name == "vr/haptic_request")
    assert link.session(headset).held <= LONGEST_BODY + LONGEST_NAME


def test_a_message_beyond_all_reason_closes_the_link_with_a_word() -> None:
    link = Link()
    headset = link.headset()
    link.go(1.0)
    opened = headset.line
    headset.write(struct.pack("<I", 1) + b"x" + struct.pack("<I", LONGEST_SKIPPED + 1))
    link.go(0.5)
    assert headset.line is not opened
    assert "67108865 bytes" in headset.texts()[0]
    link.go(2.0)
    assert link.is_tracked


@pytest.mark.parametrize(("build", "other"), [("ros1", "ROS 2"), ("ros2", "ROS 1")])
def test_a_project_of_the_other_build_is_told_what_to_write(build, other) -> None:
    link = Link(build)
    headset = link.client()
    if build == "ros1":
        body = json.dumps({"topic": "vr/head", "message_name": POSE}).encode() + b"\0"
        headset.write(bytes(8), pack("__publish\0", body))
    else:
        sender = Headset(link)
        headset.write(order("publish", topic="vr/head", message_name=POSE))
        headset.write(sender.posed("head", (0.0, 0.0, 1.6), link.now_ns))
    link.go(0.3)
    [told] = headset.texts()
    assert f"built for {other}" in told
    assert f"`build: ros{other[-1]}`" in told
    assert told.removeprefix("the robot closes the link: ") in str(link.newest["vr.fault"][1])


def test_a_project_of_ros_2_whose_names_are_not_terminated_is_known_by_its_messages() -> None:
    link = Link("ros1")
    client = link.client()
    client.write(order("publish", topic="vr/release", message_name=FLAG))
    client.write(pack("vr/release", b"\0\1\0\0\1"))
    link.go(0.1)
    assert "`build: ros2`" in client.texts()[0]


def test_what_a_client_calls_its_topics_reaches_no_terminal() -> None:
    link = Link()
    client = link.client()
    name = "\x1b[2J\ud800\n" + "x" * 400
    client.write(order("publish", topic=name, message_name=POSE), pack("a\x1b[2Jb", b"x"))
    link.go(0.3)
    told = [str(value) for value in link.values("vr.fault")] + client.texts("warn")
    assert any("a?[2Jb" in text for text in told)
    assert all(text.isprintable() and len(text) < 400 for text in told)


def noise(chance: random.Random, size: int) -> bytes:
    """Bytes that look like frames more or less."""
    names = [
        b"__publish", b"__subscribe", b"__request", b"__response", b"__topic_list", b"__x",
        b"__ros_service", b"__remove_publisher", b"vr/head", b"vr/tailbone", b"vr/release",
        b"vr/haptic_request", b"vr/clock_answer", b"cobodeck/describe", b"", b"\xff", b"tf",
    ]  # fmt: skip
    values = [
        "vr/head", "/tf", POSE, FLAG, 7, -1, 10**30, None, [], {}, "\0", "\ud800", 1e308,
        "cobodeck/describe", "x" * 600,
    ]  # fmt: skip
    data = b""
    while len(data) < size:
        name, body = chance.choice(names), chance.randbytes(chance.randrange(90))
        if chance.random() < 0.6:
            keys = ("topic", "message_name", "srv_id", "queue_size")
            body = json.dumps({key: chance.choice(values) for key in keys}).encode()
        elif chance.random() < 0.5:
            head = struct.pack("<IIII", 1, chance.randrange(1 << 32), chance.randrange(1 << 32), 3)
            numbers = [chance.choice([0.0, 1.0, -1.0, 1e308, float("nan"), 1.7]) for _ in range(7)]
            body = head + b"map" + struct.pack("<7d", *numbers)
        size_told = chance.choice([len(body)] * 30 + [len(body) + 1, 1 << 20, 1 << 31])
        data += struct.pack("<I", len(name)) + name + struct.pack("<I", size_told) + body
        data += chance.randbytes(chance.randrange(4)) if chance.random() < 0.01 else b""
    return data


def harassed(seed: int, size: int) -> None:
    """Hostile clients beside a headset, which goes on as if they were not there."""
    chance, link = random.Random(seed), Link()
    headset = link.headset()
    link.go(1.0)
    opened, sent, comers = headset.line, 0, 0
    worst_ns = 0
    while sent < size:
        comer = link.client(f"10.0.0.{chance.randrange(8, 12)}")
        data = noise(chance, chance.randrange(1, 6_000))
        sent, comers = sent + len(data), comers + 1
        comer.write(data)
        link.go(0.05)
        worst_ns = max(worst_ns, link.now_ns - link.newest["user.pose"][0])
        if chance.random() < 0.7:
            comer.leave()
        link.people = [headset, *[one for one in link.people if one is not headset][-12:]]
        assert len(link.clients.all) <= MOST_CLIENTS + 16
        assert sum(session.held for session in link.clients.all) < 8 * LONGEST_BODY
    assert comers > size // 6_000
    assert headset.line is opened
    assert seen_of(link) == {40}
    assert worst_ns <= 60 * MS
    assert not any("Error" in str(value) for value in link.values("vr.fault"))


def test_hostile_bytes_change_nothing_for_the_headset() -> None:
    harassed(1, 60_000)


@pytest.mark.slow
@pytest.mark.parametrize("seed", fewer(range(10)))
def test_two_million_hostile_bytes_change_nothing_for_the_headset(seed) -> None:
    harassed(seed, 200_000)
