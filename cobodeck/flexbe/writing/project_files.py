"""The files of the project that an import makes: charts, states, a test, and what is left."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from pathlib import Path

from cobodeck.flexbe.behaviour import Behaviour
from cobodeck.flexbe.converting import Conversion, StateClass
from cobodeck.flexbe.writing.chart_text import yaml_of
from cobodeck.flexbe.writing.state_modules import is_written, ready_module, stub_module
from cobodeck.flexbe_states import TopicTable

ProjectFiles = dict[str, str]
"""Texts by path in the project."""
_PYPROJECT = """\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "{name}"
version = "0.1.0"
requires-python = ">=3.11"
dependencies = ["cobodeck"]

# cobodeck finds the states and charts of this package by these entries
[project.entry-points."cobodeck.states"]
{entries}

[tool.setuptools]
packages = [{packages}]
package-data = {{{name} = ["charts/*.yaml"]}}

[tool.pytest.ini_options]
testpaths = ["tests"]
pythonpath = ["."]
"""
_README = """\
# {name}

Charts made from behaviours of FlexBE.

| file | what |
|---|---|
| `{name}/charts/*.yaml` | one chart for each behaviour |
| `{name}/stubs.py` | states that still have to be written |
| `{name}/ready.py` | states of FlexBE itself, and code of the behaviours, translated |
| `WORK.md` | what is left to do, and what is not the same as in FlexBE |
| `tests/test_charts.py` | walks every outcome of every state |
{manual}
In this folder:

    cobodeck validate
    cobodeck render {first} -o {first}.svg
    pytest

Write a state: move its class from `stubs.py` to a module of its own that `pyproject.toml` names
under `cobodeck.states`, and write its `run`.
"""
_TEST = '''\
"""Every outcome of every state is walked, with scripted states in virtual time."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from cobodeck.project import Catalogue, catalogue, open_chart
from engine.machine import LeafScript, Machine, explore
from engine.run import ChartRun

PROJECT = Path(__file__).parent.parent
CHARTS = sorted((PROJECT / "{name}" / "charts").glob("*.yaml"))
TICK_NS = 10**8
MOST = 10_000  # configurations; a chart with more of them may still show all its outcomes in these


@cache
def known() -> Catalogue:
    return catalogue(PROJECT)


def machine_of(file: Path) -> Machine:
    chart, library = open_chart(str(file), known())
    return Machine(chart, library, known().interfaces, types=known().types)


def walked(machine: Machine, script) -> set[tuple[str, str]]:
    """The outcomes that a run takes whose states end as the script says."""
    states = LeafScript(machine)
    run = ChartRun(machine, stand_ins=states.stand_ins)
    run.tick(0)
    for number, step in enumerate(script):
        for path, outcome in step:
            states.end(path, outcome)
        for tick in range(3):  # what was left in a tick is entered again in the next
            run.tick((3 * number + tick + 1) * TICK_NS)
    return {{(r.subject, *r.detail) for r in run.trace if r.kind == "outcome"}}


@pytest.mark.parametrize("file", CHARTS, ids=lambda file: file.stem)
def test_every_outcome_is_walked(file):
    machine = machine_of(file)
    found = explore(machine, MOST)
    outcomes = {{(v.path, o) for v in machine.vertices.values() for o in (*v.go, *v.leave)}}
    assert found.complete or outcomes <= found.moves.keys()
    for edge, script in found.moves.items():
        assert edge in walked(machine, script)
'''


def files_of_project(
    name: str, behaviours: Iterable[Behaviour], conversion: Conversion
) -> ProjectFiles:
    """All files, by their paths; `name` is that of the package."""
    by_name = {behaviour.name: behaviour for behaviour in behaviours}
    made = [cls for cls in conversion.classes.values() if not cls.adapted]
    stubs = [cls for cls in made if not is_written(cls)]
    ready = [cls for cls in made if is_written(cls)]
    originals = _originals(name, conversion)
    modules = {"stubs": stub_module(stubs)} | ({"ready": ready_module(ready)} if ready else {})
    manual = manual_code(by_name.values())
    row = "| `MANUAL_CODE.md` | the code between `[MANUAL_…]` tags, as it was |\n" if manual else ""
    first = next(iter(conversion.charts))
    named = [*modules, *(["flexbe"] if originals else [])]
    entries = "\n".join(f'{name}_{module} = "{name}.{module}"' for module in named)
    packages = f'"{name}", "{name}.flexbe"' if originals else f'"{name}"'
    files = {
        "pyproject.toml": _PYPROJECT.format(name=name, entries=entries, packages=packages),
        "README.md": _README.format(name=name, manual=row, first=first),
        "WORK.md": work(conversion, stubs),
        "tests/test_charts.py": _TEST.format(name=name),
        f"{name}/__init__.py": '"""Charts made from behaviours of FlexBE, and their states."""\n',
    }
    files |= {f"{name}/{module}.py": text for module, text in modules.items()}
    for chart in conversion.charts.values():
        behaviour = by_name.get(chart["chart"])
        comments = behaviour.comments if behaviour is not None else ()
        files[f"{name}/charts/{chart['chart']}.yaml"] = yaml_of(chart, comments)
    files |= originals
    return files | ({"MANUAL_CODE.md": manual} if manual else {})


def _originals(name: str, conversion: Conversion) -> ProjectFiles:
    """The modules of states that run as they are."""
    found = {
        Path(cls.known.file).name: Path(cls.known.file).read_text(encoding="utf-8")
        for cls in conversion.classes.values()
        if cls.adapted and cls.known is not None
    }
    if not found:
        return {}
    about = '"""States written for FlexBE, as they were."""\n'
    return {
        f"{name}/flexbe/{file}": text for file, text in ({"__init__.py": about} | found).items()
    }


def work(conversion: Conversion, stubs: Iterable[StateClass]) -> str:
    """The text of the list of what is left."""
    return "\n".join([*_work_lines(conversion, stubs), ""])


def _work_lines(conversion: Conversion, stubs: Iterable[StateClass]) -> Iterator[str]:
    yield "# What is left"
    yield ""
    yield "## States to write"
    yield ""
    for cls in stubs:
        yield f"- [ ] `{cls.name}`, for `{cls.flexbe}`, first used by {cls.state or 'a chart'}"
        yield from (f"  - as this did: {_code(code)}" for code in cls.code)
        yield from (f"  - to run it as it is, {line}" for line in _topic_lines(cls))
    adapted = [cls.name for cls in conversion.classes.values() if cls.adapted]
    if adapted:
        yield from ("", "These run as they are: " + ", ".join(map(_code, adapted)) + ".")
    if conversion.left:
        yield from ("", "## In the charts")
    for chart, items in groupby(conversion.left, lambda left: left.chart):
        yield from ("", f"### {chart}", "")
        for left in items:
            where = f"`{left.path}`: " if left.path else ""
            yield f"- [ ] {where}{left.what}{f': {_code(left.code)}' if left.code else ''}"
    if conversion.notes:
        yield from ("", "## Not the same as in FlexBE", "")
    for note in conversion.notes:
        yield f"- {note}"


def _topic_lines(cls: StateClass) -> Iterator[str]:
    """The lines of a table of topics that the class written for FlexBE needs."""
    uses = dict.fromkeys(cls.known.topics) if cls.known is not None and not cls.code else ()
    for link, topic in uses:
        if topic is not None and not topic.startswith("$"):
            yield TopicTable().missing(link, topic).partition("; ")[2]


def _code(code: str) -> str:
    fence = "``" if "`" in code else "`"
    return f"{fence}{' '.join(code.split())}{fence}"


def manual_code(behaviours: Iterable[Behaviour]) -> str:
    """The text of the file of manual blocks; empty if there are none."""
    lines = []
    for behaviour in behaviours:
        for block in behaviour.manual:
            lines += [f"## {behaviour.name}: {block.tag}, line {block.line}", ""]
            lines += ["````python", block.code, "````", ""]
    if not lines:
        return ""
    about = "Code that was between the `[MANUAL_…]` tags of the behaviours. Nothing here runs it."
    return "\n".join(["# Manual code", "", about, "", *lines])


def summary(behaviours: Iterable[Behaviour], conversion: Conversion) -> Mapping[str, int]:
    """The figures of an import."""
    classes = list(conversion.classes.values())
    adapted = sum(cls.adapted for cls in classes)
    ready = sum(is_written(cls) for cls in classes if not cls.adapted)
    return {
        "behaviours": len(list(behaviours)),
        "charts": len(conversion.charts),
        "states": sum(len(cls.uses) for cls in classes),
        "classes": len(classes),
        "translated": ready,
        "adapted": adapted,
        "stubs": len(classes) - ready - adapted,
        "left": len(conversion.left),
        "notes": len(conversion.notes),
    }
