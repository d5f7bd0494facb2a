"""What the shipped profiles share stands once, in their base; it is no profile to run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from behaviors.profile.profile import load_profile, profile_names, resting_on_base
from behaviors.profile.profile_layers import BASE, FOLDER
from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK, USAGE
from engine.files.declared.named import with_own_files
from engine.files.finding import FileError
from engine.files.source import plain, read_file
from tests.behaviors.conftest import written

TUNED = FOLDER / "tuned.yaml"


def leaves(value: object, key: str = "") -> dict[str, object]:
    if not isinstance(value, dict):
        return {key: value}
    inner = (leaves(part, f"{key}.{name}".lstrip(".")) for name, part in value.items())
    return {name: part for found in inner for name, part in found.items()}


def keys(file: Path) -> dict[str, object]:
    found = leaves(plain(read_file(file).value))
    return {key: value for key, value in found.items() if key not in ("profile", "about", "base")}


def test_each_key_of_a_shipped_profile_differs_from_base_and_from_the_other() -> None:
    shared, profiles = keys(BASE), [keys(FOLDER / f"{name}.yaml") for name in resting_on_base()]

    for one, other in (*((own, shared) for own in profiles), profiles):
        assert not {key for key in one.keys() & other.keys() if one[key] == other[key]}


HELD = re.findall(
    r"^#   (\w+\.[\w.]+) +(\S+) to (\S+)( \S+)?  +(\S.*)$", TUNED.read_text(), re.MULTILINE
)


def test_twelve_values_stand_in_front_with_what_more_of_them_costs() -> None:
    head = TUNED.read_text().partition("\nprofile:")[0]
    assert len(HELD) == 12 == len(re.findall(r"^#   \w+\.", head, re.MULTILINE))


@pytest.mark.parametrize(("key", "least", "most", "unit", "cost"), HELD)
def test_each_of_the_twelve_has_its_value_inside_the_range_that_is_told(
    key: str, least: str, most: str, unit: str, cost: str
) -> None:
    now = load_profile("tuned").values[key]
    number = float(str(now).removesuffix(unit)) if unit else float(now)

    assert float(least) <= number <= float(most)
    assert cost
    load_profile("tuned", [f"{key}={most}{unit}"])


def test_base_is_no_profile_to_run(tmp_path: Path) -> None:
    assert "base" not in profile_names()
    for name in ("base", BASE):
        with pytest.raises(FileError, match="no profile to run; choose one of paper, tuned"):
            load_profile(name)
    assert main(["simulate", "--profile", "base"]) == USAGE
    own = written(tmp_path, "profile: mine\nbase: base\n")
    with pytest.raises(FileError, match=r"mine.yaml:2:7: base: is what they share, and no profile"):
        load_profile(own)


def test_base_is_checked_with_the_profiles_that_rest_on_it() -> None:
    assert main(["validate", str(BASE)]) == OK


def test_a_profile_of_ones_own_may_be_called_base(tmp_path: Path) -> None:
    own = written(tmp_path, "profile: base\nbase: tuned\nchase: {inner: 2.6 m}\n", "base.yaml")

    with with_own_files(lambda kind: {"base": own} if kind == "profile" else {}):
        assert load_profile("base").settings.chase.inner == 2.6
        assert load_profile("tuned").settings.chase.inner == 1.5
        assert "base" in profile_names()


def test_a_profile_names_a_chart_that_there_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = written(tmp_path, "profile: mine\nbase: tuned\nchart: cobodek\n")

    assert main(["validate", str(own)]) == FAILED
    told = capsys.readouterr().out
    assert "3:8: error[D01] chart: no such chart" in told
    assert "did you mean 'cobodeck'" in told
