"""Records on pages: every instant is that of the run, wherever one came from."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as some

from cobodeck.live.model import RunModel
from cobodeck.live.sources.recorded import RecordSource
from cobodeck.live.sources.seen_record import SeenRecord
from cobodeck.record.format import trace_line
from cobodeck.record.read import Record
from cobodeck.record.write.start import recorder
from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from tests.cobodeck.live.folding import AT, study
from tests.cobodeck.live.pages import Client, client, run, serving
from tests.repeats import examples

OPTIONS = Options(duration_s=8.0)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("seen") / "run.mcap"
    setup = study()
    simulate(setup, OPTIONS, recorder=recorder(setup, OPTIONS, found, AT, pytest.fail))
    return found


@pytest.fixture(scope="module")
def seen(path: Path) -> SeenRecord:
    return SeenRecord(path)


@settings(max_examples=examples(24, least=3), deadline=None)
@given(times=some.lists(some.integers(0, 9 * 10**9), min_size=1, max_size=4))
@pytest.mark.slow
@pytest.mark.requirement(19, 145)
def test_any_instant_is_what_all_before_it_leads_to(seen: SeenRecord, times: list[int]) -> None:
    for at_ns in times:
        seen.seek(at_ns)
    folded = RunModel()
    for group in seen.record.groups():
        if group.ticked.at_ns <= times[-1]:
            folded.add(group)

    assert seen.model.state() == folded.state()
    assert seen.model.newest == folded.newest


@pytest.mark.slow
def test_past_paths_go_on_with_the_run_and_begin_anew_where_another_instant_is_sought(
    seen: SeenRecord,
) -> None:
    place = seen.seen.place
    seen.seek(10**9)
    place.moment(seen.model)
    for at_s in (2, 3, 4):
        seen.go_on(at_s * 10**9)
        trail = place.moment(seen.model).robot_trail
    assert len(trail) > 1

    seen.seek(6 * 10**9)

    assert len(place.moment(seen.model).robot_trail) == 1


def moved(path: Path) -> list[float]:
    """The ticks with transitions, s."""
    groups = Record(path).groups()
    kinds = ((g.ticked.at_ns, [trace_line(m)[1] for m in g.messages("trace")]) for g in groups)
    return [at_ns / 1e9 for at_ns, told in kinds if "move" in told]


@pytest.mark.slow
@pytest.mark.requirement(21, 134, 145)
def test_a_page_plays_seeks_plots_and_asks_for_a_range(path: Path) -> None:
    async def main() -> None:
        source = await asyncio.to_thread(RecordSource, [path, path])
        async with serving(source) as server, client(server) as socket:
            page = Client(socket)
            hello = await page.hear("hello")
            assert (hello["mode"], hello["commands"]) == ("record", False)
            assert hello["until"] == pytest.approx(8.0)
            assert [one["title"] for one in hello["runs"]] == 2 * [path.name]
            assert hello["moves"] == moved(path)
            assert (await page.hear("chart", slot=1))["nodes"]["chase"]["kind"]
            await page.tell(t="seek", at=5.0)
            state = await page.hear("state", at=5.0)
            assert "chase" in state["active"]
            assert (await page.hear("state", at=5.0))["slot"] == 1
            await page.tell(t="play", speed=100)
            while (await page.hear("ev"))["at"] < 7.9:
                pass
            await page.tell(t="plot", signal="base.pose", on=True)
            plot = await page.hear("plot")
            assert plot["fields"] == ["x", "y", "yaw"]
            assert len(plot["at"]) == len(plot["values"][0]) > 100
            await page.tell(t="range", **{"from": 2.0, "to": 6.0})
            figures = await page.hear("figures", range=[2.0, 6.0])
            assert dict(figures["rows"])["time"] == "4.0 s"
            await page.tell(t="range", **{"from": 6.0, "to": 2.0})
            assert "nothing from" in (await page.hear("say"))["text"]
            await page.tell(t="seek", at="soon")
            await page.hear("say")
            assert not (await page.command("stop"))["ok"]

    run(main())
