"""One list of checks: each is asked on its occasions, about what is at hand; none is left out."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from inspect import Parameter, Signature
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given, strategies as st

from cobodeck.checks import case
from cobodeck.checks.case import Case
from cobodeck.fitness import check_list as checks
from cobodeck.fitness.check import BAD, CheckResult, FitnessCheck, Occasion
from cobodeck.fitness.check_list import CHECKS, ask, require
from cobodeck.terminal.console import FAILED, REFUSED, USAGE, Problem
from engine.files.finding import FileError, Finding, Place
from hw.connection.connection import load_connection
from hw.drivers.needs import Listening, Observed

FOLDER = Path(case.__file__).parent
OCCASIONS = get_args(Occasion)


@pytest.mark.parametrize("one", CHECKS, ids=lambda one: one.question)
def test_a_check_takes_what_a_case_has_by_the_same_types(one: FitnessCheck) -> None:
    of_case = inspect.get_annotations(Case)
    for name in one.parameters:
        asked = str(inspect.get_annotations(one.answers)[name]).removesuffix(" | None")
        assert str(of_case[name].__forward_arg__).removesuffix(" | None") == asked
    assert one.question.endswith("?")
    assert one.occasions
    assert set(one.occasions) <= set(OCCASIONS)


def test_no_question_is_asked_twice_and_no_occasion_is_without_one() -> None:
    questions = [one.question for one in CHECKS]

    assert len(set(questions)) == len(questions)
    assert {occasion for one in CHECKS for occasion in one.occasions} == set(OCCASIONS)


def test_every_function_that_answers_is_in_the_list() -> None:
    """A check that somebody writes and forgets to list would never be asked."""
    listed = {(one.answers.__module__, one.answers.__name__) for one in CHECKS}
    written = {
        (f"cobodeck.checks.{file.stem}", node.name)
        for file in FOLDER.glob("*.py")
        for node in ast.parse(file.read_text()).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
        if node.returns is not None and ast.unparse(node.returns) == "Iterator[CheckResult]"
    }

    assert written == listed


def check_by(answer: Any, occasion: Any) -> FitnessCheck:
    """A check with an answer of its own."""
    one = FitnessCheck("?", "", (occasion,))
    one.__dict__["answers"] = answer
    return one


NAMES = ("connection", "profile", "robot", "uses")


@given(
    needed=st.sets(st.sampled_from(NAMES)),
    welcome=st.sets(st.sampled_from(NAMES)),
    there=st.dictionaries(st.sampled_from(NAMES), st.integers()),
    occasion=st.sampled_from(OCCASIONS),
    now=st.sampled_from(OCCASIONS),
)
def test_a_check_is_asked_if_its_occasion_is_there_and_all_that_it_needs(
    needed: set[str], welcome: set[str], there: dict[str, int], occasion: Any, now: Any
) -> None:
    def answer(**given: int) -> Iterator[Any]:
        yield given

    empty = Parameter.empty
    answer.__signature__ = Signature(  # type: ignore[attr-defined]
        Parameter(name, Parameter.KEYWORD_ONLY, default=empty if name in needed else None)
        for name in sorted(needed | welcome)
    )

    found: list[Any] = list(check_by(answer, occasion).asked(now, there))

    if occasion != now or needed - there.keys():
        assert not found
    else:
        assert found == [{name: there[name] for name in (needed | welcome) & there.keys()}]


@pytest.mark.parametrize("code", [USAGE, FAILED, REFUSED])
def test_a_bad_answer_ends_a_run_with_its_code_or_with_the_place_in_a_file(
    code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    finding = Finding("D01", "too small", Place("a.yaml", 3, 1, 2))
    bad = CheckResult("a", BAD, "it is", "make it large", code=code)
    answers = {
        "machine": CheckResult("a", "missing", "it is"),
        "start": bad,
        "run": CheckResult("a", BAD, "it is", said="said", code=code),
        "doctor": CheckResult("a", BAD, "it is", findings=(finding,)),
    }

    def listed(occasion: Any) -> FitnessCheck:
        def answer() -> Iterator[CheckResult]:
            yield answers[occasion]

        return check_by(answer, occasion)

    monkeypatch.setattr(checks, "CHECKS", tuple(map(listed, answers)))

    require("machine")
    with pytest.raises(Problem, match=r"^it is; make it large$") as problem:
        require("start")
    assert problem.value.code == code
    with pytest.raises(Problem, match=r"^said$"):
        require("run")
    with pytest.raises(FileError, match=r"a\.yaml:3"):
        require("doctor")


class Lidar:
    """A driver of somebody's own, who says all there is to say in its one file."""

    needs = ("nobody_has_this",)

    @staticmethod
    def listens(port: int, **_: Any) -> list[Listening]:
        return [Listening("tcp", "127.0.0.1", port)]

    @staticmethod
    def probe(host: str, **_: Any) -> str:
        if host == "127.0.0.9":
            raise OSError(f"{host} does not answer")
        return f"{host} says that it is a lidar"

    @staticmethod
    def observed(port: int, **_: Any) -> Observed:
        return Observed("127.0.0.1", port + 1)


ENTRY = "links: {{own: {{driver: '{driver}', host: {host}, port: 47301}}}}\n"
HEAD = "connection: own\nmodel: rbkairos_ur10\n"


def told(folder: Path, driver: str, host: str = "127.0.0.1") -> list[tuple[str, str, str]]:
    file = folder / "own.yaml"
    part = f"parts: {{lidar: {{driver: '{driver}', link: own}}}}\n"
    file.write_text(HEAD + ENTRY.format(driver=driver, host=host) + part)
    found = ask("doctor", connection=load_connection(file), packages={"hw"})
    return [answer.line for answer in found if answer.what in ("links.own", "observer")]


def test_a_driver_says_beside_its_code_what_it_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hw.connection.connection.Lidar", Lidar, raising=False)
    name = "hw.connection.connection:Lidar"

    found = told(tmp_path, name)

    lacks = f"{name} needs the package nobody_has_this; a simulation works without it"
    assert found == [
        ("links.own", "bad", lacks),
        ("links.own", "ok", "127.0.0.1 says that it is a lidar"),
        ("links.own", "ok", "port 47301 is free"),
        ("observer", "note", "somebody has to watch: cobodeck observe 127.0.0.1:47302"),
    ]
    silent = told(tmp_path, name, "127.0.0.9")
    assert ("links.own", "bad", "127.0.0.9 does not answer") in silent


def test_of_a_driver_of_no_project_nothing_is_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere.py").write_text("raise SystemExit('imported')\n")
    monkeypatch.syspath_prepend(str(tmp_path))

    found = told(tmp_path, "elsewhere:Lidar")

    assert found[0] == ("links.own", "bad", "elsewhere:Lidar is of no project; go to its folder")
