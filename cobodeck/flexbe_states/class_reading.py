"""What modules of FlexBE states say about their classes, read from the text; nothing is run.

Everything that a class says of itself stands in its `__init__`: FlexBE has the outcomes and keys as
arguments of the base class, and the parameters are those of `__init__` itself. What is computed
there is not known here.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from cobodeck.flexbe_states.docstrings import ReadDocstring, read_docstring
from cobodeck.flexbe_states.init_reading import (
    KINDS,
    Names,
    Scope,
    TopicUse,
    arguments_of,
    as_names,
    base_call,
    constants,
    last_name,
    put_in,
    topic_uses,
)
from cobodeck.flexbe_states.old_syntax import python_tree

HOOKS = ("on_start", "on_enter", "execute", "on_pause", "on_resume", "on_exit", "on_stop")
BASES = frozenset(
    (
        "EventState",
        "OperatableState",
        "PreemptableState",
        "LockableState",
        "ManuallyTransitionableState",
        "RosState",
        "MonitoringState",
        "LoopbackState",
    )
)
"""The classes of `flexbe_core` from which states derive."""
_Function = ast.FunctionDef


@dataclass(frozen=True, slots=True)
class FlexbeParameter:
    """A parameter of a state class.

    Attributes:
        required: whether there is no default.
        default: the default, if it is written out; else None.
        written: the default as it stands in the text; empty without one.
    """

    name: str
    required: bool = True
    default: Any = None
    written: str = ""

    @property
    def is_known(self) -> bool:
        """Whether the value of the default is known without running anything."""
        return self.required or self.default is not None or self.written == "None"


@dataclass(frozen=True, slots=True)
class FlexbeClass:
    """A state class, as its text says.

    Attributes:
        about: the parts of its docstring.
        hooks: those of `HOOKS` that it or a base class in the same text defines.
        imports: the modules that its text imports, by the name before the first dot.
        templates: the outcomes and keys by `KINDS`, where `$name` stands for what the parameter
            of that name gives; None if they are computed.
        topics: what it says of ROS topics, services and actions.
        only_python_2: the first line that Python 3 cannot read; 0 if it can be imported.
    """

    name: str
    bases: Names
    file: str
    line: int
    parameters: tuple[FlexbeParameter, ...] = ()
    about: ReadDocstring = field(default_factory=ReadDocstring)
    hooks: Names = ()
    imports: Names = ()
    templates: Mapping[str, Names | None] = field(default_factory=lambda: dict.fromkeys(KINDS, ()))
    topics: tuple[TopicUse, ...] = ()
    only_python_2: int = 0

    @property
    def outcomes(self) -> Names | None:
        """Its outcomes in the order of the text; None if arguments give some, or not known."""
        return self._written("outcomes")

    @property
    def input_keys(self) -> Names | None:
        """Its input keys, as `outcomes`."""
        return self._written("input_keys")

    @property
    def output_keys(self) -> Names | None:
        """Its output keys, as `outcomes`."""
        return self._written("output_keys")

    def _written(self, kind: str) -> Names | None:
        names = self.templates[kind]
        return None if names is None or any(name[:1] == "$" for name in names) else names


def read_state_classes(
    text: str, file: str, others: Iterable[FlexbeClass] = ()
) -> tuple[FlexbeClass, ...]:
    """The state classes of a module, in the order of its text.

    One is a state class if it derives from a base class of `flexbe_core`, from another one here or
    of `others`, or from a class that is imported, and has a hook that takes `userdata`.

    Raises:
        FileError: it is not Python. The statements of Python 2 that are common are read, too; see
            `only_python_2`.
    """
    tree, only_python_2 = python_tree(text, file)
    known = constants(tree.body)
    modules = tuple(dict.fromkeys(_imported(tree)))
    bases_of = {other.name: other for other in others}
    found: dict[str, FlexbeClass] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            bases = tuple(last_name(base) for base in node.bases)
            if _is_state(node, bases, bases_of):
                base = next((bases_of[name] for name in bases if name in bases_of), None)
                read = replace(
                    _read(node, bases, base, known),
                    file=file,
                    imports=modules,
                    only_python_2=only_python_2,
                )
                found[node.name] = bases_of[node.name] = read
    return tuple(found.values())


def _is_state(node: ast.ClassDef, bases: Iterable[str], known: Mapping[str, FlexbeClass]) -> bool:
    if any(base in BASES or base in known for base in bases):
        return True
    return any(bases) and any(
        hook.name in HOOKS and "userdata" in [argument.arg for argument in hook.args.args]
        for hook in _functions(node)
    )


def _read(
    node: ast.ClassDef, bases: Names, base: FlexbeClass | None, module: Mapping[str, Any]
) -> FlexbeClass:
    defined = {function.name: function for function in _functions(node)}
    init = defined.get("__init__")
    scope = Scope(module, node, init)
    read = base or FlexbeClass(node.name, bases, "", 0)
    if init is not None:
        read = _with_init(read, init, scope, is_root=base is None)
    hooks = {*defined, *(base.hooks if base else ())}
    about = read_docstring(ast.get_docstring(node, clean=False))
    if base is not None and not about.about:
        about = base.about
    return replace(
        read,
        name=node.name,
        bases=bases,
        line=node.lineno,
        about=about,
        hooks=tuple(hook for hook in HOOKS if hook in hooks),
        topics=tuple(dict.fromkeys((*read.topics, *topic_uses(node, scope)))),
    )


def _with_init(read: FlexbeClass, init: _Function, scope: Scope, *, is_root: bool) -> FlexbeClass:
    """A class with an `__init__` of its own; `is_root`: it calls that of a class of FlexBE."""
    parameters = tuple(_parameters(init))
    nothing: dict[str, Names | None] = dict.fromkeys(KINDS, None)
    call = base_call(init)
    if call is None:
        return replace(
            read, parameters=parameters, templates=nothing if is_root else read.templates
        )
    taken = KINDS if is_root else tuple(parameter.name for parameter in read.parameters)
    given = arguments_of(call, taken, scope)
    if given is None:
        return replace(read, parameters=parameters, templates=nothing, topics=())
    if is_root:
        templates = {kind: as_names(given[kind]) if kind in given else () for kind in KINDS}
        return replace(read, parameters=parameters, templates=templates)
    defaults = {known.name: known.default for known in read.parameters if not known.required}
    inherited = {kind: put_in(names, given, defaults) for kind, names in read.templates.items()}
    topics = (_topic_with(use, given, defaults) for use in read.topics)
    return replace(read, parameters=parameters, templates=inherited, topics=tuple(topics))


def _topic_with(use: TopicUse, given: Mapping[str, Any], defaults: Mapping[str, Any]) -> TopicUse:
    if use.topic is None:
        return use
    found = put_in((use.topic,), given, defaults)
    return use._replace(topic=found[0] if found else None)


def _parameters(init: _Function) -> Iterator[FlexbeParameter]:
    arguments = init.args
    named = [*arguments.posonlyargs, *arguments.args]
    defaults: list[ast.expr | None] = [None] * (len(named) - len(arguments.defaults))
    pairs = list(zip(named, [*defaults, *arguments.defaults], strict=True))[1:]
    for argument, default in (
        *pairs,
        *zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True),
    ):
        if default is None:
            yield FlexbeParameter(argument.arg)
        else:
            yield FlexbeParameter(argument.arg, False, _literal(default), ast.unparse(default))


def _literal(node: ast.expr) -> Any:
    try:
        return ast.literal_eval(node)
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return None


def _functions(node: ast.ClassDef) -> Iterator[_Function]:
    return (item for item in node.body if isinstance(item, _Function))


def _imported(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]
