"""Results are kept once and for all; what is damaged is told, and nothing else is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult
from cobodeck.campaign.result_store import NAME, ResultStore
from cobodeck.terminal.console import Problem


def results(count: int) -> list[CellResult]:
    return [
        CellResult(
            CampaignCell(repetition=n), f"address {n}", {"served": n, "gap": 0.1 * n, "who": "Zoë"},
            cpu_s=0.5 + n,
        )
        for n in range(count)
    ]  # fmt: skip


def kept(folder: Path, count: int) -> list[CellResult]:
    store = ResultStore(folder)
    some = results(count)
    for result in some:
        store.keep(result)
    store.close()
    return some


def there(folder: Path, wanted: list[CellResult]) -> list[CellResult]:
    """What of this a store gives back."""
    store = ResultStore(folder)
    found = [store.result(r.cell, r.address) for r in wanted if r.address in store]
    store.close()
    return found


def test_what_was_kept_is_there(tmp_path: Path) -> None:
    some = kept(tmp_path / "new" / "folder", 5)

    assert there(tmp_path / "new" / "folder", some) == some
    assert there(tmp_path / "other", some) == []


def test_a_result_is_there_as_soon_as_it_is_kept(tmp_path: Path) -> None:
    store = ResultStore(tmp_path)
    first, second = results(2)
    store.keep(first)
    before = (tmp_path / NAME).read_bytes()
    assert first.address in store
    assert store.result(first.cell, first.address) == first

    store.keep(second)

    assert (tmp_path / NAME).read_bytes().startswith(before)
    assert len(store) == 2
    assert store.result(first.cell, first.address) == first
    store.close()


def test_one_program_writes_at_a_time(tmp_path: Path) -> None:
    store = ResultStore(tmp_path)
    with pytest.raises(Problem, match="another campaign is writing here"):
        ResultStore(tmp_path)
    store.close()
    ResultStore(tmp_path).close()


def test_a_file_in_place_of_the_folder_is_told(tmp_path: Path) -> None:
    file = tmp_path / "out"
    file.touch()

    for place in (file, file / "below"):
        with pytest.raises(Problem, match="results need a folder"):
            ResultStore(place)


@given(data=st.data())
def test_a_file_cut_anywhere_loses_the_last_line_alone(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("cut")
    some = kept(folder, 3)
    file = folder / NAME
    content = file.read_bytes()
    ends = [n + 1 for n, byte in enumerate(content) if byte == ord("\n")]
    cut = data.draw(st.integers(0, len(content)))
    file.write_bytes(content[:cut])
    whole = sum(end - 1 <= cut for end in ends)  # without its newline a line is whole

    assert there(folder, some) == some[:whole]

    store = ResultStore(folder)
    for result in some[whole:]:
        store.keep(result)
    store.close()
    assert there(folder, some) == some


@given(data=st.data())
def test_a_damaged_byte_costs_at_most_the_lines_it_touches(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    some = kept(folder, 3)
    file = folder / NAME
    content = bytearray(file.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    old, content[at] = content[at], data.draw(st.integers(0, 255))
    lines = {bytes(content[:at]).count(b"\n")}
    lines |= {n + 1 for n in lines if old == ord("\n")}
    file.write_bytes(content)

    found = there(folder, some)

    assert [r for n, r in enumerate(some) if n not in lines] == [
        r for r in found if some.index(r) not in lines
    ]
    if old != content[at]:
        assert len(found) < 3
    assert all(r in some for r in found)


def test_damage_is_told_with_its_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    some = kept(tmp_path, 3)
    file = tmp_path / NAME
    file.write_text(file.read_text().replace('"served":1', '"served":7'))

    assert there(tmp_path, some) == [some[0], some[2]]
    assert f"{file}:2: damaged; this cell is run again" in capsys.readouterr().err
