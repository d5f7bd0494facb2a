"""The forms in which findings are shown."""

from __future__ import annotations

import json
import re
from urllib.parse import unquote

import jsonschema
import pytest
from hypothesis import given, settings, strategies as st

from engine.files.finding import Finding, Place
from engine.files.source import SourceFile
from engine.reports import FORMATS, WIDTH, github, json_object, report, sarif, summary, text
from tests.repeats import examples

CHART = "chart: chase\nstates:\n  drive: {do: DriveTo, parms: {}}\n"


def sources(content: str, file: str = "a.yaml") -> dict[str, SourceFile]:
    return {file: SourceFile(file, content)}


def at(line: int, column: int, end: int, **more: object) -> Finding:
    return Finding("C01", "unknown key 'parms'", Place("a.yaml", line, column, end), **more)  # type: ignore[arg-type]


def test_text_shows_place_line_caret_help_and_counts() -> None:
    finding = at(3, 24, 29, hint="did you mean 'params'?")
    assert text([finding], sources(CHART)) == (
        "a.yaml:3:24: error[C01] unknown key 'parms'\n"
        "    3 |   drive: {do: DriveTo, parms: {}}\n"
        "      |                        ^~~~~\n"
        "      = help: did you mean 'params'?\n"
        "1 error in 1 file\n"
    )


def test_related_places_follow_as_notes_with_their_own_line() -> None:
    finding = at(3, 3, 8, related=((Place("a.yaml", 1, 1, 6), "first here"),))
    shown = text([finding], sources(CHART)).splitlines()
    assert shown[3:6] == ["a.yaml:1:1: note: first here", "    1 | chart: chase", "      | ^~~~~"]


@pytest.mark.parametrize(
    ("severities", "files", "line"),
    [
        ([], 3, "no errors in 3 files"),
        (["error"], 1, "1 error in 1 file"),
        (["warning", "warning"], 1, "2 warnings in 1 file"),
        (["error", "warning", "error"], 2, "2 errors and 1 warning in 2 files"),
        (["note", "error"], 2, "1 error and 1 note in 2 files"),
    ],
)
def test_the_last_line_counts(severities: list[str], files: int, line: str) -> None:
    assert summary([at(1, 1, 2, severity=severity) for severity in severities], files) == line


def caret_text(shown: str) -> str:
    """What stands above the carets of the first excerpt, by characters."""
    line, carets = shown.splitlines()[1:3]
    start = carets.index("^")
    return line[start : start + carets.count("~") + 1]


def test_a_tab_before_the_mark_keeps_the_caret_in_place() -> None:
    assert caret_text(text([at(1, 4, 9)], sources("\ta\tparms: 1\n"))) == "parms"


def test_wide_characters_before_the_mark_take_two_columns() -> None:
    line, carets = text([at(1, 6, 11)], sources("危険é: parms\n")).splitlines()[1:3]
    assert line == "    1 | 危険é: parms"
    assert carets == "      | " + " " * 7 + "^~~~~"  # five characters, two of them wide


def test_combining_accents_take_no_column() -> None:
    line = text([at(1, 5, 10)], sources("e\u0301: parms\n")).splitlines()[2]
    assert line.index("^") - len("      | ") == 3


def test_control_characters_never_reach_the_terminal() -> None:
    finding = Finding("C01", "key '\x1b[31m'\nnext", Place("a.yaml", 1, 1, 2))
    shown = text([finding], sources("\x1b[31mred: \u202e1\n"))
    assert "\x1b" not in shown
    assert "\u202e" not in shown
    assert len(shown.splitlines()) == 4


def test_a_long_line_is_cut_around_the_caret() -> None:
    content = "a: " + "x" * 500 + " parms " + "y" * 500
    shown = text([at(1, 505, 510)], sources(content))
    line, carets = shown.splitlines()[1:3]
    assert caret_text(shown) == "parms"
    assert line.count("…") == 2
    assert len(line) <= WIDTH + len("    1 | ") + 2
    assert len(carets) <= len(line)


def test_a_long_mark_is_shown_from_its_start() -> None:
    shown = text([at(1, 4, 704)], sources("a: " + "x" * 700))
    line, carets = shown.splitlines()[1:3]
    assert line.startswith("    1 | a: xxx")
    assert line.endswith("x…")
    assert "^~~~" in carets


def test_a_place_without_a_line_shows_the_message_alone() -> None:
    assert text([at(9, 1, 2)], sources(CHART)).splitlines()[1] == "1 error in 1 file"
    assert text([at(1, 1, 2)], {}).splitlines()[1] == "1 error in 0 files"


@settings(derandomize=True, deadline=None, max_examples=examples(300))
@given(
    content=st.text(st.characters(codec="utf-8"), max_size=300),
    line=st.integers(1, 5),
    column=st.integers(1, 320),
    length=st.integers(-1, 320),
    hint=st.text(max_size=20),
)
def test_any_place_in_any_text_can_be_shown(
    content: str, line: int, column: int, length: int, hint: str
) -> None:
    finding = at(line, column, column + length, hint=hint)
    for form in FORMATS:
        shown = report([finding], sources(content), form)
        assert shown.endswith("\n")
    for row in text([finding], sources(content)).splitlines():
        assert not re.search("[\x00-\x08\x0b-\x1f\x7f]", row)
        assert len(row) <= 2 * WIDTH


def test_json_has_one_object_per_finding_with_all_places() -> None:
    related = ((Place("b.yaml", 1, 1, 6), "first here"),)
    found = json.loads(json_object([at(3, 24, 29, related=related)], ["a.yaml"]))
    assert found["findings"] == [
        {
            "code": "C01",
            "severity": "error",
            "message": "unknown key 'parms'",
            "hint": "",
            "file": "a.yaml",
            "line": 3,
            "column": 24,
            "end_column": 29,
            "related": [
                {"file": "b.yaml", "line": 1, "column": 1, "end_column": 6, "message": "first here"}
            ],
        }
    ]


def test_json_names_the_files_also_without_findings() -> None:
    found = json.loads(report([], sources("chart: a\n"), "json"))
    assert found == {"files": ["a.yaml"], "findings": []}


def test_github_escapes_what_would_end_a_part_of_the_command() -> None:
    finding = Finding("W01", "50 %\r\nof: a, b", Place("dir,x:y.yaml", 2, 3, 7), severity="warning")
    assert github([finding]) == (
        "::warning file=dir%2Cx%3Ay.yaml,line=2,col=3,endColumn=7,title=W01::50 %25%0D%0Aof: a, b\n"
    )


@settings(derandomize=True, deadline=None, max_examples=examples(200))
@given(message=st.text(max_size=50), file=st.text(min_size=1, max_size=20))
def test_a_github_command_is_one_line_that_decodes_to_the_message(message: str, file: str) -> None:
    shown = github([Finding("C01", message, Place(file, 1, 1, 2))])
    assert "\n" not in shown[:-1]
    assert "\r" not in shown
    properties, data = shown[len("::error ") : -1].split("::", 1)
    assert unquote(data, errors="surrogatepass") == message
    first = properties.split(",", 1)[0]
    assert unquote(first.removeprefix("file="), errors="surrogatepass") == file


REGION = {
    "type": "object",
    "required": ["startLine", "startColumn", "endColumn"],
    "additionalProperties": False,
    "properties": {
        name: {"type": "integer", "minimum": 1}
        for name in ("startLine", "startColumn", "endColumn")
    },
}
LOCATION = {
    "type": "object",
    "required": ["physicalLocation"],
    "additionalProperties": False,
    "properties": {
        "id": {"type": "integer", "minimum": 0},
        "message": {"$ref": "#/definitions/message"},
        "physicalLocation": {
            "type": "object",
            "required": ["artifactLocation", "region"],
            "additionalProperties": False,
            "properties": {
                "artifactLocation": {
                    "type": "object",
                    "required": ["uri"],
                    "additionalProperties": False,
                    "properties": {
                        "uri": {"type": "string", "pattern": r"^[A-Za-z0-9._~:/?#@!$&'()*+,;=%-]+$"}
                    },
                },
                "region": REGION,
            },
        },
    },
}
SARIF = {  # the parts of sarif-schema-2.1.0.json (OASIS) that a checker's log uses
    "definitions": {
        "message": {
            "type": "object",
            "required": ["text"],
            "additionalProperties": False,
            "properties": {"text": {"type": "string"}},
        },
        "location": LOCATION,
        "result": {
            "type": "object",
            "required": ["message", "ruleId", "ruleIndex", "level", "locations"],
            "additionalProperties": False,
            "properties": {
                "ruleId": {"type": "string"},
                "ruleIndex": {"type": "integer", "minimum": 0},
                "level": {"enum": ["none", "note", "warning", "error"]},
                "message": {"$ref": "#/definitions/message"},
                "locations": {"type": "array", "items": {"$ref": "#/definitions/location"}},
                "relatedLocations": {
                    "type": "array",
                    "uniqueItems": True,
                    "items": {"$ref": "#/definitions/location"},
                },
            },
        },
        "rule": {
            "type": "object",
            "required": ["id"],
            "additionalProperties": False,
            "properties": {"id": {"type": "string"}},
        },
        "run": {
            "type": "object",
            "required": ["tool", "results"],
            "additionalProperties": False,
            "properties": {
                "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
                "results": {"type": "array", "items": {"$ref": "#/definitions/result"}},
                "tool": {
                    "type": "object",
                    "required": ["driver"],
                    "additionalProperties": False,
                    "properties": {
                        "driver": {
                            "type": "object",
                            "required": ["name"],
                            "additionalProperties": False,
                            "properties": {
                                "name": {"type": "string"},
                                "rules": {
                                    "type": "array",
                                    "uniqueItems": True,
                                    "items": {"$ref": "#/definitions/rule"},
                                },
                            },
                        }
                    },
                },
            },
        },
    },
    "type": "object",
    "required": ["$schema", "version", "runs"],
    "additionalProperties": False,
    "properties": {
        "$schema": {"type": "string", "format": "uri"},
        "version": {"enum": ["2.1.0"]},
        "runs": {
            "type": "array",
            "minItems": 1,
            "maxItems": 1,
            "items": {"$ref": "#/definitions/run"},
        },
    },
}

FINDINGS = st.builds(
    Finding,
    st.sampled_from(["C01", "N05", "W01"]),
    st.text(max_size=30),
    st.builds(
        lambda file, line, column, more: Place(file, line, column, column + more),
        st.sampled_from(["a.yaml", "charts/ä b.yaml", "<text>", "/abs/x.yaml", "c:d.yaml"]),
        st.integers(1, 99),
        st.integers(1, 99),
        st.integers(0, 20),
    ),
    severity=st.sampled_from(["error", "warning", "note"]),
    related=st.sampled_from([(), ((Place("b.yaml", 1, 1, 6), "first here"),)]),
)


@settings(derandomize=True, deadline=None, max_examples=examples(100))
@given(st.lists(FINDINGS, max_size=5))
def test_sarif_has_the_structure_of_2_1_0_and_names_every_rule(findings: list[Finding]) -> None:
    log = json.loads(sarif(findings))
    jsonschema.Draft7Validator(SARIF).validate(log)
    run = log["runs"][0]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert len(run["results"]) == len(findings)
    for result, finding in zip(run["results"], findings, strict=True):
        assert rules[result["ruleIndex"]] == result["ruleId"] == finding.code
        location = result["locations"][0]["physicalLocation"]
        uri = unquote(location["artifactLocation"]["uri"]).removeprefix("file://")
        assert uri == finding.place.file
        assert location["region"]["startLine"] == finding.place.line


def test_an_unknown_format_is_refused() -> None:
    with pytest.raises(KeyError):
        report([], {}, "xml")  # type: ignore[arg-type]
