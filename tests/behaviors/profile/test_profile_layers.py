"""A profile on a base, and single values on top: merged by key, every mistake at its own place."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import pytest

from behaviors.profile.profile import FOLDER, Profile, load_profile
from cobodeck.fitness.check_list import require
from engine.chart.load import load_files
from engine.files.declared.item import notes
from engine.files.declared.named import with_own_files
from engine.files.finding import FileError
from engine.files.text import instead, noting
from tests.behaviors.conftest import written

MINE = "profile: mine\nbase: tuned\nchase: {inner: 2.6 m}\n"


def refusal(file: Path | str, *sets: str) -> str:
    with pytest.raises(FileError) as failure:
        load_profile(file, sets)
    return str(failure.value)


def differing(a: Profile, b: Profile) -> dict[str, tuple[object, object]]:
    keys = {*a.values, *b.values}
    both = {key: (a.values.get(key), b.values.get(key)) for key in keys}
    return {key: pair for key, pair in both.items() if pair[0] != pair[1]}


def test_three_lines_are_a_profile(tmp_path: Path, tuned: Profile) -> None:
    mine = load_profile(written(tmp_path, MINE))

    assert mine.name == "mine"
    assert mine.about == "as tuned, but for chase.inner"
    assert mine.settings.chase.inner == 2.6
    assert mine.settings.chase.outer == tuned.settings.chase.outer
    assert mine.navigation == tuned.navigation
    assert mine.charts == tuned.charts
    assert differing(tuned, mine) == {
        "chase.inner": (tuned.values["chase.inner"], "2.6 m"),
    }


def test_lists_and_plain_values_are_replaced_as_a_whole(tmp_path: Path) -> None:
    file = written(tmp_path, "profile: mine\nbase: paper\nescape: {distances: [2 m]}\n")
    file.write_text(file.read_text() + "plant: {sensing: {slip: null}}\n")

    mine = load_profile(file)

    assert mine.settings.escape.distances == (2.0,)
    assert mine.plant.sensing.slip is None
    assert mine.plant.sensing.lidar == load_profile("paper").plant.sensing.lidar


def test_parameters_of_charts_are_merged_one_by_one(tmp_path: Path) -> None:
    below = "profile: below\nbase: tuned\ncharts: {chase: {far: 5 m, own: 4 s}}\n"
    written(tmp_path, below, "below.yaml")
    text = MINE.replace("base: tuned", "base: below.yaml")
    mine = load_profile(written(tmp_path, f"{text}charts: {{chase: {{own: 3 s}}}}\n"))

    assert mine.charts["chase"] == {"far": "5 m", "own": "3 s"}


def test_a_base_may_have_a_base_and_paths_start_at_the_file(tmp_path: Path) -> None:
    written(tmp_path, MINE.replace("base: tuned", "base: sub/below.yaml"))
    written(tmp_path / "sub", "profile: below\nbase: ../bottom.yaml\nabout: b\n", "below.yaml")
    written(tmp_path, "profile: bottom\nbase: paper\nchase: {outer: 4 m}\n", "bottom.yaml")

    mine = load_profile(tmp_path / "mine.yaml")

    chase = mine.settings.chase
    assert (chase.inner, chase.outer, chase.cell) == (2.6, 4.0, 0.05)
    assert mine.about == "as sub/below.yaml, but for chase.inner"
    assert mine.places["chase.inner"].file == str(tmp_path / "mine.yaml")
    assert Path(mine.places["chase.outer"].file).resolve() == tmp_path / "bottom.yaml"
    assert mine.places["chase.front"].file == str(FOLDER / "base.yaml")


def test_the_name_and_the_description_are_not_inherited(tmp_path: Path) -> None:
    text = refusal(written(tmp_path, "base: tuned\n"))

    assert text.endswith("mine.yaml:1:1: the key 'profile' is missing")


@pytest.mark.parametrize("length", [1, 2, 3])
def test_bases_that_lead_back_are_refused(tmp_path: Path, length: int) -> None:
    for n in range(length):
        written(tmp_path, f"profile: p{n}\nbase: p{(n + 1) % length}.yaml\n", f"p{n}.yaml")

    text = refusal(tmp_path / "p0.yaml")

    assert re.search(rf"p{length - 1}\.yaml:2:7: base: the bases lead back to this profile", text)


@pytest.mark.parametrize(
    ("line", "where", "message"),
    [
        ("base: tunde", "2:7", "no such profile; did you mean 'tuned'?"),
        ("base: gone.yaml", "2:7", "cannot be read"),
        ("base: 3", "2:7", "3 is not the name of a file"),
        ("base: null", "2:7", "nothing is not the name of a file"),
        ("base: tuned\nchase: {iner: 1 m}", "3:9", "unknown key; did you mean 'inner'?"),
        ("base: tuned\nchase: {inner: 1 kg}", "3:16", "wanted: a length"),
        ("base: tuned\nchase: {inner: 5 m}", "3:16", "5 is not below outer"),
        ("base: tuned\nchase: 5", "3:8", "needs a mapping"),
        ("base: tuned\nabuot: it", "3:1", "did you mean 'about'?"),
    ],
)
def test_a_mistake_is_told_at_its_place_in_ones_own_file(
    tmp_path: Path, line: str, where: str, message: str
) -> None:
    text = refusal(written(tmp_path, f"profile: mine\n{line}\n"))

    assert text.startswith(f"{tmp_path}/mine.yaml:{where}: ")
    assert message in text


def test_a_mistake_in_the_base_is_told_there(tmp_path: Path) -> None:
    written(tmp_path, MINE.replace("base: tuned", "base: below.yaml"))
    below = written(tmp_path, "profile: below\nbase: tuned\nchase: {outr: 1 m}\n", "below.yaml")

    assert refusal(tmp_path / "mine.yaml").startswith(f"{below}:3:9: chase.outr: unknown key")

    below.write_text("profile: [\n")

    text = refusal(tmp_path / "mine.yaml")
    assert text.startswith(f"{below}:")
    assert "named here" in text


# -- without a base --


@pytest.mark.parametrize(
    ("head", "policy", "chart"),
    [
        ("profile: mine", "tuned", "cobodeck"),
        ("profile: mine\npolicy: paper", "paper", "paper_cobodeck"),
        ("profile: paper", "paper", "paper_cobodeck"),  # of before, when none had a policy
        ("profile: paper\npolicy: tuned", "tuned", "cobodeck"),
    ],
)
def test_what_a_profile_without_a_base_lacks_is_as_in_the_shipped_one_of_its_policy(
    tmp_path: Path, head: str, policy: str, chart: str
) -> None:
    mine = load_profile(written(tmp_path, f"{head}\nchase: {{inner: 1.3 m}}\n"))

    assert (mine.policy, mine.chart) == (policy, chart)
    assert {key: its for key, (_, its) in differing(load_profile(policy), mine).items()} == {
        "chase.inner": "1.3 m"
    }
    assert mine.about == f"as {policy}, but for {'policy, ' * ('policy' in head)}chase.inner"


def test_a_recorded_text_of_a_shipped_profile_has_what_is_new_from_the_present_one() -> None:
    then = b"profile: tuned\nabout: of then\nchase: {inner: 1.3 m, stays: true}\n"

    with instead({FOLDER / "tuned.yaml": then}), noting() as read, notes() as told:
        found = load_profile("tuned")

    assert found.about == "of then"
    assert differing(load_profile("tuned"), found) == {
        "chase.inner": (load_profile("tuned").values["chase.inner"], "1.3 m")
    }
    assert read[FOLDER / "tuned.yaml"] == then
    assert [note.message.partition(":")[0] for note in told] == ["chase.stays"]


# -- single values -----------------------------------------------------------------------------


def test_a_value_is_set_on_top_of_the_file(tmp_path: Path) -> None:
    sets = ("chase.inner=2.7 m", "escape.distances = [1 m, 2 m]", "robot.tool_speed=null")

    found = load_profile(written(tmp_path, MINE), sets)

    assert found.settings.chase.inner == 2.7
    assert found.settings.escape.distances == (1.0, 2.0)
    assert found.robot.tool_speed is None
    assert found.name == "mine"
    assert found.sets == sets
    assert found.values["chase.inner"] == "2.7 m"


def test_of_two_values_for_one_key_the_later_counts() -> None:
    assert (
        load_profile("tuned", ("chase.inner=2 m", "chase.inner=2.5 m")).settings.chase.inner == 2.5
    )


def test_the_parameter_of_a_chart_is_set_and_has_to_exist() -> None:
    library = load_files(sorted(FOLDER.parent.glob("*.yaml")))

    found = load_profile("tuned", ("charts.chase.patience=7 s",))
    require("setup", profile=found, library=library)

    assert found.apply(library)["chase"].parameters["patience"].default == "7 s"
    for key, message in (
        ("charts.chase.patiense", "no such parameter; did you mean 'patience'?"),
        ("charts.chaes.patience", "no such chart; did you mean 'chase'?"),
    ):
        with pytest.raises(FileError, match=re.escape(message)):
            require("setup", profile=load_profile("tuned", (f"{key}=7 s",)), library=library)


def test_what_a_file_says_of_unknown_charts_is_not_asked_for(tmp_path: Path) -> None:
    mine = load_profile(written(tmp_path, MINE + "charts: {gone: {a: 1}}\n"), ("chase.inner=2 m",))

    require("setup", profile=mine, library={})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("chase.iner=2 m", "chase.iner: unknown key; did you mean 'inner'?"),
        ("chaes.inner=2 m", "chaes: unknown key; did you mean 'chase'?"),
        ("chase.inner=2 kg", "chase.inner: '2 kg' is a mass"),
        ("chase.inner=-2 m", "chase.inner: -2 is out of range"),
        ("chase.inner=9 m", "chase.inner: 9 is not below outer"),
        ("chase=2", "chase: needs a mapping"),
        ("chase.inner", "is not KEY=VALUE; write it as in chase.inner=2.6 m"),
        ("chase.inner=", "is not KEY=VALUE"),
        ("=2 m", "is not KEY=VALUE"),
        ("chase..inner=2 m", "is not KEY=VALUE"),
        ("chase.inner=a: b: c", "not YAML"),
        ("chase.inner=&a 2", "anchor &a"),
        ("profile=mine", "'profile' cannot be set; choose another file with --profile"),
        ("base=paper", "'base' cannot be set"),
    ],
)
def test_a_wrong_value_is_told_by_what_was_given(given: str, message: str) -> None:
    text = refusal("tuned", given)

    assert text.startswith(f"--set {given}: ")
    assert message in text
    assert "\n" not in text


def test_the_hash_covers_file_base_and_single_values(tmp_path: Path) -> None:
    file = written(tmp_path, MINE)
    text = b"\0".join((FOLDER / name).read_bytes() for name in ("base.yaml", "tuned.yaml"))
    assert load_profile("tuned").sha256 == hashlib.sha256(text).hexdigest()

    hashes = {load_profile("tuned").sha256, load_profile(file).sha256}
    hashes.add(load_profile(file, ("chase.inner=2.6 m",)).sha256)
    below = written(tmp_path, MINE.replace("mine", "below"), "below.yaml")
    file.write_text(MINE.replace("tuned", "below.yaml"))
    hashes.add(load_profile(file).sha256)
    below.write_text(below.read_text() + "# seen\n")
    hashes.add(load_profile(file).sha256)

    assert len(hashes) == 5


# -- by name -----------------------------------------------------------------------------------


def test_a_base_is_found_among_the_projects_own_first(tmp_path: Path) -> None:
    below = written(tmp_path, MINE.replace("mine", "below"), "below.yaml")
    file = written(tmp_path, "profile: mine\nbase: below\n")

    assert "no such profile" in refusal(file)
    with with_own_files(lambda kind: {"below": below} if kind == "profile" else {}):
        assert load_profile(file).settings.chase.inner == 2.6
