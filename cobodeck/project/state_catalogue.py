"""What charts can name: state classes, types and signals, both shipped and from projects.

Modules are listed by name and imported when the catalogue is built, so importing this module is
cheap. A module provides all subclasses of `Action` and `Monitor` defined in it; a project's
module may also have `SIGNALS` (a tuple of signals), `TYPES` (types by the name for charts) and
`PARTS` (parts of a robot by name: classes that, called without arguments, give the simulated part).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from cobodeck.project.named_files import kind_of
from cobodeck.project.old_names import OLD_CHARTS, OLD_STATES
from cobodeck.project.own_code import (
    doubts_in,
    is_adapted,
    line_of,
    mistakes_in,
    state_classes,
    strangers,
)
from cobodeck.project.part_check import place_of
from cobodeck.project.project import Project, projects
from cobodeck.shadowed import explained, shadows
from cobodeck.terminal import FAILED, Problem
from engine import Interface, State, Type, from_annotation, interface
from engine.files import FileError
from engine.signals import Signal, declare
from hw import PARTS, Pose2

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from cobodeck.flexbe_states import TopicTable

MODULES = (
    "states.watching.states",
    "states.data.states",
    "states.navigation.states",
    "states.arm.states",
    "states.gripper.states",
    "states.signals.states",
    "behaviors.chase.chase_states",
    "behaviors.chase.make_room",
    "behaviors.haptic",
    "behaviors.escape.escape_states",
    "behaviors.escape.paper_escape",
    "behaviors.inform",
    "behaviors.chase.cornered",
)
CHARTS = Path(__file__).parent.parent.parent / "charts"


class KnownPlaces(NamedTuple):
    """Places of scenes by name; not `complete` if one of the scenes has mistakes, and no places."""

    by_name: Mapping[str, Pose2]
    complete: bool


@dataclass(frozen=True)
class Catalogue:
    """State classes and their interfaces by name, and the types, signals and parts of projects.

    `modules` are those of projects; `strangers` says what else these have, and what there was, by
    name, and why it is no state. `doubts` are messages about code of theirs that can run and is
    hardly meant.
    """

    classes: Mapping[str, type[State]]
    interfaces: Mapping[str, Interface]
    types: Mapping[str, Type]
    own_signals: tuple[Signal, ...]
    own_parts: Mapping[str, Callable[[], Any]]
    projects: tuple[Project, ...] = ()
    strangers: Mapping[str, str] = field(default_factory=dict)
    modules: tuple[ModuleType, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def packages(self) -> frozenset[str]:
        """The packages from which drivers may be imported: `hw` and those of the projects."""
        return frozenset(("hw",)).union(*(project.packages for project in self.projects))

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the parts that states may command."""
        return (*PARTS, *self.own_parts)

    @property
    def signal_names(self) -> Collection[str]:
        """The names of all signals."""
        return self.signals.keys()

    @cached_property
    def tuned(self) -> Profile:
        """The default profile, by which charts are checked before one is chosen."""
        from behaviors.profile import load_profile

        return load_profile("tuned")

    @cached_property
    def places(self) -> KnownPlaces:
        """The places of all shipped scenes and those of projects."""
        from hw.scene import scene_names

        return places_of(scene_names())

    @cached_property
    def topics(self) -> TopicTable:
        """The tables of topics of projects together."""
        return _Table(self.projects).read

    @cached_property
    def signals(self) -> Mapping[str, Signal]:
        """All signals by name; names and types are the same for any place and profile.

        Raises:
            Problem: a signal of a project clashes with another, or depends on an unknown one.
        """
        from behaviors import signals
        from hw.model import load_robot
        from hw.scene import Room

        # any room, robot and profile will do to build them
        room = Room(((0.0, 0.0), (9.0, 0.0), (9.0, 9.0)))
        environment = self.tuned.environment(room, load_robot("rbkairos_ur10"))
        return self.declared(signals(environment, self.tuned.settings))

    def declared(self, shipped: Iterable[Signal]) -> dict[str, Signal]:
        """The shipped signals and those of projects, by name.

        Raises:
            Problem: a signal of a project clashes with another, or depends on an unknown one.
        """
        try:
            return declare((*shipped, *self.own_signals))
        except ValueError as error:
            raise Problem(f"{self._place_in(str(error))}{error}", FAILED) from None

    def _place_in(self, message: str) -> str:
        """The place of the first signal of a project that a message names."""
        for module in self.modules:
            for signal in getattr(module, "SIGNALS", ()):
                if repr(signal.name) in message:
                    return line_of(module, "SIGNALS", signal.name)
        return ""

    def module_of(self, name: str) -> str:
        """The module in which a state class is defined."""
        return self.classes[name].__module__


def catalogue(start: Path | None = None, *, own: bool = True) -> Catalogue:
    """Everything shipped and, if `own`, what the project around `start` and installed ones add.

    Raises:
        Problem: a module cannot be imported, a class is not a valid state, or a name is taken.
    """
    added = projects(start) if own else []
    shipped = [_imported(name) for name in MODULES]
    for project in added:
        project.make_importable()
    table = _Table(added)
    modules = [
        module for project in added for name in project.modules for module in _modules(name, table)
    ]
    mistakes = [mistake for module in modules for mistake in mistakes_in(module)]
    classes: dict[str, type[State]] = {}
    for module in (*shipped, *modules):
        mistakes += _add(classes, module)
    types = _types((_imported("behaviors.signal_table"), *shipped))
    if not mistakes:
        mistakes = _clashes("TYPES", types, modules) + _clashes("PARTS", {}, modules)
    if mistakes:
        raise Problem("\n".join(mistakes), FAILED)
    return Catalogue(
        classes=classes,
        interfaces={name: interface(cls) for name, cls in classes.items()},  # type: ignore[arg-type]
        types=types | _types(modules),
        own_signals=tuple(
            signal for module in modules for signal in getattr(module, "SIGNALS", ())
        ),
        own_parts={
            name: part for module in modules for name, part in getattr(module, "PARTS", {}).items()
        },
        projects=tuple(added),
        strangers={
            **OLD_CHARTS,
            **OLD_STATES,
            **{name: why for module in modules for name, why in strangers(module).items()},
        },
        modules=tuple(modules),
        doubts=tuple(doubt for module in modules for doubt in doubts_in(module)),
    )


class _Table:
    """The tables of topics of projects, read when the first FlexBE state wants them."""

    def __init__(self, added: Iterable[Project]) -> None:
        self._projects = tuple(added)

    @cached_property
    def read(self) -> TopicTable:
        """All of them together."""
        from cobodeck.flexbe_states import load_topics

        files = (file for project in self._projects for file in project.yaml_files())
        return load_topics(file for file in files if kind_of(file) == "topics")


def _modules(name: str, table: _Table) -> Iterator[ModuleType]:
    """The module of this name, and those of FlexBE states in it if it is a package.

    A module of a package that cannot be imported is left out, and its states are strangers.
    """
    from cobodeck.flexbe_states import flexbe_modules

    flexbe = flexbe_modules(name)
    if name not in flexbe:
        yield _imported(name)
    for inner in flexbe:
        from cobodeck.flexbe_states import broken_module, state_module

        topics = table.read
        try:
            yield state_module(inner, topics)
        except (Exception, SystemExit) as error:  # noqa: BLE001  a user's module may raise anything
            told = _where(error, f"importing {inner}")
            if inner == name:
                raise Problem(told) from None
            yield broken_module(inner, told)


def places_of(scenes: Iterable[str]) -> KnownPlaces:
    """The places in these scenes; the mistakes in a scene are reported elsewhere."""
    from hw.scene import load_scene

    found: dict[str, Pose2] = {}
    complete = True
    for scene in scenes:
        try:
            found |= load_scene(scene).places
        except FileError:
            complete = False
    return KnownPlaces(found, complete)


def shipped_charts() -> list[Path]:
    """The shipped chart files."""
    return [*sorted(CHARTS.glob("*.yaml")), *sorted((CHARTS / "paper").glob("*.yaml"))]


def _add(classes: dict[str, type[State]], module: ModuleType) -> list[str]:
    """Add the state classes of a module; returns a message for each name that is taken."""
    taken = []
    for cls in list(state_classes(module)):
        other = classes.setdefault(cls.__name__, cls)
        if other is not cls:
            message = f"{module.__name__}.{cls.__name__}: a state of this name is also in"
            told = f"{place_of(cls)}{message} {other.__module__}; name it otherwise"
            if not _left_out(cls, module, told):
                taken.append(told)
    return taken


def _left_out(cls: type[State], module: ModuleType, why: str) -> bool:
    """Whether it is a state written for FlexBE, which is left out: the others can be had."""
    if not is_adapted(module):
        return False
    from cobodeck.flexbe_states import leave_out

    return leave_out(cls, module, why)


def _clashes(table: str, known: Mapping[str, Any], modules: Iterable[ModuleType]) -> list[str]:
    """A message for each name in such a table of a project that stands for something else, too."""
    taken, found = dict(known), []
    for module in modules:
        for name, value in getattr(module, table, {}).items():
            if taken.setdefault(name, value) is not value:
                where = line_of(module, table, name)
                found.append(f"{where}{table}: {name!r} is taken already; name it otherwise")
    return found


def _types(modules: Iterable[ModuleType]) -> dict[str, Type]:
    found: dict[str, Type] = {}
    for module in modules:
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
