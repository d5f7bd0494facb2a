"""Wrong options and choices are told with what was meant; help fits into 80 columns."""

from __future__ import annotations

import pytest

from cobodeck.__main__ import COMMANDS, command_parser, main
from cobodeck.terminal.console import OK, USAGE


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("simulate --sceen lab_a", "unrecognized arguments: --sceen; did you mean '--scene'?"),
        ("simulate --sceen=lab_a", "--sceen=lab_a; did you mean '--scene'?"),
        ("simulate --heading causel", "invalid choice: 'causel' (choose from"),
        ("simulate --heading causel", "did you mean 'causal'?"),
        ("reach --arm", "--arm; see cobodeck reach --help"),
        ("reach --prak", "--prak; did you mean '--park'?"),
        ("simulate --qqq", "--qqq; see cobodeck simulate --help"),
        ("list chrts", "did you mean 'charts'?"),
        ("case x.mcap --att 3", "--att; did you mean '--at'?"),
        ("list users --jsn", "did you mean '--json'?"),
    ],
)
def test_what_was_meant_is_told(words: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == USAGE

    *_, last = capsys.readouterr().err.splitlines()
    assert told in last


def test_options_may_be_abbreviated(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "users", "--no-proj"]) == OK
    assert "demo" in capsys.readouterr().out


@pytest.mark.parametrize("columns", [None, "40", "300"])
def test_help_is_at_most_80_columns_wide(
    columns: str | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if columns is None:
        monkeypatch.delenv("COLUMNS", raising=False)
    else:
        monkeypatch.setenv("COLUMNS", columns)
    for words in ([], *([name] for name in COMMANDS)):
        assert main([*words, "--help"]) == OK
        shown = capsys.readouterr().out.splitlines()
        assert [line for line in shown if len(line) > 80] == [], words


@pytest.mark.parametrize("command", COMMANDS)
def test_help_tells_all_of_the_description_and_each_option(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    module, parser = command_parser(command)

    shown = " ".join(parser.format_help().split())

    assert module.__doc__ is not None
    assert " ".join(module.__doc__.split()) in shown
    assert all(name in shown for name in parser.options)
