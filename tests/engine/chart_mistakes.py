"""Mistakes that people make in charts: what they write, where it is wrong, and what mends it.

Each is `(name, right, wrong, help)`: `right` stands once in `CHART` and is replaced by `wrong`, in
which `¦` marks the place that has to be reported; `help` has to be part of the message or hint.
"""

# ruff: noqa: E501  a mistake per line

CHART = """\
chart: fetch
about: Go to the user and hold the prop ready.
parameters:
  patience: {type: duration, default: 20 s, about: give up a drive after this long}
outcomes: [done, failed]
data:
  goal: {type: Pose2, initial: none}
any:
  danger: {watch: EscapeRequired, priority: 1, next: {required: .failed}}
  main:
    states:
      park:
        about: No driving with the arm out.
        do: ParkArm
        timeout: 15 s
        next: {parked: choose, failed: .failed, timeout: .failed}
      choose:
        do: ChooseChasePose
        out: {pose: goal}
        next: {chosen: drive, none: .failed}
      drive:
        do: DriveTo
        with: {subsystem: chase, patience: 5 s}
        in: {goal: goal}
        timeout: $patience
        retry: {times: 2, on: stuck, wait: 1 s}
        autonomy: {arrived: low}
        next: {arrived: look, no_path: .failed, stuck: .failed, lost: .failed, timeout: .failed}
      look:
        all:
          away: {watch: UserFar, with: {beyond: 4 m}}
          gone: {watch: UserLost}
        when:
          - {outcome: done, if: {away: far}}
          - {outcome: failed, if: {gone: lost}}
    next: {error: .failed}
"""

_ABOUT = "about: No driving with the arm out."
_PARK = "      park:\n        about: No driving with the arm out.\n        do: ParkArm\n"
_FROM_DATA = CHART[CHART.index("Pose2, initial") : CHART.index("pose: goal}") + 11]
_REST = CHART[CHART.index(_PARK) + len(_PARK) :]
_OUT = "        out: {pose: goal}\n"
_CHOSEN = "next: {chosen: drive, none: .failed}"
_NEXT = f"        {_CHOSEN}\n"
_CHOOSE = f"      choose:\n        do: ChooseChasePose\n{_OUT}{_NEXT}"
_DRIVE = "      drive:\n        do: DriveTo\n        with: {subsystem: chase, patience: 5 s}\n        in: {goal: goal}\n"
_WHEN = CHART[CHART.index("gone: {") : CHART.index("    next: {error")]
_ENDS = "next: {arrived: .done, no_path: .done, stuck: .done, lost: .done, error: .done}"
_TOP = "about: Go to the user and hold the prop ready.\nparameters:\n"
_TIMES = "  patience: {type: duration, default: 20 s, about: give up a drive after this long}\n"
_MAPPED = "    next: {error: .failed}\n"
_AWAY = "          - {outcome: done, if: {away: far}}\n"
_PARKED = "next: {parked: choose, failed: .failed, timeout: .failed}"
_DRIVEN = "next: {arrived: look, no_path: .failed, stuck: .failed, lost: .failed, timeout: .failed}"

FORM = [
    ("tab", "        do: ParkArm", "¦\t\tdo: ParkArm", "not with tabs"),
    ("tab after spaces", "        do: ParkArm", "      ¦\tdo: ParkArm", "not with tabs"),
    ("a key dedented by one", "        timeout: 15 s", "       ¦timeout: 15 s", "indent"),
    ("a key indented by one more", "        timeout: 15 s", "         ¦timeout: 15 s", "indent"),
    ("the first key indented less", "        do: ChooseChase", "       ¦do: ChooseChase", "indent"),
    ("a node not indented", "      choose:\n", "¦choose:\n", "indent"),
    ("a node indented by one more", "      choose:\n", "       ¦choose:\n", "indent"),
    ("a node indented by one less", "      choose:\n", "     ¦choose:\n", "indent"),
    ("unclosed {", f"{_PARKED}", f"next: ¦{_PARKED[6:-1]}", "`}`"),
    ("unclosed { in a list", "{outcome: done, if: {away: far}}", "¦{outcome: done, if: {away: far}", "`}`"),
    ("unclosed [", "[done, failed]", "¦[done, failed", "`]`"),
    ("closed by the wrong bracket", "[done, failed]", "¦[done, failed}", "`]`"),
    ("one } too many", "{chosen: drive, none: .failed}", "{chosen: drive, none: .failed}¦}", "`}`"),
    ('unclosed "', "about: Go to", 'about: ¦"Go to', '`"`'),
    ("unclosed '", "about: Go to", "about: ¦'Go to", "`'`"),
    ('" inside of "', "about: Go to the user and", 'about: "Go to the user" ¦and', "quote"),
    ('unclosed " before a quoted text', f"{_TOP}{_TIMES}", 'about: ¦"Go to\nparameters:\n  patience: {type: duration, default: 20 s, about: "give up"}\n', "never"),
    ("a colon in text", "about: Go", "about: Note¦: go", "quotes"),
    ("a colon in text in {}", "about: give up a drive", "about: note¦: give up", "quotes"),
    ("@ begins text", "about: Go", "about: ¦@home go", "quotes"),
    ("` begins text", "about: Go", "about: ¦`go`", "quotes"),
    ("% begins text", "about: Go", "about: ¦%go", "quotes"),
    ("* begins text", "about: Go", "about: ¦*go", "quotes"),
    ("& begins text", "about: Go", "about: ¦&go", "quotes"),
    ("! begins text", "about: Go", "about: ¦!go", "quotes"),
    ("{{}} of a template", "do: ParkArm", "do: {¦{park_class}}", "{{"),
    ("smart quotes", "do: ParkArm", "do: ¦“ParkArm”", "straight"),
    ("smart single quotes", "subsystem: chase", "subsystem: ¦‘chase’", "straight"),
    ("smart quotes that end a text", "about: Go to", "about: ¦“go”: to", "quotes"),
    ("non-breaking space after :", "timeout: 15 s", "timeout:¦\u00a015 s", "non-breaking space"),
    ("non-breaking indent", "        timeout: 15", "¦\u00a0       timeout: 15", "non-breaking space"),
    ("non-breaking space in a quantity", "15 s", "¦15\u00a0kg", "a mass"),
    ("digits of another script", "timeout: 15 s", "timeout: ¦١٥ s", "'15 s'"),
    ("digits of two scripts", "timeout: 15 s", "timeout: ¦1٥ s", "'15 s'"),
    ("full-width digits", "timeout: 15", "timeout: ¦１５", "a duration"),
    ("digits of another script alone", "timeout: 15", "timeout: ¦1٥", "a duration"),
    ("zero-width space", "do: ParkArm", "do: ¦Park\u200bArm", "invisible"),
    ("forgotten : of a node", "      park:\n", "      park¦\n", "`:`"),
    ("forgotten : of a key", "        do: ParkArm", "        do¦ ParkArm", "`:`"),
    ("forgotten : in {}", "chosen: drive,", "¦chosen drive,", "`:`"),
    ("forgotten : after the last key", "none: .failed}", "¦none .failed}", "`:`"),
    ("no space after :", "timeout: 15 s", "timeout¦:15 s", "space after"),
    ("no space after : in {}", "chosen: drive,", "¦chosen:drive,", "space after"),
    ("= for :", "timeout: 15 s", "timeout¦ = 15 s", "`:`"),
    ("full-width colon", "timeout: 15 s", "timeout¦：15 s", "`:`"),
    ("forgotten comma", "parked: choose, failed", "parked: choose¦ failed", "comma"),
    ("; for a comma", "{chosen: drive, none", "{chosen: drive¦; none", "comma"),
    ("trailing comma", "do: ParkArm", "do: ¦ParkArm,", "comma"),
    ("trailing comma after a quantity", "timeout: 15 s", "timeout: ¦15 s,", "comma"),
    ("merge marker", "outcomes: [done, failed]", "¦<<<<<<< HEAD\noutcomes: [done, failed]", "merge"),
    ("merge separator", "data:\n", "¦=======\ndata:\n", "merge"),
    ("merge end", "data:\n", "¦>>>>>>> branch\ndata:\n", "merge"),
    ("a second document", "data:\n", "¦---\ndata:\n", "one per file"),
    ("states as a list", f"states:\n{_PARK}", f"states:\n      ¦- park:\n{_PARK[12:]}", "no `- `"),
    ("one node of a list", "any:\n", "any:\n  ¦- warn: {do: WarnUser}\n", "-"),
    ("outcomes as text", "[done, failed]", "¦done, failed", "[done, failed]"),
    ("duplicate key", "timeout: 15 s", "timeout: 15 s\n        ¦do: ParkArm", "keep one"),
    ("duplicate node", "choose:\n", "park: {do: ParkArm}\n      ¦park: {do: ParkArm}\n      choose:\n",
     "keep one"),
    ("a list for a mapping", f"{_PARKED}", "next: ¦[choose]", "{a: b}"),
    ("a word for a mapping", f"{_PARKED}", "next: ¦choose", "{a: b}"),
    ("a comment without a space", "do: ParkArm", "do: ¦ParkArm# fold", "`ParkArm # …`"),
    ("leading zero", "priority: 1", "priority: ¦01", "write 1"),
    ("JSON comment", "data:\n", "¦// keys\ndata:\n", "#"),
]  # fmt: skip

NAMES = [
    ("Cyrillic key", "timeout: 15 s", "¦tim\u0435out: 15 s", "Cyrillic"),
    ("Cyrillic state class", "do: ParkArm", "do: ¦P\u0430rkArm", "Cyrillic"),
    ("Cyrillic outcome in next", "{chosen: drive", "{¦\u0441hosen: drive", "Cyrillic"),
    ("Cyrillic target", "none: .failed}", "none: ¦.f\u0430iled}", "Cyrillic"),
    ("Cyrillic declared outcome", "[done, failed]", "[¦d\u043ene, failed]", "Cyrillic"),
    ("Cyrillic node", "      choose:\n", "      ¦ch\u043eose:\n", "Cyrillic"),
    ("Greek letter", "in: {goal: goal}", "in: {goal: ¦g\u03bfal}", "Greek"),
    ("full-width letter", "do: ParkArm", "do: ¦ParkAr\uff4d", "full-width"),
    ("key in capitals", "timeout: 15 s", "¦Timeout: 15 s", "'timeout'"),
    ("state in lower case", "do: ParkArm", "do: ¦parkarm", "'ParkArm'"),
    ("state in snake case", "do: ParkArm", "do: ¦park_arm", "'ParkArm'"),
    ("outcome in capitals", "[done, failed]", "[¦DONE, failed]", "'done'"),
    ("target in capitals", "none: .failed}", "none: ¦.FAILED}", "'.failed'"),
    ("outcome: for outcomes:", "outcomes: [done", "¦outcome: [done", "'outcomes'"),
    ("state: for states:", "states:\n", "¦state:\n", "'states'"),
    ("parameter: for parameters:", "parameters:\n", "¦parameter:\n", "'parameters'"),
    ("transitions: for next:", "next: {chosen", "¦transitions: {chosen", "'next'"),
    ("on: for next:", "next: {chosen", "¦on: {chosen", "'next'"),
    ("goto: for next:", "next: {chosen", "¦goto: {chosen", "'next'"),
    ("params: for with:", "with: {subsystem", "¦params: {subsystem", "'with'"),
    ("parameters: for with:", "with: {subsystem", "¦parameters: {subsystem", "'with'"),
    ("inputs: for in:", "in: {goal", "¦inputs: {goal", "'in'"),
    ("output: for out:", "out: {pose", "¦output: {pose", "'out'"),
    ("class: for do:", "do: ParkArm", "¦class: ParkArm", "'do'"),
    ("description: for about:", _ABOUT, "¦description: Fold it.", "'about'"),
    ("name: for chart:", "chart: fetch", "¦name: fetch", "'chart'"),
    ("parallel: for any:", "        all:\n", "        ¦parallel:\n", "any"),
    ("misspelt state", "do: ParkArm", "do: ¦ParkAmr", "'ParkArm'"),
    ("misspelt target", "chosen: drive", "chosen: ¦drvie", "'drive'"),
    ("misspelt outcome of a state", "{parked: choose", "{¦parkd: choose", "'parked'"),
    ("misspelt parameter", "subsystem: chase", "¦subsytem: chase", "'subsystem'"),
    ("misspelt choice", "subsystem: chase", "subsystem: ¦chas", "'chase'"),
    ("misspelt input", "in: {goal: goal}", "in: {¦gaol: goal}", "'goal'"),
    ("misspelt output", "out: {pose: goal}", "out: {¦psoe: goal}", "'pose'"),
    ("misspelt data key", "in: {goal: goal}", "in: {goal: ¦goall}", "'goal'"),
    ("misspelt chart parameter", "$patience", "¦$patince", "'patience'"),
    ("misspelt child in when", "if: {away: far}", "if: {¦awya: far}", "'away'"),
    ("misspelt outcome in when", "if: {away: far}", "if: {away: ¦fra}", "'far'"),
    ("outcome of nobody", "none: .failed}", "none: .failed, ¦blocked: .failed}", "chosen"),
    (". forgotten", "none: .failed}", "none: ¦failed}", "'.failed'"),
    (". too much", "chosen: drive", "chosen: ¦.drive", "'drive', without the dot"),
    ("dot too much in a declaration", "[done, failed]", "[¦.done, failed]", "without the dot"),
    ("dot too much in when", "outcome: done, if", "outcome: ¦.done, if", "without the dot"),
    ("space after the dot", "none: .failed}", "none: ¦. failed}", "'.failed'"),
    ("target in any without a dot", "{required: .failed}", "{required: ¦failed}", "`.failed`"),
    ("a name that begins with a digit", "      choose:\n", "      ¦2nd:\n", "starting with a digit"),
    ("a name with a dash", "      choose:\n", "      ¦choose-pose:\n", "choose_pose"),
    ("a name with a space", "      choose:\n", "      ¦choose pose:\n", "choose_pose"),
    ("reserved outcome", "[done, failed]", "[done, failed, ¦error]", "reserved"),
    ("do for a monitor", "gone: {watch: UserLost", "gone: {¦do: UserLost", "`watch: UserLost`"),
    ("watch for an action", "do: ParkArm", "¦watch: ParkArm", "`do: ParkArm`"),
    ("two forms", "do: ParkArm", "do: ParkArm\n        ¦watch: UserLost", "exactly one of"),
    ("no form", _PARK, _PARK.replace("park", "¦park").replace("do: ", "# "), "exactly one of"),
    ("a chart by its file", "do: ParkArm", "use: ¦chase.yaml", "'chase'"),
    ("a chart under do", "do: ParkArm", "do: ¦chase", "`use: chase`"),
    ("a state under use", "do: ParkArm", "use: ¦ParkArm", "`do: ParkArm`"),
]  # fmt: skip

VALUES = [
    ("5 sec", "timeout: 15 s", "timeout: ¦15 sec", "15 s"),
    ("15 seconds", "timeout: 15 s", "timeout: ¦15 seconds", "15 s"),
    ("S for s", "timeout: 15 s", "timeout: ¦15 S", "15 s"),
    ("minutes as m", "timeout: 15 s", "timeout: ¦1 m", "min"),
    ("meters", "beyond: 4 m", "beyond: ¦4 meters", "4 m"),
    ("capital CM", "beyond: 4 m", "beyond: ¦400CM", "400 cm"),
    ("feet", "beyond: 4 m", "beyond: ¦12 ft", "m"),
    ("two units", "beyond: 4 m}", "beyond: ¦4 m 20 cm}", "a length"),
    ("decimal comma", "timeout: 15 s", "timeout: ¦1,5 s", "1.5 s"),
    ("a length for a duration", "timeout: 15 s", "timeout: ¦15 cm", "a duration"),
    ("negative timeout", "timeout: 15 s", "timeout: ¦-15 s", "above 0"),
    ("a word for a number", "timeout: 15 s", "timeout: ¦soon", "a duration"),
    ("$ forgotten", "timeout: $patience", "timeout: ¦patience", "$patience"),
    ("$ forgotten in with", "patience: 5 s", "patience: ¦patience", "$patience"),
    ("${} of a shell", "timeout: $patience", "timeout: ¦${patience}", "$patience"),
    ("initial: no", "initial: none", "initial: ¦no", "none"),
    ("initial: None", "initial: none", "initial: ¦None", "none"),
    ("no default", "default: 20 s", "default: ¦20 cm", "a duration"),
    ("two times", "times: 2", "times: ¦two", "whole number"),
    ("level in capitals", "{arrived: low}", "{arrived: ¦Low}", "'low'"),
    ("unknown level", "{arrived: low}", "{arrived: ¦medium}", "low"),
    ("type float", "type: Pose2, initial", "type: ¦float, initial", "'number'"),
    ("type str", "type: Pose2, initial", "type: ¦str, initial", "'text'"),
    ("type int", "type: Pose2, initial", "type: ¦int, initial", "'integer'"),
    ("type bool", "type: Pose2, initial", "type: ¦bool, initial", "'boolean'"),
    ("unknown type", "type: Pose2, initial", "type: ¦Pose, initial", "TYPES"),
    ("unknown parameter", "subsystem: chase,", "subsystem: chase, ¦hurry: 1 m/s,", "subsystem"),
    ("misspelt required parameter", "{beyond: 4 m}", "{¦beyonde: 4 m}", "'beyond'"),
    ("missing input", _DRIVE, _DRIVE.replace("D", "¦D").replace("in: {goal: goal}", ""), "`in: {goal: …}`"),
    ("in and out swapped", "out: {pose: goal}", "out: {¦goal: pose}", "`pose: goal`"),
    ("missing outcome", _CHOSEN, "¦next: {chosen: drive}", "`next: {none: …}`"),
    ("no next", _CHOOSE, "      ¦choose:\n        do: ChooseChasePose\n", "'chosen', 'none'"),
    ("timeout not mapped", _PARKED, "¦next: {parked: choose, failed: .failed}", "timeout: …"),
    ("timeout not set", f"timeout: 15 s\n        {_PARKED}", _PARKED.replace(" timeout", " ¦timeout"), "timeout"),
    ("target outside", "none: .failed}", "none: ¦.lost}", "not among its outcomes"),
    ("read before written", f"{_OUT}{_NEXT}{_DRIVE}", f"{_NEXT}{_DRIVE[:-6]}¦goal}}\n", "write it"),
    ("wrong type of a key", _FROM_DATA, _FROM_DATA.replace("Pose2", "Pose3")[:-5] + "¦goal}", "Pose2"),
    ("never reached", f"{_NEXT}      drive:", f"{_NEXT}      ¦drive:".replace(": drive,", ": .failed,"), "never reached"),
    ("never produced", "[done, failed]", "[done, failed, ¦lost]", "`.lost`"),
    ("unused parameter", "outcomes: [", "  ¦other: {type: length, default: 1 m}\noutcomes: [", "never"),
    ("consent of a guard", "priority: 1, ", "¦autonomy: {required: low}, ", "guard"),
    ("retry of a guard", "priority: 1, ", "¦retry: {times: 1, on: required}, ", "guard"),
    ("priority of an action", "do: ParkArm", "do: ParkArm\n        ¦priority: 1", "watch"),
    ("uncovered when", _WHEN, _WHEN.replace("watch: UserLost", "do: ParkArm").replace("when", "¦when")
     .replace("lost", "failed").replace("away: far", "away: far, gone: failed"), "parked"),
    ("never first", "- {outcome: failed, if: {gone", "- ¦{outcome: done, if: {away: far, gone", "never match"),
    ("one part twice", "  main:", f"  drive: {{do: DriveTo, in: {{goal: goal}}, {_ENDS}}}\n  ¦main:", "'base'"),
    ("a chart in itself", "do: ParkArm", "use: ¦fetch", "may not use itself"),
    ("unmapped error", f"{_PARK}{_REST}", f"{_PARK}{_REST}".replace("park", "¦park", 1).removesuffix(_MAPPED), "error"),
]  # fmt: skip
