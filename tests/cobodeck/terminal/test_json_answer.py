"""With --json a program reads one object from standard output, whatever happens."""

from __future__ import annotations

import importlib
import io
import json
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import pytest

import cobodeck.commands.list
from cobodeck.__main__ import COMMANDS, main
from cobodeck.bench.harness import BenchRow
from cobodeck.terminal import CommandParser, Problem, show, show_json
from cobodeck.terminal.console import FAILED, OK, REFUSED, USAGE

Asked = Callable[..., tuple[int, dict[str, Any], str]]


@pytest.fixture
def asked(capsys: pytest.CaptureFixture[str]) -> Asked:
    def ask(*words: str) -> tuple[int, dict[str, Any], str]:
        """The exit code, the object, and standard error."""
        code = main(words)
        out, err = capsys.readouterr()
        found = json.loads(out)
        assert isinstance(found, dict)
        assert out.count("\n") == 1
        return code, found, err

    return ask


def test_the_answer_is_one_line_that_is_compact(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "users", "--json"]) == OK
    line = capsys.readouterr().out
    assert main(["list", "users", "--pretty"]) == OK
    pretty = capsys.readouterr().out

    assert line.count("\n") == 1
    assert '", "' not in line
    assert pretty.startswith('{\n  "users": [\n')
    assert json.loads(pretty) == json.loads(line)


@pytest.mark.parametrize("words", [("--json", "--pretty"), ("--pretty", "--json"), ("--pret",)])
def test_pretty_counts_wherever_it_stands(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", *words, "users"]) == OK
    assert capsys.readouterr().out.startswith("{\n")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_indented_lines() -> None:
    with redirect_stdout(Terminal()) as shown:
        assert main(["list", "users", "--json"]) == OK

    assert shown.getvalue().startswith('{\n  "users"')


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        ("list things --json", USAGE, "invalid choice: 'things'"),
        ("list users --jason --json", USAGE, "unrecognized arguments: --jason"),
        ("list charts chse --json", USAGE, "did you mean 'chase'"),
        ("validate nothing.yaml --json", USAGE, "no such file"),
        ("validate nothing.yaml --format json", USAGE, "no such file"),
        ("compare a.mcap b.mcap --js", USAGE, "a.mcap: cannot be read"),
        ("chase --json", USAGE, "no command 'chase'"),
    ],
)
@pytest.mark.usefixtures("elsewhere")
def test_a_failure_is_an_object_too(words: str, code: int, told: str, asked: Asked) -> None:
    found_code, found, err = asked(*words.split())

    assert (found_code, found["exit_code"]) == (code, code)
    assert told in found["error"]
    assert told in err


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def does(run: Callable[[], None], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `list` do this."""

    def instead(_args: object) -> int:
        run()
        return OK

    monkeypatch.setattr(cobodeck.commands.list, "run", instead)


def test_what_else_is_printed_goes_to_standard_error(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run() -> None:
        sys.stdout.write("printed by a state\n")
        show_json({"a": 1})
        show("a table")

    does(run, monkeypatch)

    assert asked("list", "users", "--json") == (OK, {"a": 1}, "printed by a state\na table\n")


def test_after_an_answer_a_failure_is_no_second_object(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run() -> None:
        show_json({"a": 1})
        raise Problem("the picture cannot be drawn", REFUSED)

    does(run, monkeypatch)

    assert asked("list", "users", "--json") == (
        REFUSED,
        {"a": 1},
        "cobodeck: the picture cannot be drawn\n",
    )


def test_without_it_nothing_is_changed(capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout

    assert main(["list", "charts", "chse"]) == USAGE

    assert capsys.readouterr().out == ""
    assert sys.stdout is before


def test_help_is_for_people_all_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "--json", "--help"]) == OK
    assert capsys.readouterr().out.startswith("usage: cobodeck list")


@pytest.mark.parametrize("command", COMMANDS)
def test_who_answers_programs_can_be_asked_for_lines(command: str) -> None:
    parser = CommandParser(command, None)
    importlib.import_module(f"cobodeck.commands.{command.replace('-', '_')}").arguments(parser)

    assert ("--json" in parser.options) == ("--pretty" in parser.options)


def test_files_are_checked_into_one_object(tmp_path: Path, asked: Asked) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("chart: mine\noutcomes: [done]\nstates:\n  a: {do: Nothing}\n")

    code, found, err = asked("validate", str(file), "--json", "--no-project")

    assert code == FAILED
    assert found["files"] == [str(file)]
    assert {one["line"] for one in found["findings"]} == {4}
    assert (found["in_code"], err) == ([], "")


def test_what_is_worse_than_before_is_in_the_object_of_a_bench(
    tmp_path: Path, asked: Asked
) -> None:
    machine = {"name": "M", "cores": 1, "system": "S", "python": "P"}
    files = []
    for name, ratio in (("now", 9.0), ("before", 1.0)):
        rows = [BenchRow("b", "n", "cobodeck", ratio=ratio, ratio_to="a unit").plain()]
        files.append(tmp_path / f"{name}.json")
        files[-1].write_text(json.dumps({"machine": machine, "rows": rows}))

    now, before = map(str, files)
    code, found, err = asked("bench", "--show", now, "--compare", before, "--json")

    assert code == FAILED
    assert len(found["worse"]) == 1
    assert found["rows"][0]["ratio"] == 9.0
    assert err == f"1 of 1 rows compared with {before}\n"
