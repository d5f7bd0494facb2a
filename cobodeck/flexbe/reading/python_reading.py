"""Generated behaviours of FlexBE 1 to 4, read from their text; nothing of them is run.

`_Reader` walks `__init__` for parameters and embedded behaviours, and `create` for containers,
userdata, private variables and the states that are added. Whatever is no literal is kept as the
text of the expression, as `ast.unparse` writes it.
"""

from __future__ import annotations

import ast
import json
import re
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

from cobodeck.flexbe.behaviour import ROOT, Behaviour
from cobodeck.flexbe.reading.source_text import comments_in, manual_blocks, tree_of
from engine.files import mistake

KINDS = {
    "OperatableStateMachine": "statemachine",
    "StateMachine": "statemachine",
    "ConcurrencyContainer": "concurrency",
    "PriorityContainer": "priority",
}
_ADDED = ("label", "state")
_OF_STATE = ("transitions", "autonomy", "remapping")


def is_behaviour(text: str) -> bool:
    """Whether Python code looks like a behaviour: a class of one with a `create`."""
    return bool(re.search(r"^class\s+\w+\s*\([^)]*Behavior", text, re.MULTILINE)) and bool(
        re.search(r"^\s+def\s+create\s*\(", text, re.MULTILINE)
    )


def read_python(text: str, file: str, name: str) -> Behaviour:
    """The behaviour in a module.

    Raises:
        FileError: it is not Python, or there is no behaviour in it.
    """
    tree = tree_of(text, file)
    cls = _behaviour_class(tree)
    if cls is None:
        wanted = "a class derived from Behavior with a method `create`"
        raise mistake(file, "there is no FlexBE behaviour here", 1, f"wanted: {wanted}")
    reader = _Reader(file)
    reader.read_constants(tree)
    reader.variables |= dict(_functions(tree, cls))
    for function in cls.body:
        if isinstance(function, ast.FunctionDef) and function.name == "__init__":
            reader.read_init(function)
        elif isinstance(function, ast.FunctionDef) and function.name == "create":
            reader.read_create(function.body)
            reader.name_root(function)
            for variable in _changed(function):
                reader.variables.pop(variable, None)
    if ROOT not in reader.containers:
        hint = f"`create` makes none named {ROOT}, and returns none"
        raise mistake(file, "the behaviour has no state machine", cls.lineno, hint)
    return Behaviour(
        name=name,
        json=reader.json(),
        class_name=cls.name,
        about=ast.get_docstring(cls) or "",
        file=file,
        userdata=reader.userdata,
        variables=reader.variables,
        comments=tuple(comments_in(text)),
        manual=tuple(manual_blocks(text)),
        is_python=True,
    )


def _behaviour_class(tree: ast.Module) -> ast.ClassDef | None:
    """The first class with a `create`; one that derives from `Behavior` comes before others."""
    found: list[tuple[bool, int, ast.ClassDef]] = []
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and any(
            isinstance(item, ast.FunctionDef) and item.name == "create" for item in node.body
        ):
            derives = any("Behavior" in ast.unparse(base) for base in node.bases)
            found.append((not derives, len(found), node))
    return min(found)[2] if found else None


class _Reader:
    """What is found on the way through one class."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.behaviors: list[list[Any]] = []
        self.parameters: dict[str, Any] = {}
        self.containers: dict[str, dict[str, Any]] = {}
        self.userdata: dict[str, dict[str, str]] = {}
        self.variables: dict[str, str] = {}

    def json(self) -> dict[str, Any]:
        """The neutral JSON."""
        return {
            "behaviors": self.behaviors,
            "parameters": self.parameters,
            "containers": self.containers,
            "root": None,
        }

    def read_constants(self, tree: ast.Module) -> None:
        """Values that the module gives names, as far as these keep them."""
        stored = Counter(n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and _stores(n))
        for node in tree.body:
            if isinstance(node, ast.Assign):
                names = [target.id for target in node.targets if isinstance(target, ast.Name)]
                text = ast.unparse(node.value)
                self.variables.update((name, text) for name in names if stored[name] == 1)

    def name_root(self, create: ast.FunctionDef) -> None:
        """The container that `create` returns is the outermost one, whatever its name is."""
        for node in create.body:
            if isinstance(node, ast.Return) and isinstance(node.value, ast.Name):
                name = node.value.id
                if ROOT not in self.containers and name in self.containers:
                    root = {ROOT: self.containers.pop(name)}
                    self.containers = root | self.containers
                    self.userdata[ROOT] = self.userdata.pop(name, {})

    def read_init(self, function: ast.FunctionDef) -> None:
        """Parameters and embedded behaviours, in the order of the text."""
        for node in (node for statement in function.body for node in ast.walk(statement)):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            if node.func.attr == "add_parameter" and len(node.args) > 1:
                self.parameters[str(_plain(node.args[0]))] = _plain(node.args[1])
            elif node.func.attr == "add_behavior" and len(node.args) > 1:
                self.behaviors.append([ast.unparse(node.args[0]), _plain(node.args[1])])

    def read_create(self, body: list[ast.stmt]) -> None:
        """The statements of `create`."""
        for statement in body:
            if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
                self._assignment(statement.targets[0], statement.value)
            elif isinstance(statement, ast.With):
                self._filled(statement)

    def _assignment(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Name):
            kind = KINDS.get(_last_name(value.func)) if isinstance(value, ast.Call) else None
            if kind is not None and isinstance(value, ast.Call):
                self._container(target.id, kind, value)
            else:
                self.variables[target.id] = ast.unparse(value)
        elif isinstance(target, ast.Attribute) and isinstance(target.value, ast.Attribute):
            machine = target.value.value
            if target.value.attr == "userdata" and isinstance(machine, ast.Name):
                self.userdata.setdefault(machine.id, {})[target.attr] = ast.unparse(value)

    def _container(self, name: str, kind: str, call: ast.Call) -> None:
        container: dict[str, Any] = {"kind": kind, "states": []}
        names = ("outcomes", "input_keys", "output_keys", "conditions")
        for key, argument in zip(names, call.args, strict=False):
            container[key] = _plain(argument)
        for keyword in call.keywords:
            if keyword.arg is not None:
                container[keyword.arg] = _plain(keyword.value)
        self.containers[name] = container

    def _filled(self, statement: ast.With) -> None:
        """The states that are added within `with container:`."""
        opened = statement.items[0].context_expr
        container = self.containers.get(opened.id) if isinstance(opened, ast.Name) else None
        if container is None:
            self.read_create(statement.body)
            return
        for node in (node for inner in statement.body for node in _calls(inner)):
            given = [*node.args, *(key.value for key in node.keywords if key.arg in _ADDED)]
            if _last_name(node.func) == "add" and len(given) > 1:
                container["states"].append(self._state(node, *given[:2]))

    def _state(self, call: ast.Call, label: ast.expr, of: ast.expr) -> dict[str, Any]:
        name = _plain(label)
        state: dict[str, Any] = {"name": name if isinstance(name, str) else ast.unparse(label)}
        if isinstance(of, ast.Name) and of.id in self.variables:
            of = ast.parse(self.variables[of.id], mode="eval").body
        if isinstance(of, ast.Name) and of.id in self.containers:
            state["container"] = of.id
        elif isinstance(of, ast.Call):
            embeds = _last_name(of.func) == "use_behavior" and bool(of.args)
            given = of.args[2:] if embeds else of.args
            state["behavior" if embeds else "class"] = ast.unparse(
                of.args[0] if embeds else of.func
            )
            state["args"] = {key.arg: _plain(key.value) for key in of.keywords if key.arg}
            state["pos"] = [_plain(argument) for argument in given]
        else:
            state |= {"class": ast.unparse(of), "args": {}, "pos": []}
        further = dict(zip(_OF_STATE, call.args[2:], strict=False))
        further |= {key.arg: key.value for key in call.keywords if key.arg in _OF_STATE}
        for key in _OF_STATE:
            if key in further:
                state[key] = self._mapping(
                    further[key], ast.unparse if key == "autonomy" else _name
                )
        return state

    def _mapping(self, node: ast.expr, read: Callable[[ast.expr], str]) -> dict[str, str]:
        """What outcomes or keys are mapped to; nothing where only running the code would tell."""
        if isinstance(node, ast.Name) and node.id in self.variables:
            node = ast.parse(self.variables[node.id], mode="eval").body
        if isinstance(node, ast.Call) and _last_name(node.func) == "dict":
            return {key.arg: read(key.value) for key in node.keywords if key.arg is not None}
        if not isinstance(node, ast.Dict):
            return {}
        pairs = zip(node.keys, node.values, strict=True)
        return {_name(key): read(value) for key, value in pairs if key is not None}


def _functions(tree: ast.Module, cls: ast.ClassDef) -> Iterator[tuple[str, str]]:
    """The functions and methods that only return something, by name, as lambdas."""
    for node, is_method in (*((n, False) for n in tree.body), *((n, True) for n in cls.body)):
        if not isinstance(node, ast.FunctionDef):
            continue
        *before, last = node.body
        is_static = [ast.unparse(given) for given in node.decorator_list] == ["staticmethod"]
        documented = not before or (len(before) == 1 and ast.get_docstring(node) is not None)
        if not documented or not isinstance(last, ast.Return) or last.value is None:
            continue
        if node.decorator_list and not is_static:
            continue
        if is_method and not is_static:
            if not node.args.args or node.args.args[0].arg != "self":
                continue
            node.args.args = node.args.args[1:]
        name = f"self.{node.name}" if is_method else node.name
        for argument in (*node.args.args, *node.args.kwonlyargs):
            argument.annotation = None
        yield name, ast.unparse(ast.Lambda(node.args, last.value))


def _changed(function: ast.FunctionDef) -> set[str]:
    """The variables that are given a value more than once, or may be changed in place."""
    found, stored = set(), Counter[str]()
    for node in ast.walk(function):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            stored[node.id] += 1
        elif isinstance(node, ast.AugAssign | ast.Delete | ast.For) or (
            isinstance(node, ast.Subscript | ast.Attribute) and not isinstance(node.ctx, ast.Load)
        ):
            found |= {inner.id for inner in ast.walk(node) if isinstance(inner, ast.Name)}
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            called = node.value.func
            if isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name):
                found.add(called.value.id)
    return found | {name for name, times in stored.items() if times > 1}


def _stores(node: ast.Name) -> bool:
    return isinstance(node.ctx, ast.Store)


def _calls(statement: ast.stmt) -> Iterator[ast.Call]:
    """The calls that are statements of their own, also those in an `if` or a loop."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
        yield statement.value
    for inner in ast.iter_child_nodes(statement):
        if isinstance(inner, ast.stmt):
            yield from _calls(inner)


def _name(node: ast.expr) -> str:
    """The text that a literal is, or else the code."""
    found = _plain(node)
    return ast.unparse(node) if isinstance(found, dict | list) else str(found)


def _plain(node: ast.expr) -> Any:
    """A literal as JSON has it, or `{"expr": …}`."""
    try:
        return json.loads(json.dumps(ast.literal_eval(node)))
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return {"expr": ast.unparse(node)}


def _last_name(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""
