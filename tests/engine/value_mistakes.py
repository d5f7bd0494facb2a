"""Mistakes in values, names and bindings of charts, as in `chart_mistakes.py`; of `TOUR`.

`TOUR` uses the shipped states, and `Brake` of this module.
"""

# ruff: noqa: E501  a mistake per line

from __future__ import annotations

from engine.state import Action, Context, Run

TOUR = """\
chart: tour
about: Visit places while the user is near, hand over what was ordered, log the rest.
parameters:
  near: {type: length, default: $profile.chase.inner, about: who is nearer is beside the robot}
  pause: {type: duration, default: 3 s, about: how long the robot stands at a place}
  tries: {type: integer, default: 2, about: further drives to a place}
  gauge: {type: signal of length, default: user.distance, about: what says how far the user is}
  label: {type: text, default: tour, about: begins each line of the log}
  held: {type: text, default: arm, about: the part that keeps still}
inputs:
  base: {type: Pose2, default: {x: 1 m, y: 2 m, yaw: 90 deg}}
  order: {type: text | none, default: none}
  limit: {type: length, default: 5 m}
outcomes: [done, failed, left]
outputs: {done: {index: integer}}
data:
  places: {type: list of Pose2, initial: [{place: corner}, {x: 2 m, y: 3 m}]}
  index: {type: integer, initial: 0}
  goal: {type: Pose2, initial: none}
  spoken: {type: text, initial: none}
any:
  far:
    watch: Above
    with: {signal: user.distance, limit: 4 m, for: 2 s, older: 1 s}
    next: {above: .left}
  gone: {watch: Silent, with: {signal: user.pose, time: 2 s}, next: {silent: .failed}}
  main:
    in: {stops: places}
    states:
      begin:
        do: DriveTo
        in: {goal: base}
        with: {subsystem: chase}
        timeout: 60 s
        next: {arrived: fold, no_path: .failed, stuck: .failed, lost: .failed, timeout: .failed}
      fold:
        do: MoveArmTo
        in: {goal: {x: 0.6 m, y: 10 cm, z: 1 m, roll: 0, pitch: 90 deg, yaw: 0}}
        with: {frame: rover}
        next: {arrived: pick, no_solution: pick, blocked: pick, failed: .failed}
      pick:
        do: Index
        in: {items: stops, index: index}
        out: {item: goal, next: index}
        next: {found: drive, end: .done}
      drive:
        do: DriveTo
        in: {goal: goal}
        timeout: 60 s
        retry: {times: $tries, on: stuck}
        next: {arrived: stand, no_path: say, stuck: say, lost: .failed, timeout: say}
      stand:
        any:
          enough: {watch: Wait, with: {time: $pause}, next: {over: .over}}
          beside: {watch: Below, with: {signal: $gauge, limit: $near}, in: {hysteresis: limit}, next: {below: .beside}}
          still: {do: Brake, with: {part: base}}
          rest: {do: Brake, with: {part: $held}}
        next: {over: pick, beside: serve}
      serve:
        do: Switch
        with: {cases: [tea, milk]}
        in: {value: order}
        next: {tea: hand, milk: hand, other: say}
      hand: {do: OpenGripper, with: {opening: 6 cm}, next: {opened: say, failed: .failed}}
      say:
        do: Format
        with: {text: "{a}: place {b}"}
        in: {a: $label, b: index}
        out: {text: spoken}
        next: {formatted: note}
      note: {do: Log, with: {text: "{a}"}, in: {a: spoken}, next: {logged: back}}
      back:
        do: DriveThrough
        in: {goals: [{place: corner}, {x: 2 m, y: 1 m}]}
        timeout: 60 s
        next: {arrived: pick, no_path: .failed, stuck: .failed, lost: .failed, timeout: .failed}
    next: {error: .failed}
"""


class Brake(Action):
    """Keeps a part still until something else ends it."""

    outcomes = ()
    commands = ("$part",)

    def __init__(self, part: str) -> None:
        self.part = part

    def run(self, ctx: Context) -> Run:
        while True:
            yield


_POSE = "{x: 1 m, y: 2 m, yaw: 90 deg}"
_GOAL = "{x: 0.6 m, y: 10 cm, z: 1 m, roll: 0, pitch: 90 deg, yaw: 0}"
_SIGNAL = "Silent, with: {signal: user.pose, time: 2 s}"
_CASES = "with: {cases: [tea, milk]}\n        in: {value: order}"
_WITH = "with: {subsystem: chase}\n        timeout: 60 s"
_SERVE = TOUR[TOUR.index("      serve:") : TOUR.index("      say:")]
_SAY = TOUR[TOUR.index('"{a}: place') : TOUR.index("        out: {text: spoken}")]
_FAR = TOUR[TOUR.index("Above\n") : TOUR.index(".left}")]
_TRIES = TOUR[TOUR.index("2, about: further") : TOUR.index("$tries")]
_REST = "          rest: {do: Brake, with: {part: $held}}\n"

LITERALS = [
    ("wrong unit in a pose", "y: 3 m}", "y: ¦3 deg}", "a length"),
    ("misspelt unit in a pose", "y: 3 m}", "y: ¦3 mtr}", "a length"),
    ("unit in two words", "y: 10 cm, z", "y: ¦10 c m, z", "a length"),
    ("missing field", "{x: 2 m, y: 1 m}]", "¦{x: 2 m}]", "'y' missing"),
    ("empty field", "y: 10 cm, z", "y: ¦, z", "wanted: length"),
    ("empty pose", f"default: {_POSE}", "default: ¦{}", "'x', 'y' missing"),
    ("misspelt field", "yaw: 90 deg}", "¦jaw: 90 deg}", "'yaw'"),
    ("field in capitals", "{x: 2 m, y: 3 m}", "{¦X: 2 m, y: 3 m}", "'x'"),
    ("quoted number", "{x: 2 m, y: 3 m}", '{x: ¦"2", y: 3 m}', "without quotes"),
    ("place and x together", f"default: {_POSE}", "default: {place: corner, ¦x: 1 m}", "leave out 'x'"),
    ("a place for a Pose3", f"{_GOAL}", "{¦place: corner}", "allowed: pitch, roll, x, y, yaw, z"),
    ("misspelt place in data", "initial: [{place: corner}", "initial: [{place: ¦cornr}", "'corner'"),
    ("misspelt place in in", "{goals: [{place: corner}", "{goals: [{place: ¦cornr}", "'corner'"),
    ("places for place", "initial: [{place: corner}", "initial: [{¦places: corner}", "'place'"),
    ("a place by its bare name", f"default: {_POSE}", "default: ¦corner", "`{place: corner}`"),
    ("a place by its bare name in in", "in: {goal: base}", "in: {goal: ¦corner}", "`{place: corner}`"),
    ("a list of numbers for a pose", f"default: {_POSE}", "default: ¦[1, 2, 0]", "{x: …, y: …, yaw: …}"),
    ("a list of one pose", f"default: {_POSE}", "default: ¦[{x: 1 m, y: 2 m}]", "{x: …, y: …, yaw: …}"),
    ("one pose for a list", "[{place: corner}, {x: 2 m, y: 1 m}]", "¦{place: corner}", "`[{…}]`"),
    ("mapping for a number", "opening: 6 cm", "opening: ¦{length: 6 cm}", "a length"),
    ("braces without quotes", 'text: "{a}"', "text: ¦{a}", "quotes"),
    ("misspelt list of", "{type: list of Pose2", "{type: ¦list of pose2", "`list of Pose2`"),
    ("list of Python", "type: list of Pose2,", 'type: ¦"list[Pose2]",', "`list of Pose2`"),
]  # fmt: skip

NAMED = [
    ("unknown $ in a pose", "y: 1 m}]", "y: ¦$sid}]", "no parameter 'sid'"),
    ("misspelt $ in in", "in: {a: $label, b", "in: {a: ¦$lable, b", "'label'"),
    ("$ for a data key", "in: {goal: goal}", "in: {goal: ¦$goal}", "without the `$`"),
    ("$ for an input", "in: {goal: base}", "in: {goal: ¦$base}", "without the `$`"),
    ("misspelt key of the profile", "$profile.chase.inner", "¦$profile.chase.iner", "'profile.chase.inner'"),
    ("a section of the profile", "$profile.chase.inner", "¦$profile.chase", "profile.chase."),
    ("profile forgotten", "$profile.chase.inner", "¦$chase.inner", "profile.chase.inner"),
    ("$ of the profile forgotten", "$profile.chase.inner", "¦profile.chase.inner", "$profile.chase.inner"),
    ("value of the profile of another type", "$profile.chase.inner", "¦$profile.chase.front", "a length"),
    ("default of another type", "default: 3 s,", "default: ¦3 m,", "a duration"),
    ("default by another parameter", "default: 3 s,", "default: ¦$near,", "before the chart starts"),
    ("initial by a parameter", "type: integer, initial: 0", "type: integer, initial: ¦$tries", "before the chart starts"),
    ("initial of an input", "default: none}\n  limit", "¦initial: none}\n  limit", "'default'"),
    ("default of data", "{type: integer, initial: 0}", "{type: integer, ¦default: 0}", "'initial'"),
    ("misspelt signal", "signal: user.distance", "signal: ¦user.distanc", "'user.distance'"),
    ("half a signal", "signal: user.distance", "signal: ¦distance", "'user.distance'"),
    ("misspelt signal as default", "default: user.distance", "default: ¦user.distence", "'user.distance'"),
    ("signal of another type", "signal: user.distance", "signal: ¦user.pose", "a signal of number"),
    ("default signal of another type", "default: user.distance", "default: ¦base.mode", "a signal of length"),
    ("text parameter for a signal", "signal: $gauge", "signal: ¦$label", "`type: signal of length`"),
    ("misspelt signal of", "{type: signal of length", "{type: ¦signal of lenght", "`signal of length`"),
    ("signal of nothing", "{type: signal of length", "{type: ¦signal", "`signal of number`"),
    ("signal given by in", _SIGNAL, "Silent, with: {time: 2 s}, in: {¦signal: spoken}", "`with: {signal: …}`"),
    ("signal left out", _SIGNAL, "¦Silent, with: {time: 2 s}", "`with: {signal: …}`"),
    ("limit in another unit", "limit: 4 m,", "limit: ¦4 s,", "a length"),
    ("limit by a parameter of another type", "limit: 4 m,", "limit: ¦$pause,", "a length"),
    ("for in another unit", "for: 2 s,", "for: ¦2 m,", "a duration"),
    ("for_ of Python", "for: 2 s,", "¦for_: 2 s,", "'for'"),
    ("misspelt part", "part: base", "part: ¦bas", "'base'"),
]  # fmt: skip

ENDINGS = [
    ("cases by a parameter", "cases: [tea, milk]", "cases: ¦$label", "write them here"),
    ("cases given by in", _CASES, "in: {value: order, ¦cases: spoken}", "`with: {cases: …}`"),
    ("a case not mapped", "next: {tea: hand, milk", "¦next: {milk", "`next: {tea: …}`"),
    ("a mapped case not listed", "{tea: hand, milk: hand", "{tea: hand, ¦cocoa: hand, milk: hand", "`cases` may name others"),
    ("misspelt case in next", "{tea: hand, milk: hand", "{tea: hand, ¦mlik: hand", "'milk'"),
    ("a case that is no name", "cases: [tea, milk]", "cases: [tea, milk, ¦hot milk]", "letters"),
    ("a reserved case", "cases: [tea, milk]", "cases: [tea, milk, ¦error]", "reserved"),
    ("a case twice", "cases: [tea, milk]", "cases: [tea, milk, ¦tea]", "keep one"),
    ("a case that is an outcome already", "cases: [tea, milk]", "cases: [tea, milk, ¦other]", "keep one"),
    ("one case without a list", "cases: [tea, milk]", "cases: ¦tea", "`[tea]`"),
    ("cases as text", "cases: [tea, milk]", 'cases: ¦"tea, milk"', "`[tea, milk]`"),
    ("never produced by a container", "beside: serve}", "beside: serve, ¦gone: pick}", "allowed: beside"),
    ("misspelt outcome of a container", "{over: .over}", "{over: ¦.ovr}", "'.over'"),
    ("going back to itself at once", _SERVE, f"      ¦{_SERVE[6:].replace('other: say', 'other: serve')}", "serve -> serve never waits"),
    ("failing into its chooser", _SERVE, _SERVE.replace(".failed", "serve").replace("hand: {", "¦hand: {"), "in every tick"),
    ("two commands of a part side by side", _REST, f"{_REST}          ¦hush: {{do: Brake, with: {{part: $held}}}}\n", "one after the other"),
]  # fmt: skip

RANGES = [
    ("negative age", "older: 1 s", "older: ¦-1 s", "0 s or more"),
    ("negative time", "for: 2 s", "for: ¦-0.5 s", "0 s or more"),
    ("negative time by a parameter", "default: 3 s,", "default: ¦-3 s,", "0 s or more"),
    ("negative hysteresis", "in: {hysteresis: limit}", "in: {hysteresis: ¦-1 m}", "0 m or more"),
    ("a drive at no speed", _WITH, _WITH.replace("chase", "chase, speed: ¦0"), "more than 0 m/s"),
    ("degrees for radians", "yaw: 90 deg}", "yaw: ¦90}", "`90 deg`"),
    ("degrees for radians in a Pose3", "pitch: 90 deg", "pitch: ¦90", "`90 deg`"),
    ("a place beyond the horizon", "x: 1 m", "x: ¦100 km", "-1e+04 to 1e+04 m"),
]  # fmt: skip

TOGETHER = [
    ("unknown place in a text", 'text: "{a}: place {b}"', 'text: ¦"{a}: place {d}"', "write {a}, {b} or {c}"),
    ("a brace alone in a text", 'text: "{a}: place {b}"', 'text: ¦"{a: place {b}"', "{{ and }} for braces"),
    ("place of an input not given", _SAY, _SAY.replace(", b: index", "").replace('"{a}', '¦"{a}'), "`in: {b: …}`"),
    ("limits swapped", _FAR, _FAR.replace("Above", "Within").replace("limit: 4 m", "low: ¦4 m, high: 2 m").replace("above", "within"), "swap them"),
]  # fmt: skip

FLOW = [
    ("a decimal comma", "default: 3 s,", "default: ¦3,5 s,", "write 3.5 s"),
    ("a decimal comma in a pose", "{x: 2 m, y: 3 m}", "{x: ¦2,5 m, y: 3 m}", "write 2.5 m"),
    ("a decimal comma without a unit", "yaw: 0}", "yaw: ¦0,5}", "write 0.5"),
    ("no space after : in a pose", "{x: 2 m, y: 3 m}", "{¦x:2 m, y: 3 m}", "`x: 2 m`"),
    ("no space after : of a place", "[{place: corner}, {x: 2 m, y: 3 m}]", "[{¦place:corner}]", "`place: corner`"),
    ("no brackets around outcomes", "on: stuck", "on: ¦no_path, stuck", "`on: [no_path, stuck]`"),
    ("a misspelt outcome in brackets", "on: stuck", "on: [no_path, ¦stucked]", "'stuck'"),
    ("no brackets around places", "initial: [{place: corner}, {x: 2 m, y: 3 m}]", "initial: {place: corner}, ¦{x: 2 m, y: 3 m}", "`initial: [{…}, {…}]`"),
    ("no brackets around places in a line", "order: {type: text | none, default: none}", "order:\n    type: list of Pose2\n    default: ¦{place: corner}, {x: 1 m, y: 2 m}", "`default: [{place: corner}, …]`"),
    ("a type in brackets", "type: list of Pose2,", "type: ¦[Pose2],", "`list of Pose2`"),
    ("half a type of items", "type: list of Pose2,", "type: ¦list of Pose,", "`list of Pose2`"),
    ("or none", "{type: text | none", "{type: ¦text or none", "`text | none`"),
    ("one place for a list in data", "initial: [{place: corner}, {x: 2 m, y: 3 m}]", "initial: ¦corner", "`[{place: corner}]`"),
    ("places for a list of anything", "items: stops", "items: [¦{place: corner}]", "`data: {items: {type: list of Pose2, initial: …}}`"),
    ("a quoted text in in", "in: {value: order}", 'in: {value: ¦"tee"}', "`data: {value: {type: text, initial: tee}}`"),
    ("a field of a signal", "signal: user.distance", "signal: ¦user.pose.x", "such as user.distance"),
    ("a signal of no name here", "signal: user.distance", "signal: ¦zzzzzzzz", "those that fit: user.distance"),
]  # fmt: skip

BINDINGS = [
    ("an input given by with", _WITH, _WITH.replace("chase", "chase, ¦goal: {place: corner}"), "`in: {goal: …}`"),
    ("given twice", "in: {hysteresis: limit}", "in: {hysteresis: limit, ¦limit: limit}", "keep one"),
    ("a literal under out", "out: {text: spoken}", "out: {text: ¦{x: 1}}", "a data key"),
    ("a parameter under out", "out: {text: spoken}", "out: {text: ¦$label}", "spoken"),
    ("a literal on a container", "in: {stops: places}", "in: {stops: ¦[{place: corner}]}", "a data key"),
    ("a parameter on a container", "in: {stops: places}", "in: {stops: ¦$near}", "places"),
    ("wrong unit in in", "in: {hysteresis: limit}", "in: {hysteresis: ¦5 s}", "a length"),
    ("a word for a quantity in in", "in: {hysteresis: limit}", "in: {hysteresis: ¦some cm}", "`with: {hysteresis: some cm}`"),
    ("a text in in", "in: {a: $label, b", "in: {a: ¦the tour, b", "by a parameter"),
    ("a key of another type", "in: {hysteresis: limit}", "in: {hysteresis: ¦spoken}", "a length"),
    ("times 0", "times: $tries", "times: ¦0", "from 1"),
    ("times below 0 by its parameter", _TRIES, f"¦-1{_TRIES[1:]}", "0 or more"),
    ("times in words", "times: $tries", "times: ¦twice", "whole number"),
    ("times with a unit", "times: $tries", "times: ¦2 s", "whole number"),
    ("times by a text", "times: $tries", "times: ¦$label", "an integer"),
    ("times by an unknown parameter", "times: $tries", "times: ¦$trys", "'tries'"),
    ("wait by a length", "on: stuck}", "on: stuck, wait: ¦$near}", "a duration"),
]  # fmt: skip
