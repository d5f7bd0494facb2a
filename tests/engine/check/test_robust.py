"""Whatever a file holds, there is a finding with a place, and no exception, hang or flood."""

from __future__ import annotations

import random
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.project.state_catalogue import catalogue, shipped_charts
from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.source import read
from engine.machine.machine import Machine
from engine.machine.named_values import NamedValues
from tests.engine.check import nasty
from tests.engine.check.some_charts import INTERFACES

ROOT = Path(__file__).resolve().parents[3]
RUBBISH = (
    b"\x00", b"\xff", b"\xc3", b"\t", b"'", b'"', b"{", b"]", b": ", b"- ", b"&a ", b"*a ", b"!!x ",
    b"|\n", b"%", b"\xe2\x80\xa8", b"\r", b"? ", b"---\n", b"# ", b"$", b".",
)  # fmt: skip
VALUES = (b"[]", b"{}", b"5", b"-1", b"012", b"1e3", b"1e400", b"yes", b"null", b"''", b"[a, b]",
          b"{a: b}", b"5 parsec", b"$nothing", b".nowhere", b"x" * 300)  # fmt: skip


def delete_line(lines: list[bytes], chance: random.Random) -> None:
    del lines[chance.randrange(len(lines))]


def repeat_line(lines: list[bytes], chance: random.Random) -> None:
    line = chance.choice(lines)
    lines.insert(chance.randrange(len(lines)), line)


def swap_lines(lines: list[bytes], chance: random.Random) -> None:
    one, two = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[one], lines[two] = lines[two], lines[one]


def put_in_rubbish(lines: list[bytes], chance: random.Random) -> None:
    at = chance.randrange(len(lines))
    column = chance.randrange(len(lines[at]) + 1)
    lines[at] = lines[at][:column] + chance.choice(RUBBISH) + lines[at][column:]


def mistype(lines: list[bytes], chance: random.Random) -> None:
    at = chance.choice([i for i, line in enumerate(lines) if line.strip()])
    column = chance.randrange(len(lines[at]))
    letter = chance.choice(b"abcxyz_019 ").to_bytes(1, "big")
    lines[at] = lines[at][:column] + letter + lines[at][column + 1 :]


def change_value(lines: list[bytes], chance: random.Random) -> None:
    at = chance.choice([i for i, line in enumerate(lines) if b": " in line])
    key, _, value = lines[at].partition(b": ")
    end = value[value.find(b"}") :] if b"}" in value else b""
    lines[at] = key + b": " + chance.choice(VALUES) + end


MUTATIONS: tuple[Callable[[list[bytes], random.Random], None], ...] = (
    delete_line, repeat_line, swap_lines, put_in_rubbish, mistype, change_value,
)  # fmt: skip


@pytest.fixture(scope="module")
def known() -> Any:
    return catalogue()


@pytest.mark.parametrize("start", range(0, 240, 20))
def test_mutated_charts_give_findings_with_places_or_can_be_built(known: Any, start: int) -> None:
    around = NamedValues(load_profile("tuned").constants)
    for seed in range(start, start + 20):
        chance = random.Random(seed)
        library = Library()
        mutated = chance.choice(list(shipped_charts()))
        for file in shipped_charts():
            lines = file.read_bytes().split(b"\n")
            if file == mutated:
                MUTATIONS[seed % len(MUTATIONS)](lines, chance)
            library.add(read(b"\n".join(lines), file.name))
        found = check(library, known.interfaces, types=known.types, around=around)
        for finding in found:
            count = library.sources[finding.place.file].text.count("\n") + 1
            assert 1 <= finding.place.line <= count + 1
            assert 1 <= finding.place.column < finding.place.end_column
            assert finding.message
        if all(finding.severity == "warning" for finding in found):
            for chart in library.values():
                if not any(parameter.required for parameter in chart.parameters.values()):
                    Machine(chart, library, known.interfaces, types=known.types, around=around)


@pytest.mark.parametrize("share", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_nasty_files_are_refused_within_300_mb_and_without_a_hang(share: int) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (300_000_000, 300_000_000))
        resource.setrlimit(resource.RLIMIT_CPU, (120, 120))

    command = [sys.executable, "-m", "tests.engine.check.nasty", str(share)]
    done = subprocess.run(command, cwd=ROOT, preexec_fn=limit, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    assert len(done.stdout.splitlines()) == len(list(nasty.cases())[::share])


def calls(work: Callable[[], Any]) -> int:
    """How many Python functions are called; the same on every machine."""
    count = 0

    def profile(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal count
        count += event == "call"

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(before)
    return count


def sequence(n: int) -> str:
    lines = "".join(
        f"  s{i}: {{do: Wait, with: {{time: 1 s}}, next: {{done: s{i + 1}}}}}\n" for i in range(n)
    )
    return f"chart: c\noutcomes: [done]\nstates:\n{lines}  s{n}: {nasty.WORK}\n"


def parallel(n: int) -> str:
    lines = "".join(f"  s{i}: {nasty.WORK}\n" for i in range(n))
    return f"chart: c\noutcomes: [done]\nany:\n{lines}"


def joined(n: int) -> str:
    lines = "".join(f"  s{i}: {{do: Work}}\n" for i in range(n))
    failed = "".join(f"  - {{outcome: done, if: {{s{i}: failed}}}}\n" for i in range(n))
    done = ", ".join(f"s{i}: done" for i in range(n))
    text = (
        f"chart: c\noutcomes: [done]\nall:\n{lines}when:\n  - {{outcome: done, if: {{{done}}}}}\n"
    )
    return text + failed


@pytest.mark.parametrize("make", [sequence, parallel, joined])
def test_twice_as_many_nodes_take_twice_the_work(make: Callable[[int], str]) -> None:
    libraries = []
    for n in (100, 200):
        library = Library()
        library.add(read(make(n).encode(), "c.yaml"))
        assert check(library, INTERFACES) == []
        libraries.append(library)
    small, large = (calls(lambda one=one: check(one, INTERFACES)) for one in libraries)
    assert large < 2.2 * small
