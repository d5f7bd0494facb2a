"""What a refused or lost serial device or CAN interface means, and what puts it right."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

SERIAL_GROUP = "dialout"
"""The group that serial devices belong to, unless the device says otherwise."""
INTERFACES, IS_UP = Path("/sys/class/net"), 0x1
"""Where Linux lists network interfaces; the flag of one that is up."""
_SERIAL: Mapping[int, str] = {
    errno.EACCES: "no right to it: sudo usermod -aG {group} $USER, then log in again",
    errno.EPERM: "no right to it: sudo usermod -aG {group} $USER, then log in again",
    errno.ENOENT: "there is no such device; `ls -l /dev/serial/by-id` lists what is plugged in",
    errno.EBUSY: "another program has it open",
    errno.EIO: "it was unplugged",
    errno.ENXIO: "it was unplugged",
}
_CAN: Mapping[int, str] = {
    errno.ENODEV: "there is no such interface: is its adapter plugged in? `ip link` lists them",
    errno.ENETDOWN: "it is down: sudo ip link set {place} up type can bitrate {bitrate}",
    errno.ENOBUFS: "nothing leaves it: are the other nodes on, and of {bitrate} bit/s? If so: sudo "
    "ip link set {place} txqueuelen 100",
    errno.EPERM: "no right to it: its network belongs to somebody else (a container?)",
    errno.EACCES: "no right to it: its network belongs to somebody else (a container?)",
}


def serial_advice(error: BaseException, device: str) -> str | None:
    """What is wrong with a serial device, and what would be right; None if not known."""
    told = _SERIAL.get(_number(error) or 0)
    return None if told is None else told.format(group=_group(device))


def serial_hindrance(device: str) -> str | None:
    """What keeps a serial device from being opened, as seen without opening it; None: nothing."""
    if not Path(device).exists():
        return serial_advice(OSError(errno.ENOENT, ""), device)
    if not os.access(device, os.R_OK | os.W_OK):
        return serial_advice(OSError(errno.EACCES, ""), device)
    return None


def can_hindrance(channel: str, bitrate: object, folder: Path = INTERFACES) -> str | None:
    """What keeps a CAN interface of Linux from being used, without opening it; None: nothing."""
    interface = folder / channel
    if not interface.exists():
        return can_advice(OSError(errno.ENODEV, ""), channel, bitrate)
    with suppress(OSError, ValueError):
        if not int((interface / "flags").read_text(), 16) & IS_UP:
            return can_advice(OSError(errno.ENETDOWN, ""), channel, bitrate)
    return None


def can_advice(error: BaseException, channel: str, bitrate: object) -> str | None:
    """What is wrong with a CAN interface of Linux, and what would be right; None if not known."""
    told = _CAN.get(_number(error) or 0)
    return None if told is None else told.format(place=channel, bitrate=bitrate)


def _number(error: BaseException | None) -> int | None:
    """The errno of an error, or of what caused it; python-can has it as `error_code`."""
    while error is not None:
        for key in ("errno", "error_code"):
            if isinstance(found := getattr(error, key, None), int):
                return found
        error = error.__cause__ or error.__context__
    return None


def _group(device: str) -> str:
    with suppress(ImportError, OSError, KeyError):
        import grp

        found = grp.getgrgid(Path(device).stat().st_gid).gr_name
        return SERIAL_GROUP if found == "root" else found
    return SERIAL_GROUP
