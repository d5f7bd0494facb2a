"""The face of a folder: what its `__init__` offers, from the stub beside it, loaded when asked for.

`__init__.pyi` names what others may use, one import for each module; type checkers read it as it
stands, and `face` reads it at run time: a name is imported with its module when it is first asked
for. So nobody pays for what they do not use, and a file can move without its users.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

_IMPORT = re.compile(r"^from (\S+) import (?:\(([^)]*)\)|(.*))$", re.MULTILINE)
_NAME = re.compile(r"(\w+) as \1\b")


def _stub(package: str) -> Path:
    spec = find_spec(package)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).with_suffix(".pyi")


def offers(package: str) -> bool:
    """Whether a package has a face."""
    return _stub(package).exists()


@cache
def homes(package: str) -> Mapping[str, str]:
    """The module of each name that a package offers; of a module that it offers, the package."""
    stub = _stub(package).read_text(encoding="utf-8")
    return {
        name: module
        for module, several, one in _IMPORT.findall(stub)
        for name in _NAME.findall(several or one)
    }


def face(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package that offers what its stub names."""

    def __getattr__(name: str) -> Any:
        module = homes(package).get(name)
        if module is None or module == package:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(module), name)
        setattr(import_module(package), name, value)
        return value

    return __getattr__, lambda: sorted(homes(package))
