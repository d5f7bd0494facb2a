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
Names = tuple[str, ...]


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
        outcomes: in the order of the text; None if they depend on arguments or are computed.
        input_keys: as `outcomes`.
        output_keys: as `outcomes`.
        about: the parts of its docstring.
        hooks: those of `HOOKS` that it or a base class in the same text defines.
        imports: the modules that its text imports, by the name before the first dot.
        only_python_2: the first line that Python 3 cannot read; 0 if it can be imported.
    """

    name: str
    bases: Names
    file: str
    line: int
    outcomes: Names | None = ()
    input_keys: Names | None = ()
    output_keys: Names | None = ()
    parameters: tuple[FlexbeParameter, ...] = ()
    about: ReadDocstring = field(default_factory=ReadDocstring)
    hooks: Names = ()
    imports: Names = ()
    only_python_2: int = 0


def read_state_classes(text: str, file: str) -> tuple[FlexbeClass, ...]:
    """The state classes of a module, in the order of its text.

    One is a state class if it derives from a base class of `flexbe_core`, from another one here, or
    from a class that is imported, and has a hook that takes `userdata`.

    Raises:
        FileError: it is not Python. The statements of Python 2 that are common are read, too; see
            `only_python_2`.
    """
    tree, only_python_2 = python_tree(text, file)
    constants = _constants(tree.body)
    modules = tuple(dict.fromkeys(_imported(tree)))
    found: dict[str, FlexbeClass] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            bases = tuple(_last_name(base) for base in node.bases)
            if _is_state(node, bases, found):
                base = next((found[name] for name in bases if name in found), None)
                read = _read(node, bases, base, constants)
                found[node.name] = replace(
                    read, file=file, imports=modules, only_python_2=only_python_2
                )
    return tuple(found.values())


def _is_state(node: ast.ClassDef, bases: Iterable[str], found: Mapping[str, FlexbeClass]) -> bool:
    if any(base in BASES or base in found for base in bases):
        return True
    return any(bases) and any(
        hook.name in HOOKS and "userdata" in [argument.arg for argument in hook.args.args]
        for hook in _functions(node)
    )


def _read(
    node: ast.ClassDef, bases: Names, base: FlexbeClass | None, constants: Mapping[str, Any]
) -> FlexbeClass:
    defined = {function.name: function for function in _functions(node)}
    hooks = {*defined, *(base.hooks if base else ())}
    about = read_docstring(ast.get_docstring(node, clean=False))
    init = defined.get("__init__")
    read = base or FlexbeClass(node.name, bases, "", 0)
    if init is not None:
        known = {**constants, **_constants(node.body), **_constants(init.body)}
        for parameter in (*init.args.args, *init.args.kwonlyargs):
            known.pop(parameter.arg, None)
        outcomes, inputs, outputs = _declared(init, base, known)
        parameters = tuple(_parameters(init))
        read = replace(
            read, outcomes=outcomes, input_keys=inputs, output_keys=outputs, parameters=parameters
        )
    if base is not None and not about.about:
        about = base.about
    return replace(
        read,
        name=node.name,
        bases=bases,
        line=node.lineno,
        about=about,
        hooks=tuple(hook for hook in HOOKS if hook in hooks),
    )


def _declared(
    init: _Function, base: FlexbeClass | None, known: Mapping[str, Any]
) -> tuple[Names | None, Names | None, Names | None]:
    """Outcomes, input keys and output keys that `__init__` gives to its base class."""
    kinds = ("outcomes", "input_keys", "output_keys")
    call = next(filter(None, map(_base_call, ast.walk(init))), None)
    if call is None:
        return (None, None, None) if base is None else (base.outcomes, *_keys_of(base))
    given = {keyword.arg: keyword.value for keyword in call.keywords}
    if None in given:  # **kwargs
        return None, None, None
    if base is None or base.parameters == ():
        given = {**dict(zip(kinds, _after_self(call), strict=False)), **given}
    inherited = {kind: getattr(base, kind) if base else () for kind in kinds}
    found = [_names(given[kind], known) if kind in given else inherited[kind] for kind in kinds]
    return found[0], found[1], found[2]


def _keys_of(base: FlexbeClass) -> tuple[Names | None, Names | None]:
    return base.input_keys, base.output_keys


def _base_call(node: ast.AST) -> ast.Call | None:
    """The node, if it calls an `__init__`: by `super()`, `super(Cls, self)` or `Base`."""
    is_init = (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "__init__"
    )
    return node if is_init else None  # type: ignore[return-value]


def _after_self(call: ast.Call) -> list[ast.expr]:
    first = call.args[:1]
    has_self = bool(first) and isinstance(first[0], ast.Name) and first[0].id == "self"
    return call.args[1:] if has_self else call.args


def _names(node: ast.expr, known: Mapping[str, Any]) -> Names | None:
    """The names that an expression stands for; None if it is not written out."""
    value = _value(node, known)
    if isinstance(value, list | tuple) and all(isinstance(name, str) for name in value):
        return tuple(value)
    return None


def _value(node: ast.expr, known: Mapping[str, Any]) -> Any:
    """What an expression of texts, lists, sums and known names is; None if it is anything else."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    if isinstance(node, ast.Attribute):
        return known.get(node.attr)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        sides = _value(node.left, known), _value(node.right, known)
        return sides[0] + sides[1] if type(sides[0]) is type(sides[1]) in (list, str) else None
    if isinstance(node, ast.List | ast.Tuple):
        return [_value(item, known) for item in node.elts]
    return node.value if isinstance(node, ast.Constant) else None


def _constants(body: Iterable[ast.stmt]) -> dict[str, Any]:
    """What is written out for names that are given once among these statements, also `self.x`."""
    found: dict[str, Any] = {}
    for statement in body:
        if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
            name = _last_name(statement.targets[0])
            found[name] = None if name in found else _value(statement.value, found)
        elif isinstance(statement, ast.AugAssign | ast.For | ast.If | ast.While | ast.Try):
            for node in ast.walk(statement):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                    found[node.id] = None
    return {name: value for name, value in found.items() if name and value is not None}


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


def _last_name(node: ast.expr) -> str:
    """The last name of `a.b.c`; empty for any other expression."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""
