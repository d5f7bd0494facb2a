"""Imports modules of FlexBE states, which find stand-ins where they import `flexbe_core` or ROS.

Only these modules see the stand-ins: each has an `import` of its own, also for what its functions
import later, and `sys.modules` never holds one. What they print becomes notes, and names of
Python 2 that have only another name today are there.
"""

from __future__ import annotations

import builtins
import importlib
import importlib.util
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from cobodeck.flexbe_states.imported_names import LARGEST, imported_names
from engine.files import FileError, read_bytes, read_text

_lock = threading.RLock()


def flexbe_modules(name: str) -> tuple[str, ...]:
    """The module of this name if it imports `flexbe_core`, or those of a package that do.

    One that imports such a module of its own package counts as well.
    """
    spec = _spec(name)
    if spec is None:
        return ()
    names = [name]
    for folder in spec.submodule_search_locations or ():
        stems = (file.stem for file in sorted(Path(folder).glob("*.py")))
        names += [f"{name}.{s}" for s in stems if s.isidentifier() and s != "__init__"]
    return tuple(inner for inner in names if _imports(inner, _is_flexbe_core))


def import_flexbe(name: str) -> ModuleType:
    """The module of this name, imported with stand-ins.

    Raises:
        ModuleNotFoundError: there is none.
        Exception: whatever it raises.
    """
    with _lock:
        if name in sys.modules:
            return sys.modules[name]
        spec = _spec(name)
        if spec is None or spec.origin is None or spec.loader is None:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        module = importlib.util.module_from_spec(spec)
        code = compile(read_bytes(Path(spec.origin), LARGEST), spec.origin, "exec")
        module.__dict__["__builtins__"] = _builtins()
        sys.modules[name] = module
        try:
            exec(code, module.__dict__)
        except BaseException:
            del sys.modules[name]
            raise
        parent, _, child = name.rpartition(".")
        if parent in sys.modules:
            setattr(sys.modules[parent], child, module)
        return module


def module_text(name: str) -> tuple[str, str] | None:
    """The text of a module, and its file; None if it cannot be read."""
    spec = _spec(name)
    if spec is None or spec.origin is None:
        return None
    try:
        return read_text(Path(spec.origin), LARGEST), spec.origin
    except FileError:
        return None


def _spec(name: str) -> Any:
    parent, _, child = name.rpartition(".")
    try:
        if not parent:
            return importlib.util.find_spec(name)
        above = _spec(parent)  # found without being imported
    except (ImportError, ValueError):
        return None
    for folder in (above and above.submodule_search_locations) or ():
        for file in (Path(folder) / child / "__init__.py", Path(folder) / f"{child}.py"):
            if file.is_file():
                inner = [str(file.parent)] if file.stem == "__init__" else None
                return importlib.util.spec_from_file_location(
                    name, file, submodule_search_locations=inner
                )
    return None


def _is_flexbe_core(name: str) -> bool:
    return name.partition(".")[0] == "flexbe_core"


def _imports(name: str, wanted: Callable[[str], bool], seen: set[str] | None = None) -> bool:
    """Whether a module imports one of the wanted names, itself or by modules of its package."""
    spec = _spec(name)
    if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
        return False
    package = name if spec.submodule_search_locations else name.rpartition(".")[0]
    found = imported_names(spec.origin, package)
    if any(map(wanted, found)):
        return True
    top, seen = name.partition(".")[0], set() if seen is None else seen
    seen.add(name)
    inner = (one for one in found if one.partition(".")[0] == top and one not in seen)
    return any(_imports(one, wanted, seen) for one in inner)


def _builtins() -> dict[str, Any]:
    own = dict(vars(builtins))
    own |= {"basestring": str, "unicode": str, "long": int, "xrange": range}
    own |= {"__import__": _import, "print": _print}
    return own


def _print(*values: Any, sep: str | None = None, **_named: Any) -> None:
    from cobodeck.flexbe_states.ros import current_bridge

    current_bridge().note((" " if sep is None else sep).join(map(str, values)))


def _import(
    name: str,
    globals_: Mapping[str, Any] | None = None,
    locals_: Mapping[str, Any] | None = None,
    fromlist: tuple[str, ...] | None = (),
    level: int = 0,
) -> ModuleType:
    """The `import` of FlexBE modules."""
    from cobodeck.flexbe_states.ros import stand_in

    package = (globals_ or {}).get("__package__") or ""
    full = importlib.util.resolve_name("." * level + name, package) if level else name
    found = stand_in(full)
    if found is not None:
        return found if fromlist else _top(full)
    for module in _inner(full, fromlist or ()):
        import_flexbe(module)
    return builtins.__import__(name, globals_, locals_, fromlist or (), level)


def _top(name: str) -> ModuleType:
    from cobodeck.flexbe_states.ros import stand_in

    top = stand_in(name.partition(".")[0])
    assert top is not None
    return top


def _inner(name: str, fromlist: tuple[str, ...]) -> Iterator[str]:
    """The modules among those of an import that want stand-ins, too."""
    from cobodeck.flexbe_states.ros import has_stand_in

    for candidate in (name, *(f"{name}.{child}" for child in fromlist if child != "*")):
        if candidate in sys.modules or candidate.partition(".")[0] in sys.stdlib_module_names:
            continue
        if _imports(candidate, has_stand_in):
            yield candidate
