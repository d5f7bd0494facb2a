"""The key that an observer and a safety chain share, in a file that only its owner can read (R55).

A chain with an observer on its own machine and no file named in its connection uses `OWN`, which
whoever comes first makes; so nothing has to be set up there, and other users of the machine cannot
speak for the observer. For an observer on another machine `cobodeck observe --new-key FILE` makes a
file, which is carried to both machines.
"""

from __future__ import annotations

import os
import re
import secrets
from contextlib import suppress
from pathlib import Path

OWN = Path("~/.config/cobodeck/observer.key")
"""The file of a user, for an observer on the same machine."""
SIZE = 32
"""Length of a key, bytes."""
OTHERS = 0o077
"""Permissions that a file with a key does not have."""


def make_key(path: Path) -> None:
    """Write a new key to a new file, 0600.

    Raises:
        OSError: the file is there already, or cannot be written.
    """
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(secrets.token_hex(SIZE) + "\n")


def read_key(path: Path) -> bytes:
    """The key in a file.

    Raises:
        OSError: the file cannot be read; ValueError: others can read it, or it has no key.
    """
    with path.open("rb") as file:
        mode, text = os.fstat(file.fileno()).st_mode, file.read(4 * SIZE)
    if os.name == "posix" and mode & OTHERS:
        raise ValueError(f"{path}: others may read or change it; `chmod 600 {path}` ends that")
    if not re.fullmatch(rb"[0-9a-f]{%d}\s*" % (2 * SIZE), text):
        raise ValueError(
            f"{path}: it has no key; remove it: `cobodeck observe --new-key {path}` makes one"
        )
    return bytes.fromhex(text.decode())


def key_in(file: str | Path | None) -> bytes:
    """The key in a file, `~` being the user's home; None: in the user's own, made if missing.

    Raises:
        OSError, ValueError: see `read_key`.
    """
    path = OWN if file is None else Path(file)
    try:
        path = path.expanduser()
    except RuntimeError:
        raise ValueError(f"{path}: this user has no home; set HOME, or name another file") from None
    if file is not None:
        return read_key(path)
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with suppress(FileExistsError):
        make_key(path)
    return read_key(path)
