"""Virtual time at a pace: the instants of virtual time, at the wall clock's leisure."""

from __future__ import annotations

from threading import Thread

from hypothesis import given, strategies as some

from cobodeck.loop.clocks import SLACK_NS, Paced


class Wall:
    """A wall clock that passes when it is slept by."""

    def __init__(self) -> None:
        self.now = 1_000

    def reading(self) -> int:
        self.now += 1
        return self.now


class Slept(Paced):
    """A paced clock whose sleeping lets a wall clock pass."""

    def __init__(self, speed: float, wall: Wall) -> None:
        super().__init__(speed, wall.reading)
        clock = self

        class Sleeping:
            slept: list[float] = []

            def get(self, timeout: float) -> None:
                self.slept.append(timeout)
                wall.now += round(timeout * 1e9)
                from queue import Empty

                raise Empty

            def put(self, _: None) -> None:
                """Nobody sleeps."""

        clock._woken = Sleeping()  # type: ignore[assignment]


@given(speed=some.floats(0.1, 100.0), steps=some.lists(some.integers(1, 10**9), max_size=50))
def test_the_wall_clock_passes_by_the_run_time_over_the_speed(
    speed: float, steps: list[int]
) -> None:
    wall, at = Wall(), 0
    clock = Slept(speed, wall)
    begun = wall.now
    for step in steps:
        at += step
        assert clock.wait(at) == at
    assert abs((wall.now - begun) - at / speed) < 1_000 + 10 * len(steps)


def test_what_took_too_long_is_made_up_for_only_a_little() -> None:
    wall = Wall()
    clock = Slept(1.0, wall)
    clock.wait(1_000_000)
    wall.now += 10**9
    late = wall.now
    for n in range(2, 102):
        clock.wait(n * 1_000_000)
    assert abs(wall.now - late - (100_000_000 - SLACK_NS)) < 10_000


def test_a_change_of_speed_holds_at_once() -> None:
    clock = Paced(0.1)
    clock.wait(0)
    waiting = Thread(target=clock.wait, args=(60 * 10**9,))
    waiting.start()
    clock.speed = 1e6
    clock.wake()
    waiting.join(20.0)
    assert not waiting.is_alive()
