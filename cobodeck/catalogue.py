"""What charts can name: state classes, types and signals, both shipped and from projects.

Modules are listed by name and imported when the catalogue is built, so importing this module is
cheap. A module provides all subclasses of `Action` and `Monitor` defined in it; a project's
module may also have `SIGNALS` (a tuple of signals), `TYPES` (types by the name for charts) and
`PARTS` (parts of a robot by name: classes that, called without arguments, give the simulated part).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from cobodeck.console import Problem
from cobodeck.project import Project, projects
from cobodeck.shadows import explained, shadows
from engine.state import Action, Interface, Monitor, State, StateError, interface
from engine.types import Type, from_annotation
from hw.interfaces import PARTS

MODULES = (
    "states.navigation.states",
    "states.arm.states",
    "states.signals.states",
    "behaviors.chase",
    "behaviors.make_room",
    "behaviors.haptic",
    "behaviors.escape",
    "behaviors.inform",
    "behaviors.cornered",
)
CHARTS = Path(__file__).parent.parent / "charts"


@dataclass(frozen=True, slots=True)
class Catalogue:
    """State classes and their interfaces by name, and the types, signals and parts of projects."""

    classes: Mapping[str, type[State]]
    interfaces: Mapping[str, Interface]
    types: Mapping[str, Type]
    own_signals: tuple[Any, ...]
    own_parts: Mapping[str, Callable[[], Any]]
    projects: tuple[Project, ...] = ()

    @property
    def packages(self) -> frozenset[str]:
        """The packages from which drivers may be imported: `hw` and those of the projects."""
        return frozenset(("hw",)).union(*(project.packages for project in self.projects))

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the parts that states may command."""
        return (*PARTS, *self.own_parts)

    @property
    def signal_names(self) -> set[str]:
        """The names of all signals; they are the same for any place and profile."""
        from behaviors.profile import load_profile
        from behaviors.signals import signals
        from hw.robot import load_robot
        from hw.scene import load_scene

        # any scene and profile will do to build them
        profile, scene = load_profile("tuned"), load_scene("lab_a")
        environment = profile.environment(scene.room, load_robot(scene.robot))
        own = {signal.name for signal in self.own_signals}
        return own | {signal.name for signal in signals(environment, profile.settings)}

    def module_of(self, name: str) -> str:
        """The module in which a state class is defined."""
        return self.classes[name].__module__


def catalogue(start: Path | None = None, *, own: bool = True) -> Catalogue:
    """Everything shipped and, if `own`, what the project around `start` and installed ones add.

    Raises:
        Problem: a module cannot be imported, a class is not a valid state, or a name is taken.
    """
    added = projects(start) if own else []
    modules = [_imported(name) for name in MODULES]
    for project in added:
        project.make_importable()
        modules += [_imported(name) for name in project.modules]
    classes: dict[str, type[State]] = {}
    for module in modules:
        _add(classes, module)
    return Catalogue(
        classes=classes,
        interfaces={name: _checked(cls) for name, cls in classes.items()},
        types=_types(modules),
        own_signals=tuple(
            signal for module in modules for signal in getattr(module, "SIGNALS", ())
        ),
        own_parts={
            name: part for module in modules for name, part in getattr(module, "PARTS", {}).items()
        },
        projects=tuple(added),
    )


def shipped_charts() -> list[Path]:
    """The shipped chart files."""
    return sorted(CHARTS.glob("*.yaml"))


def _add(classes: dict[str, type[State]], module: ModuleType) -> None:
    for cls in state_classes(module):
        other = classes.get(cls.__name__)
        if other is not None:
            message = f"{module.__name__}.{cls.__name__}: a state of this name is also in"
            raise Problem(f"{message} {other.__module__}; name it otherwise")
        classes[cls.__name__] = cls


def state_classes(module: ModuleType) -> Iterator[type[State]]:
    """The state classes defined in a module."""
    for value in vars(module).values():
        if not isinstance(value, type) or value.__module__ != module.__name__:
            continue
        if issubclass(value, Action | Monitor) and not value.__name__.startswith("_"):
            yield value


def _checked(cls: type[State]) -> Interface:
    try:
        return interface(cls)  # type: ignore[arg-type]  # classes can be hashed
    except (StateError, TypeError, NameError) as error:
        import inspect

        line = inspect.getsourcelines(cls)[1]
        raise Problem(f"{inspect.getsourcefile(cls)}:{line}: {error}") from None


def _types(modules: Iterable[ModuleType]) -> dict[str, Type]:
    found: dict[str, Type] = {}
    for module in (_imported("behaviors.signals"), *modules):
        for name, annotation in getattr(module, "TYPES", {}).items():
            is_type = isinstance(annotation, Type)
            found[name] = annotation if is_type else from_annotation(annotation)
    return found


def _imported(name: str) -> ModuleType:
    """Import a module; any exception becomes a Problem with file and line."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if hidden := shadows():
            raise Problem(explained(hidden)) from None
        if error.name is not None and name.startswith(error.name):
            raise Problem(f"no module {name!r}, named under {_POINTS}") from None
        raise Problem(_where(error, f"importing {name}")) from None
    except (Exception, SystemExit) as error:  # noqa: BLE001  a user's module may raise anything
        raise Problem(_where(error, f"importing {name}")) from None


_POINTS = '[project.entry-points."cobodeck.states"] of a pyproject.toml'


def _where(error: BaseException, doing: str) -> str:
    """`file:line: what`, of the innermost frame outside Python's import machinery."""
    import traceback

    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}:{error.lineno}: {error.msg} (while {doing})"
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if not frame.filename.startswith("<frozen") and frame.filename != importlib.__file__
    ]
    last = frames[-1]
    return f"{last.filename}:{last.lineno}: {type(error).__name__}: {error} (while {doing})"
