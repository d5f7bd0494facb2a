"""Random streams and sample times of simulated sensors.

Every draw depends on seed, source and sample number alone (Philox, a counter-based generator), so
that a source is not affected by how often another one is sampled or read.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

FORGOTTEN_NS = 1_000_000_000
_BLOCK = 64
"""Rows drawn at once."""


class Stream:
    """The random numbers of one source."""

    def __init__(self, seed: int, source: str) -> None:
        key = hashlib.blake2b(f"{seed}/{source}".encode(), digest_size=16).digest()
        self._bits = np.random.Philox(key=int.from_bytes(key, "little"))
        self._chance = np.random.Generator(self._bits)
        self._state = self._bits.state

    def at(self, number: int) -> np.random.Generator:
        """The generator set to the start of this sample's numbers; the next call resets it."""
        self._state["state"]["counter"][1] = number
        self._bits.state = self._state
        return self._chance


class Normals:
    """A row of `width` standard normal numbers for each sample of a source."""

    def __init__(self, seed: int, source: str, width: int) -> None:
        self._stream, self._width = Stream(seed, source), width
        self._block, self._rows = -1, np.empty((0, width))

    def row(self, number: int) -> NDArray[np.float64]:
        """The numbers of this sample, (width,)."""
        block = number // _BLOCK
        if block != self._block:
            drawn = self._stream.at(block).standard_normal((_BLOCK, self._width))
            self._block, self._rows = block, drawn
        row: NDArray[np.float64] = self._rows[number - block * _BLOCK]
        return row


class Rhythm:
    """Sample n of a source is taken at its phase + n / `rate`, independent of the world's steps.

    The phase is drawn once. A sample arrives `lag_ns` after it is taken; before `next_ns` none
    does.
    """

    def __init__(self, rate: float, seed: int, source: str, lag_ns: int = 0) -> None:
        self._period = 1e9 / rate
        self._phase = Stream(seed, f"{source}/phase").at(0).random() * self._period
        self._lag, self._next = lag_ns, 0
        self.next_ns = self.stamp(0) + lag_ns

    def stamp(self, number: int) -> int:
        """When this sample is taken, ns."""
        return round(self._phase + number * self._period)

    def due(self, now_ns: int) -> list[tuple[int, int]]:
        """Numbers and stamps of the samples that have arrived since the last call.

        Those that arrived more than `FORGOTTEN_NS` ago are left out, so that a first call late in a
        run does not compute the whole past.
        """
        if now_ns < self.next_ns:
            return []
        number, stamp, latest = self._next, self.next_ns - self._lag, now_ns - self._lag
        if stamp < latest - FORGOTTEN_NS:
            number = math.ceil((latest - FORGOTTEN_NS - self._phase) / self._period)
            stamp = self.stamp(number)
        found = []
        while stamp <= latest:
            found.append((number, stamp))
            number += 1
            stamp = round(self._phase + number * self._period)
        self._next, self.next_ns = number, stamp + self._lag
        return found
