"""SICK S300 laser scanners, each behind a serial-to-Ethernet server or at a serial port (R8).

parts:
  lidar:
    driver: S300
    scanners:
      front_laser: {host: 192.168.0.31, port: 4001}
      rear_laser: {device: /dev/serial/by-id/usb-…, upside_down: true}
    baud: 500000         # of the RS-422 line
    delay: 0.0           # s, between line and program, if known

The scanners send continuously, without being polled. A scan is stamped at its first beam: receipt
of its telegram, less the transmission time (10 bits per byte), less the time from the first beam to
the last, less `delay`. Other delays on the way cannot be seen, and make the stamp late. A scanner
mounted upside down sweeps clockwise: its step is negative.

No scan is repeated, and a scanner in standby gives none: a scanner without a valid scan for 0.4 s
is a fault, which stops the robot until it scans again and the operator resets the stop.
"""

from __future__ import annotations

import importlib
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from hw.connection import RunInfo
from hw.drivers.access import serial_advice
from hw.drivers.feed import by_stamps
from hw.drivers.gates import SCAN_SILENT_NS
from hw.drivers.sick.telegram import Telegram, Telegrams
from hw.extras import missing
from hw.model import LidarModel
from hw.samples import Sample, Scan

AGAIN_S = 0.5
"""Period of attempts to reach a scanner, s."""
LOOK_S = 0.2
CONNECTING_S = 1.0
SILENT_S = 2.0
"""Silence after which a line is reopened, s: its server may have restarted."""
OPENING_S = 5.0
"""Time limit for the first scan of each scanner, s."""
KEPT = 16
FARTHEST = 29.9
"""Ranges above this are no returns: an S300 reports 29.96 m for them."""
_BITS = 10


class ScannerLine(Protocol):
    """A byte stream from a scanner."""

    def read(self) -> bytes:
        """The bytes received; empty if there are none within `LOOK_S`.

        Raises:
            OSError: the line is lost.
        """
        ...

    def close(self) -> None:
        """Close it."""
        ...


class S300:
    """The scanners of a robot, by their names in its file. Gives `base.scan`.

    `health` says by name why a scanner gives nothing, or None; `fault` is the first of these.

    Args:
        scanners: by name the `host` and `port` of each, or its `device`, and `upside_down: true`
            where it is.
        now: the time of the run, ns.
        opening: of the run.
        baud: of the RS-422 line.
        delay: between line and program, s, if known.

    Raises:
        ValueError: a scanner that the robot file does not name, or without an address.
    """

    signals: tuple[str, ...] = ("base.scan",)

    def __init__(
        self,
        scanners: Mapping[str, Mapping[str, Any]],
        now: Callable[[], int],
        opening: RunInfo,
        baud: int = 500_000,
        delay: float = 0.0,
    ) -> None:
        self.wake: Callable[[], None] = _nobody
        self._arrived: deque[Sample] = deque(maxlen=KEPT * len(scanners))
        models = opening.body.sensing.lidars
        self._readers = []
        for name, address in scanners.items():
            if name not in models:
                there = ", ".join(models) or "it has none"
                raise ValueError(f"{name!r} is no scanner of {opening.body.name}: {there}")
            stamping = _Stamping(name, models[name], address, baud, delay)
            self._readers.append(_Reader(name, _line_of(name, address, baud), stamping, now))
        self._right = f"it has to be on, to measure, and to send continuously at {baud} baud"
        for reader in self._readers:
            reader.start(self._on_sample)

    @property
    def health(self) -> dict[str, str | None]:
        """Why a scanner gives nothing, by name; None if it gives scans."""
        return {reader.name: reader.why for reader in self._readers}

    @property
    def fault(self) -> str | None:
        """Which scanner gives nothing, and why; None if all give scans."""
        return next((f"{name}: {why}" for name, why in self.health.items() if why), None)

    def wait(self) -> None:
        """Wait until each scanner has given a valid scan.

        Raises:
            OSError: one has not within OPENING_S, with the cause.
        """
        until = time.monotonic() + OPENING_S
        for reader in self._readers:
            if not reader.scans.wait(max(0.0, until - time.monotonic())):
                cause = reader.cause or reader.why or "silent"
                raise OSError(
                    f"{reader.name}: {cause}; no scan within {OPENING_S:g} s: {self._right}"
                )

    def samples(self, now_ns: int) -> list[Sample]:
        """Scans since the last call, by stamp."""
        return by_stamps(self._arrived, now_ns)

    def close(self) -> None:
        """Close all lines."""
        for reader in self._readers:
            reader.over.set()
        for reader in self._readers:
            reader.join()

    def _on_sample(self, sample: Sample) -> None:
        self._arrived.append(sample)
        self.wake()


class _Stamping:
    """Converts a telegram and its time of receipt to a stamped scan."""

    def __init__(
        self, name: str, model: LidarModel, address: Mapping[str, Any], baud: int, delay: float
    ) -> None:
        self._name, self._model = name, model
        self._side = -1.0 if address.get("upside_down", False) else 1.0
        self._byte_ns, self._delay_ns = _BITS * 1e9 / baud, round(delay * 1e9)
        self._sweep_ns = round((model.beams - 1) * model.beam_time * 1e9)
        self._last: tuple[int, int] | None = None

    def fault(self, telegram: Telegram) -> str | None:
        """Why this telegram is no new scan, or None."""
        count, beams = len(telegram.words), self._model.beams
        if telegram.silence is not None:
            return telegram.silence
        if count != beams:
            return (
                f"it sends {count} distances, and the robot file says {beams} beams: correct it, "
                "or the angle and resolution that the scanner sends"
            )
        counted, self._last = self._last, (telegram.scan, telegram.number)
        return "it repeats itself" if counted == self._last else None

    def sample(self, telegram: Telegram, received_ns: int) -> Sample:
        """The scan, stamped at its first beam."""
        line_ns = round(telegram.size * self._byte_ns)
        stamp = received_ns - line_ns - self._sweep_ns - self._delay_ns
        model, side = self._model, self._side
        ranges = telegram.ranges(model.min_range, min(model.max_range, FARTHEST))
        scan = Scan(self._name, side * model.start, side * model.step, ranges, model.beam_time)
        return Sample("base.scan", stamp, scan)


class _Reader:
    """One scanner: a thread that reads, and reopens the line. `scans` is set by the first scan.

    `cause` is why the newest data was no scan, None if it was one.
    """

    def __init__(
        self,
        name: str,
        open_line: Callable[[], ScannerLine],
        stamping: _Stamping,
        now: Callable[[], int],
    ) -> None:
        self.name = name
        self.cause: str | None = "not connected yet"
        self.scans, self.over = threading.Event(), threading.Event()
        self._scanned_ns = self._looked_ns = self._heard_ns = time.monotonic_ns()
        self._open, self._stamping, self._now = open_line, stamping, now
        self._on_sample: Callable[[Sample], None] = lambda _: None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self, on_sample: Callable[[Sample], None]) -> None:
        self._on_sample = on_sample
        self._thread.start()

    @property
    def why(self) -> str | None:
        """Why there has been no scan for SCAN_SILENT_NS; None if there was one.

        Without a cause, time counts up to the last look at the line: a thread that was held up has
        not heard silence.
        """
        now_ns = self._looked_ns if self.cause is None else time.monotonic_ns()
        if now_ns - self._scanned_ns <= SCAN_SILENT_NS:
            return None
        garbled = now_ns - self._heard_ns <= SCAN_SILENT_NS
        return self.cause or ("it sends no valid telegram" if garbled else "silent")

    def join(self) -> None:
        self._thread.join(CONNECTING_S + LOOK_S)

    def _run(self) -> None:
        while not self.over.is_set():
            try:
                line = self._open()
            except (OSError, ImportError) as error:
                self.cause = f"not connected: {missing(error) or error}"
            else:
                self._follow(line)
            self.over.wait(AGAIN_S)

    def _follow(self, line: ScannerLine) -> None:
        self.cause = None
        try:
            self._read(line)
        except OSError as error:
            self.cause = f"the line is gone: {error}"
        finally:
            line.close()

    def _read(self, line: ScannerLine) -> None:
        telegrams, self._heard_ns = Telegrams(), time.monotonic_ns()
        while not self.over.is_set():
            data = line.read()
            received, looked_ns = self._now(), time.monotonic_ns()
            if data:
                self._heard_ns = looked_ns
            elif looked_ns - self._heard_ns > SILENT_S * 1e9:
                raise OSError("silent")
            for telegram in telegrams.feed(data):
                self.cause = self._stamping.fault(telegram)
                if self.cause is None:
                    self._scanned_ns = looked_ns
                    self.scans.set()
                    self._on_sample(self._stamping.sample(telegram, received))
            self._looked_ns = looked_ns


class _TcpLine:
    """A line behind a TCP port."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), CONNECTING_S)
        self._socket.settimeout(LOOK_S)

    def read(self) -> bytes:
        try:
            data = self._socket.recv(4096)
        except TimeoutError:
            return b""
        if not data:
            raise OSError("closed by its server")
        return data

    def close(self) -> None:
        self._socket.close()


class _SerialLine:
    """A serial port of this machine."""

    def __init__(self, device: str, baud: int) -> None:
        serial = importlib.import_module("serial")
        try:
            self._port = serial.Serial(device, baud, timeout=LOOK_S)
        except OSError as error:
            raise OSError(f"{device}: {serial_advice(error, device) or error}") from error

    def read(self) -> bytes:
        data: bytes = self._port.read(max(1, self._port.in_waiting))
        return data

    def close(self) -> None:
        self._port.close()


def _line_of(name: str, address: Mapping[str, Any], baud: int) -> Callable[[], ScannerLine]:
    known = {"host", "port", "device", "upside_down"}
    if strange := sorted(set(address) - known):
        raise ValueError(f"{name}: {', '.join(strange)}: there are {', '.join(sorted(known))}")
    if "device" in address:
        return lambda: _SerialLine(str(address["device"]), baud)
    if "host" not in address or "port" not in address:
        raise ValueError(f"{name}: write host and port of its serial server, or a serial device")
    return lambda: _TcpLine(str(address["host"]), int(address["port"]))


def _nobody() -> None:
    """No loop waits for a scan."""
