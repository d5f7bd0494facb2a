"""Commands, options and names are completed, in the shells themselves where they are there."""

from __future__ import annotations

import os
import pty
import select
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cobodeck.__main__ import COMMANDS, main
from cobodeck.commands.completion import SHELLS
from cobodeck.terminal.console import OK, USAGE

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("sub/deep.yaml", "mine.yaml", "run.mcap", "walk.csv", "notes.md", ".hidden.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


def offered(capsys: pytest.CaptureFixture[str], *words: str, shell: str = "fish") -> list[str]:
    assert main(["completion", shell, *(f"={word}" for word in words)]) == OK
    out, err = capsys.readouterr()
    assert err == ""
    return out.splitlines()


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("sim", {"simulate"}),
        ("simulate --sc", {"--scene"}),
        ("simulate --scene lab", {"lab_a", "lab_b"}),
        ("simulate --scene=lab", {"--scene=lab_a", "--scene=lab_b"}),
        ("simulate --scene s", {"study", "sub/"}),
        ("simulate --scene lab_a --profile tu", {"tuned"}),
        ("simulate cha", {"chase"}),
        ("simulate m", {"mine.yaml"}),
        ("simulate --user random:d", {"random:deaf"}),
        ("simulate --user w", {"walk.csv"}),
        ("simulate --heading c", {"centred", "causal"}),
        ("simulate chase e", set()),
        ("run --robot mo", {"mock"}),
        ("list prof", {"profiles"}),
        ("list profiles pap", {"paper"}),
        ("list states ParkA", {"ParkArm"}),
        ("campaign --out x precision_tic", {"precision_tick"}),
        ("bench navi", {"navigation"}),
        ("render r", {"run.mcap"}),
        ("render --coverage run.mcap r", {"run.mcap"}),
        ("validate no", {"notes.md"}),
        ("validate sub/", {"sub/deep.yaml"}),
        ("validate .h", {".hidden.yaml"}),
        ("validate --format js", {"json"}),
        ("validate --json --str", {"--strict"}),
        ("nothing x", set()),
        ("localize --map la", {"lab_a", "lab_b"}),
    ],
)
def test_the_last_word_becomes(
    words: str, found: set[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert set(offered(capsys, *words.split(" "))) == found


def test_every_command_is_offered(capsys: pytest.CaptureFixture[str]) -> None:
    assert offered(capsys, "") == sorted(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_of_its_help_is_offered(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = offered(capsys, command, "--")
    assert main([command, "--help"]) == OK
    shown = capsys.readouterr().out

    assert {"--help", "--no-project", "--traceback"} <= set(found)
    assert all(name in shown for name in found)


def test_names_of_the_project_are_offered(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nmine = "mine_own.states"\n'
    )
    (folder / "mine_own").mkdir()
    (folder / "mine_own" / "states.py").write_text("raise RuntimeError('nothing is imported')\n")
    (folder / "mine_own" / "tea.yaml").write_text("chart: tea_round\noutcomes: [done]\n")

    assert offered(capsys, "simulate", "tea") == ["tea_round"]


@pytest.mark.usefixtures("folder")
def test_bash_tears_words_at_equals_signs_and_colons(capsys: pytest.CaptureFixture[str]) -> None:
    torn = ["simulate", "--user", "random", ":", "dea"]

    assert offered(capsys, *torn, shell="bash") == ["deaf"]
    assert offered(capsys, "simulate", "--scene", "=", "lab", shell="bash") == ["lab_a", "lab_b"]


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        (r"my\ f", [r"my\ floor.yml"]),
        ("'my f", ["my floor.yml"]),
        ('"my f', ["my floor.yml"]),
        ("my", [r"my\ floor.yml", r"my\$\(x\)\'\!.yaml"]),
        ('"my$', []),  # bash would look for an older line at the exclamation mark
        (r'"su', ["sub/"]),
        (r"'my$", []),
    ],
)
def test_bash_goes_on_from_quotes_and_backslashes(
    typed: str, found: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "my floor.yml").touch()
    (folder / "my$(x)'!.yaml").touch()

    assert offered(capsys, "simulate", typed, shell="bash") == sorted(found)
    assert offered(capsys, "simulate", "--scene", "=", typed, shell="bash") == sorted(found)


def test_another_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "csh"]) == USAGE
    assert "invalid choice: 'csh'" in capsys.readouterr().err


# -- in the shells ---------------------------------------------------------------------------------

BASH = """
eval "$(cobodeck completion bash)"
try() { COMP_WORDS=(cobodeck "$@"); COMP_CWORD=$#; _cobodeck; echo "${COMPREPLY[*]}"; }
compopt() { :; }
try simulate --sce; try simulate --scene la; try val
"""
FISH = """
cobodeck completion fish | source
complete -C 'cobodeck simulate --sce'
string join ' ' (complete -C 'cobodeck simulate --scene la')
complete -C 'cobodeck val'
"""
ZSHRC = """
PS1='> '
autoload -Uz compinit && compinit -u -D
eval "$(cobodeck completion zsh)"
print REA''DY
"""


def environment(shell: str, folder: Path) -> dict[str, str]:
    if shutil.which(shell) is None:
        pytest.skip(f"no `{shell}` on the PATH")
    program = folder / "cobodeck"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m cobodeck "$@"\n')
    program.chmod(0o755)
    paths = {"PATH": f"{folder}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    own = {"HOME": str(folder), "ZDOTDIR": str(folder), "TERM": "dumb"}
    return {**os.environ, **paths, **own}


@pytest.mark.slow
@pytest.mark.parametrize(("shell", "script"), [("bash", BASH), ("fish", FISH)])
def test_the_shell_completes(shell: str, script: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [shell, "-c", script],
        cwd=tmp_path, env=environment(shell, tmp_path),
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip

    assert done.stdout.splitlines() == ["--scene", "lab_a lab_b", "validate"], done.stderr


@pytest.mark.parametrize("name", ["$(touch here).yaml", "a b.yaml", "*", "q'uote", "x;touch y"])
def test_bash_gets_names_that_run_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is put into the command line is that name for the shell, and nothing else."""
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / name).touch()
    monkeypatch.chdir(tmp_path / "files")
    [given] = offered(capsys, "validate", "", shell="bash")
    script = f"""{SHELLS["bash"]}
cobodeck() {{ printf '%s\\n' "$NAME"; }}
COMP_WORDS=(cobodeck validate ''); COMP_CWORD=2; _cobodeck
eval "printf '<%s>' ${{COMPREPLY[*]}}"
"""
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=tmp_path, env={**environment("bash", tmp_path), "NAME": given},
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip

    assert done.stdout == f"<{name}>"
    assert {file.name for file in tmp_path.iterdir()} == {"cobodeck", "files"}
    assert [file.name for file in (tmp_path / "files").iterdir()] == [name]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("typed", "whole"),
    [
        ("cobodeck simulate --scene stu", "dy "),
        ("cobodeck simulate --sce", "ne "),
        ("cobodeck simulate --scene=vir", "tual_wall "),
        ("cobodeck simulate --user random:dea", "f "),
        ("cobodeck cali", "brate "),
    ],
)
def test_zsh_completes(typed: str, whole: str, tmp_path: Path) -> None:
    variables = environment("zsh", tmp_path)
    (tmp_path / ".zshrc").write_text(ZSHRC)
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(tmp_path)
        os.execvpe("zsh", ["zsh", "-i"], variables)
    try:
        assert "READY" in shown_until(terminal, "READY")
        os.write(terminal, f"{typed}\t".encode())
        assert shown_until(terminal, whole).replace("\a", "").endswith(typed + whole)
    finally:
        os.close(terminal)
        os.waitpid(process, 0)


def shown_until(terminal: int, end: str) -> str:
    """What a shell shows, up to these characters, or for as long as a broken one is waited for."""
    shown = ""
    while not shown.endswith(end) and select.select([terminal], [], [], 60.0)[0]:
        shown += os.read(terminal, 1).decode(errors="replace")
    return shown
