"""Mistakes that authors make in states, signals, types and parts of their own.

Each is a change of one small project. The comment `# here` marks the line that a message has to
name.
"""

# ruff: noqa: E501  a mistake per line
# fmt: off
from __future__ import annotations

from typing import NamedTuple

CHART = """chart: go
outcomes: [over]
any:
  seen: {watch: See, next: {seen: .over}}
  light: {do: Light, next: {done: .over, error: .over}}
"""
STATES = '''from engine.state import Action, Context, Monitor, On, Run, Until
from engine.signals.signal_kinds import Derived, Estimated, Measured
from hw.geometry import Pose2
from hw.samples import Sample


class See(Monitor):
    """Sees whether the lamp is lit."""

    outcomes = ("seen",)
    reads = {"lamp.lit": 1.0}

    def run(self, ctx: Context) -> Run:
        while ctx.value("lamp.lit") is None or ctx.now < 3e8:
            yield On("lamp.lit", until=ctx.after(0.1))
        return "seen"


class Light(Action):
    """Lights the lamp."""

    outcomes = ("done",)
    commands = ("lamp",)

    def __init__(self, on: bool = True) -> None:
        self.on = on

    def run(self, ctx: Context) -> Run:
        ctx.part("lamp").light(self.on)
        yield Until(ctx.after(0.2))
        return "done"


class Lamp:
    """A lamp."""

    signals = ("lamp.lit",)
    lit = False

    def light(self, on: bool) -> None:
        self.lit = on

    def stop(self) -> None:
        pass

    def samples(self, now_ns: int) -> list[Sample]:
        return [Sample("lamp.lit", now_ns, self.lit)]


PARTS = {"lamp": Lamp}
SIGNALS = (Measured("lamp.lit", bool, about="is it on?"),)
'''


class OwnMistake(NamedTuple):
    """A change of `STATES`, or of `CHART`; what is told of it, and whether `validate` can tell.

    `old` is replaced by `new`; `told` is part of the message.
    """

    id: str
    old: str
    new: str
    told: str
    in_run: bool = False
    more: tuple[tuple[str, str], ...] = ()

    def project(self) -> tuple[str, str, str]:
        """The states, the chart, and the place that a message has to name."""
        states, chart = STATES, CHART
        for old, new in ((self.old, self.new), *self.more):
            assert (old in states) != (old in chart), old
            states, chart = states.replace(old, new, 1), chart.replace(old, new, 1)
        for file, text in (("states.py", states), ("go.yaml", chart)):
            lines = [n for n, line in enumerate(text.splitlines(), 1) if "# here" in line]
            if lines:
                return states, chart, f"{file}:{lines[0]}:"
        raise AssertionError(f"{self.id}: no line is marked")


LIT = 'Sample("lamp.lit", now_ns, self.lit)'
LAMP = "class Lamp:"
PARTS = '{"lamp": Lamp}'
HERE_PARTS = (PARTS, f"{PARTS}  # here")
HERE_LAMP = ("class Lamp:", "class Lamp:  # here")
LIGHT = "class Light(Action):"
HERE_LIGHT = (LIGHT, f"{LIGHT}  # here")
SEE = "class See(Monitor):"
HERE_SEE = (SEE, f"{SEE}  # here")
SIGNALS = '(Measured("lamp.lit", bool, about="is it on?"),)'
OUTCOMES = 'outcomes = ("done",)'
COMMANDS = 'commands = ("lamp",)'
READS = 'reads = {"lamp.lit": 1.0}'
WAIT = "yield Until(ctx.after(0.2))"
DONE = 'return "done"'
LIGHT_NODE = "light: {do: Light, next: {done: .over, error: .over}}"
HERE_NODE = (LIGHT_NODE, f"{LIGHT_NODE}  # here")
WAITING = 'while ctx.value("lamp.lit") is None or ctx.now < 3e8:'
RUN = "    def run(self, ctx: Context) -> Run:\n        ctx.part"
DARK = ((READS, 'reads = {"lamp.lit": 1.0, "lamp.dark": 1.0}'),)
READS_DARK = (*DARK, ('ctx.value("lamp.lit") is None', 'ctx.value("lamp.dark") is None'))


def signals(more: str) -> str:
    return SIGNALS[:-1] + f" {more},)  # here"


IN_PARTS = [
    OwnMistake('no signals', '    signals = ("lamp.lit",)\n', '', "Lamp has no signals; give the class `signals = ('lamp.lit',)`", more=(HERE_LAMP,)),
    OwnMistake('signals as text', '("lamp.lit",)\n    lit', '"lamp.lit"\n    lit', "Lamp.signals is 'lamp.lit'; write `signals = ('lamp.lit',)`", more=(HERE_LAMP,)),
    OwnMistake('signals as list', '("lamp.lit",)\n    lit', '["lamp.lit"]\n    lit', "Lamp.signals is ['lamp.lit']; write", more=(HERE_LAMP,)),
    OwnMistake('signals not declared', '("lamp.lit",)\n    lit', '("lamp.lti",)\n    lit', "gives 'lamp.lti', which no SIGNALS declares; did you mean 'lamp.lit'", more=(HERE_LAMP,)),
    OwnMistake('signals that raise', '    signals = ("lamp.lit",)\n', '    @property\n    def signals(self) -> tuple[str, ...]:\n        raise OSError("no lamp")  # here\n', 'OSError: no lamp'),
    OwnMistake('init that raises', '    lit = False\n', '    lit = False\n\n    def __init__(self) -> None:\n        raise OSError("no lamp")  # here\n', "OSError: no lamp (while making part 'lamp'"),
    OwnMistake('init with arguments', '    lit = False\n', '    lit = False\n\n    def __init__(self, port: int) -> None:\n        pass\n', "'lamp' is made by Lamp(), without arguments", more=(HERE_PARTS,)),
    OwnMistake('a part that is made already', PARTS, '{"lamp": Lamp()}  # here', 'name the class, not a part that is made already'),
    OwnMistake('a part that is no class', PARTS, '{"lamp": "Lamp"}  # here', "'lamp' is 'Lamp'; name the class"),
    OwnMistake('abstract part', LAMP, 'from abc import ABC, abstractmethod\n\nclass Lamp(ABC):\n    @abstractmethod\n    def dim(self) -> None: ...\n', "'lamp' is abstract; Lamp lacks dim", more=(HERE_PARTS,)),
    OwnMistake('no samples', 'def samples(', 'def sample(', 'Lamp has no method samples; write `def samples(self, now_ns: int)', more=(HERE_LAMP,)),
    OwnMistake('samples without time', 'samples(self, now_ns: int)', 'samples(self)', 'Lamp.samples() does not take what it is given; write', more=((LIT, 'Sample("lamp.lit", 0, self.lit)'), HERE_LAMP)),
    OwnMistake('stop with an argument', 'def stop(self)', 'def stop(self, now: int)', 'Lamp.stop(now) does not take what it is given; write `def stop(self) -> None`', more=(HERE_LAMP,)),
    OwnMistake('hears without hear', '    lit = False', '    lit = False\n    hears = ("base.pose",)', 'Lamp has no method hear; write `def hear(self, sample: Sample', more=(HERE_LAMP,)),
    OwnMistake('PARTS as list', PARTS, '[Lamp]  # here', 'PARTS: a dict by name, not'),
    OwnMistake('a lamp as base', PARTS, '{"lamp": Lamp, "base": Lamp}', "Lamp has no mode, which every part 'base' has", more=(HERE_LAMP,)),
    OwnMistake('a command that is not there', 'def light(', 'def lighten(', "AttributeError: 'Lamp' object has no attribute 'light'", in_run=True, more=(('ctx.part("lamp").light(self.on)', 'ctx.part("lamp").light(self.on)  # here'),)),
    OwnMistake('samples that raise', f'return [{LIT}]', f'return [{LIT}] * (1 // 0)  # here', 'ZeroDivisionError', in_run=True),
    OwnMistake('advance that raises', '    lit = False\n', '    lit = False\n\n    def advance(self, to_ns: int) -> None:\n        1 // 0  # here\n', 'ZeroDivisionError', in_run=True),
    OwnMistake('samples None', f'return [{LIT}]', 'pass', 'samples() returned None; return a list of Sample', in_run=True, more=(HERE_LAMP,)),
    OwnMistake('one sample for a list', f'[{LIT}]', LIT, 'samples() returned a Sample; return a list of Sample', in_run=True, more=(HERE_LAMP,)),
    OwnMistake('dicts for samples', f'[{LIT}]', '[{"lamp.lit": self.lit}]', 'samples() returned a dict among the samples', in_run=True, more=(HERE_LAMP,)),
]


def sample(id_: str, value: str, kind: str, told: str, name: str = "lamp.lit") -> OwnMistake:
    """A sample of this value, where the signal is declared to be of this kind."""
    changes = (('"lamp.lit", bool', f'"lamp.lit", {kind}'), HERE_LAMP)
    changes = changes if kind != "bool" else (HERE_LAMP,)
    return OwnMistake(id_, LIT, f'Sample("{name}", {value})', told, in_run=True, more=changes)


IN_SAMPLES = [
    sample('text for a bool', 'now_ns, "on"', 'bool', "sample 'lamp.lit': its value is 'on' (str); wanted: bool"),
    sample('int for a bool', 'now_ns, 1', 'bool', 'its value is 1 (int); wanted: bool'),
    sample('bool for a number', 'now_ns, True', 'float', 'its value is True (bool); wanted: float'),
    sample("numpy's short float", 'now_ns, __import__("numpy").float32(1)', 'float', 'its value is a float32; wanted: float; write float(…)'),
    sample('list for a tuple', 'now_ns, [1.0]', 'tuple[float, ...]', 'its value is a list; wanted: tuple[float, ...]; write tuple(…)'),
    sample('text in a tuple', 'now_ns, (1.0, "2")', 'tuple[float, ...]', "its value's item is '2' (str); wanted: float"),
    sample('text in a pose', 'now_ns, Pose2("1", 2.0)', 'Pose2', "its value's x is '1' (str); wanted: float"),
    sample('None in a pose', 'now_ns, Pose2(1.0, None)', 'Pose2', "its value's y is None; wanted: float"),
    sample('tuple for a pose', 'now_ns, (1.0, 2.0, 0.0)', 'Pose2', 'its value is a tuple; wanted: Pose2'),
    sample('text or nothing', 'now_ns, 5', 'str | None', 'its value is 5 (int); wanted: str | None'),
    sample('stamp in seconds', 'now_ns * 1e-9, True', 'bool', 'its stamp is 0.0; wanted: whole ns'),
    sample('signal misspelt', 'now_ns, True', 'bool', "sample 'lamp.lti': no signal of this name is declared; did you mean 'lamp.lit'", 'lamp.lti'),
]
IN_SIGNALS = [
    OwnMistake('one signal for a tuple', SIGNALS, SIGNALS[1:-2] + '  # here', 'a comma is missing'),
    OwnMistake('names for signals', SIGNALS, '("lamp.lit",)  # here', "'lamp.lit' is no signal; write Measured("),
    OwnMistake('type as text', '"lamp.lit", bool, about="is it on?"),)', '"lamp.lit", "bool"),)  # here', "signal 'lamp.lit': its type is 'bool'; give a class"),
    OwnMistake('a name that is taken', SIGNALS, signals('Measured("base.pose", Pose2)'), "signal 'base.pose' is declared twice"),
    OwnMistake('derived of text', SIGNALS, signals('Derived("lamp.dark", "lamp.lit", lambda lit: not lit)'), "`of` is a tuple of names, not 'lamp.lit'"),
    OwnMistake('derived of nothing known', SIGNALS, signals('Derived("lamp.dark", ("lamp.lti",), lambda lit: not lit)'), "rests on unknown 'lamp.lti'"),
    OwnMistake('derived by too few', SIGNALS, signals('Derived("lamp.dark", ("lamp.lit",), lambda: 1)'), 'function is called with 1 values; write one that takes lamp.lit', more=DARK),
    OwnMistake('derived that raises', SIGNALS, signals('Derived("lamp.dark", ("lamp.lit",), lambda lit: 1 // 0)'), 'ZeroDivisionError', in_run=True, more=READS_DARK),
    OwnMistake('estimated by an object', SIGNALS, signals('Estimated("lamp.dark", ("lamp.lit",), object())'), 'make is <object obj', more=DARK),
    OwnMistake('estimated by no estimator', SIGNALS, signals('Estimated("lamp.dark", ("lamp.lit",), dict)'), 'dict has no value; see engine.signals.Estimator', more=DARK),
    OwnMistake('TYPES as list', SIGNALS, f'{SIGNALS}\nTYPES = [Pose2]  # here', 'TYPES: a dict by name, not'),
    OwnMistake('no type', SIGNALS, f"{SIGNALS}\nTYPES = {{'pair': dict[str, int]}}  # here", "TYPES: 'pair' is no type"),
    OwnMistake('a type of all charts', SIGNALS, f"{SIGNALS}\nTYPES = {{'number': Pose2}}  # here", "'number' is a type of all charts"),
]
IN_CLASSES = [
    OwnMistake('outcomes as text', OUTCOMES, 'outcomes = "done"', "Light.outcomes: a tuple of names, not 'done'; write ('done',)", more=(HERE_LIGHT,)),
    OwnMistake('outcomes as list', OUTCOMES, 'outcomes = ["done"]', "Light.outcomes: a tuple of names, not ['done']; write ('done',)", more=(HERE_LIGHT,)),
    OwnMistake('outcomes missing', f'    {OUTCOMES}\n', '', "it declares none; give the class `outcomes = ('name',)`", more=((DONE, f'{DONE}  # here'),)),
    OwnMistake('outcomes twice', OUTCOMES, 'outcomes = ("done", "done")', "Light.outcomes: 'done' is there twice", more=(HERE_LIGHT,)),
    OwnMistake('commands as text', COMMANDS, 'commands = ("lamp")', "Light.commands: a tuple of names, not 'lamp'; write ('lamp',)", more=(HERE_LIGHT,)),
    OwnMistake('commands as numbers', COMMANDS, 'commands = (3,)', 'Light.commands: a tuple of names, not (3,)', more=(HERE_LIGHT,)),
    OwnMistake('commands of no part', COMMANDS, 'commands = ("lmp",)', "Light commands 'lmp', and there is no such part", more=(HERE_NODE,)),
    OwnMistake('reads as tuple', READS, 'reads = ("lamp.lit",)', "See.reads: a dict by name, not ('lamp.lit',); write {", more=(HERE_SEE,)),
    OwnMistake('reads as set', READS, 'reads = {"lamp.lit"}', "See.reads: a dict by name, not {'lamp.lit'}", more=(HERE_SEE,)),
    OwnMistake('age as text', READS, 'reads = {"lamp.lit": "1 s"}', "the greatest age accepted, s, or None for any; not '1 s'", more=(HERE_SEE,)),
    OwnMistake('reads too little', READS, 'reads = {}', "LookupError: seen: 'lamp.lit' is not among its `reads`", in_run=True, more=((WAITING, f'{WAITING}  # here'),)),
    OwnMistake('outputs as tuple', OUTCOMES, f'{OUTCOMES}\n    outputs = ("done",)', "Light.outputs: a dict by name, not ('done',)", more=(HERE_LIGHT,)),
    OwnMistake('outputs without names', OUTCOMES, f'{OUTCOMES}\n    outputs = {{"done": float}}', "Light.outputs['done']: a dict by name, not <class 'float'>", more=(HERE_LIGHT,)),
    OwnMistake('output type as text', OUTCOMES, f'{OUTCOMES}\n    outputs = {{"done": {{"x": "float"}}}}', "Light.outputs: 'x': 'float' cannot be a chart type", more=(HERE_LIGHT,)),
    OwnMistake('inputs as tuple', OUTCOMES, f'{OUTCOMES}\n    inputs = ("x",)', "Light.inputs: a dict by name, not ('x',)", more=(HERE_LIGHT,)),
    OwnMistake('no docstring', '    """Lights the lamp."""\n\n', '', 'Light: give it a docstring', more=(HERE_LIGHT,)),
    OwnMistake('parameter without type', 'on: bool = True', 'on=True', "Light: annotate 'on' with its type, like `on: float`", more=(HERE_LIGHT,)),
    OwnMistake('state init that raises', 'self.on = on', 'raise ValueError("no lamp")  # here', 'ValueError: no lamp', in_run=True),
    OwnMistake('no run', RUN, '    def runs(self, ctx: Context) -> Run:\n        ctx.part', 'Light lacks run: write it; or, for a base class of states, begin its name with _', more=(HERE_LIGHT,)),
    OwnMistake('run without ctx', RUN, '    def run(self) -> Run:\n        ctx.part', 'Light.run(self): write def run(self, ctx: Context) -> Run', more=(HERE_LIGHT,)),
    OwnMistake('run without self', RUN, '    def run(ctx: Context) -> Run:\n        ctx.part', 'Light.run(ctx): write def run(self, ctx: Context) -> Run', more=(HERE_LIGHT,)),
    OwnMistake('async run', f'{RUN}("lamp").light(self.on)\n        {WAIT}\n        {DONE}\n', '    async def run(self, ctx: Context) -> Run:\n        return None\n', 'Light.run is async; write def run(', more=(HERE_LIGHT,)),
    OwnMistake('static run', RUN, '    @staticmethod\n    def run(self, ctx: Context) -> Run:\n        ctx.part', 'Light.run is a staticmethod; write def run(', more=(HERE_LIGHT,)),
    OwnMistake('abstract state', LIGHT, 'from abc import ABC, abstractmethod\n\nclass Light(Action, ABC):  # here', 'Light lacks dim: write it', more=(('    commands', '    @abstractmethod\n    def dim(self) -> None: ...\n\n    commands'),)),
    OwnMistake('state without base', LIGHT, 'class Light:', 'derive it from Action or Monitor', more=(HERE_NODE,)),
    OwnMistake('function for a state', LIGHT, 'def Light(ctx: Context) -> None:\n    pass\n\n\nclass Lights:', 'a function; write a class derived from Action or Monitor', more=(HERE_NODE,)),
    OwnMistake('a state twice', LAMP, 'class See(Monitor):  # here\n    """Again."""\n\n\nclass Lamp:', 'See is defined again; the class of line 7 is lost'),
]
IN_CODE = [
    OwnMistake('yields a number', WAIT, 'yield 2.0  # here', 'yields 2.0, which means nothing; to wait so many s: `yield Until(ctx.after(2.0))`'),
    OwnMistake('yields a number by name', WAIT, 'wait = 2.0\n        yield wait  # here', 'yielded 2.0, which means nothing; to wait so many s, yield Until(ctx.after(2.0))', in_run=True),
    OwnMistake('yields an instant', WAIT, 'yield ctx.after(0.2)  # here', 'yields ctx.after(0.2), a number of ns; to wait until then: `yield Until(ctx.after(0.2))`'),
    OwnMistake('yields an instant by name', WAIT, 'wait = ctx.after(0.2)\n        yield wait  # here', 'to wait until an instant in ns, yield Until(…)', in_run=True),
    OwnMistake('yields a bool', WAIT, 'yield True  # here', 'yields True, which means nothing; yield None for the next tick'),
    OwnMistake('yields a tuple', WAIT, 'yield ("lamp.lit", 2)  # here', "yields ('lamp.lit', 2), which means nothing; yield None for the next tick"),
    OwnMistake('yields another state', WAIT, 'yield self  # here', 'yielded a Light, which means nothing; yield None for the next tick', in_run=True),
    OwnMistake('yields an outcome', DONE, 'yield "done"  # here', "yields 'done', and that goes on; `return 'done'` ends it"),
    OwnMistake('returns nothing', DONE, 'return  # here', 'returns nothing here; return one of its outcomes: done'),
    OwnMistake('returns nothing at its end', DONE, f'if not self.on:\n            {DONE}', 'light returned None; declared: done', in_run=True, more=(HERE_LIGHT,)),
    OwnMistake('returns what is not declared', DONE, 'return "dome"  # here', "returns 'dome', which is not among its outcomes; did you mean 'done'"),
    OwnMistake('returns one of two', DONE, 'return "done" if self.on else "out"  # here', "returns 'out', which is not among its outcomes; allowed: done"),
    OwnMistake('returns a number', DONE, 'return 3  # here', 'returns 3, which is not among its outcomes'),
    OwnMistake('returns no outputs', DONE, f'{DONE}  # here', "returns 'done' without its outputs; `return 'done', {'x': …}`", more=((OUTCOMES, f'{OUTCOMES}\n    outputs = {{"done": {{"x": float}}}}'),)),
    OwnMistake('returns other outputs', DONE, f'{DONE}, {{"y": 1.0}}  # here', "returns outputs with 'done', which has none"),
    OwnMistake('raises', WAIT, f'{WAIT}\n        1 // 0  # here', 'ZeroDivisionError', in_run=True),
]
IN_MODULES = [
    OwnMistake('syntax', LAMP, 'lamps = (  # here\n\n\nclass Lamp:', "'(' was never closed"),
    OwnMistake('no such module', LAMP, 'import nothing_there  # here\n\n\nclass Lamp:', "No module named 'nothing_there'"),
    OwnMistake('no such name', LAMP, 'from engine.state import Stat  # here\n\n\nclass Lamp:', "cannot import name 'Stat'"),
    OwnMistake('module that raises', LAMP, '1 // 0  # here\n\n\nclass Lamp:', 'ZeroDivisionError'),
    OwnMistake('module that exits', LAMP, 'raise SystemExit  # here\n\n\nclass Lamp:', 'SystemExit'),
    OwnMistake('unknown annotation', 'on: bool = True', 'on: "Lenght" = True', "Light: NameError: name 'Lenght' is not defined", more=(HERE_LIGHT,)),
    OwnMistake('outcome of the chart twice', 'outcomes: [over]', 'outcomes: [over, over]  # here', "outcome 'over' is there already"),
]
MISTAKES = [*IN_PARTS, *IN_SAMPLES, *IN_SIGNALS, *IN_CLASSES, *IN_CODE, *IN_MODULES]
NEVER_RETURNS = OwnMistake('never returns', f'{WAIT}\n        {DONE}', 'while True:\n            yield', 'never returns; return one of its outcomes: done', more=((RUN, '    def run(self, ctx: Context) -> Run:  # here\n        ctx.part'),))
