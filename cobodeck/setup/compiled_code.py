"""Where numba caches compiled code, so that only the first start takes long.

A checkout keeps the cache beside its modules if it is writable. Otherwise, and once installed, the
user's cache folder is used: uninstalling would leave files behind in the package's folder.
"""

from __future__ import annotations

import atexit
import os
from collections.abc import Mapping, MutableMapping
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
VARIABLE = "NUMBA_CACHE_DIR"


def keep_compiled_code(
    environment: MutableMapping[str, str] = os.environ, root: Path | None = None
) -> str | None:
    """Tell numba where to cache compiled code; returns a message if there is no such place.

    Call it before numba is imported. Without a place the code of this run goes to a temporary
    folder, because numba would refuse to work otherwise.
    """
    if VARIABLE in environment:
        return None
    places = cache_places(environment, root)
    place = next(filter(_is_writable, places), None)
    if place is None:
        import shutil
        import tempfile

        environment[VARIABLE] = folder = tempfile.mkdtemp(prefix="cobodeck-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        shown = " and ".join(map(str, places)) or "a home directory"
        return f"compiled code is not kept, each start takes longer: cannot write to {shown}"
    if not _is_beside_modules(place, root):
        environment[VARIABLE] = str(place)
    return None


def cache_places(environment: Mapping[str, str], root: Path | None = None) -> list[Path]:
    """Folders that may hold compiled code; the first writable one is used."""
    root = ROOT if root is None else root
    places = [root / "states"] if (root / "pyproject.toml").is_file() else []
    if "XDG_CACHE_HOME" in environment:
        return [*places, Path(environment["XDG_CACHE_HOME"]) / "cobodeck"]
    try:
        home = Path(environment["HOME"]) if "HOME" in environment else Path.home()
    except RuntimeError:  # neither HOME nor an entry in the list of users
        return places
    return [*places, home / ".cache" / "cobodeck"]


def described(environment: Mapping[str, str] = os.environ) -> str:
    """Where compiled code is kept, as text for people."""
    if VARIABLE in environment:
        return f"in {environment[VARIABLE]}, as {VARIABLE} says"
    place = next(filter(_is_writable, cache_places(environment)), None)
    if place is None:
        return "nowhere can be written to; each start takes longer"
    return "beside the modules" if _is_beside_modules(place, None) else f"in {place}"


def _is_beside_modules(place: Path, root: Path | None) -> bool:
    return place == (ROOT if root is None else root) / "states"


def _is_writable(folder: Path) -> bool:
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return os.access(there, os.W_OK)
