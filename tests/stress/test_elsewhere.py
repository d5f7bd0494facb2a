"""Wherever the world is, however it is turned, whenever: the same answers but for rounding."""

from __future__ import annotations

import pytest

from tests.stress.elsewhere import Elsewhere
from tests.stress.places import everywhere
from tests.stress.subjects import SUBJECTS, Subject


@pytest.mark.parametrize(
    "subject",
    [
        pytest.param(one, id=one.name, marks=[pytest.mark.slow] if one.heavy else [])
        for one in SUBJECTS
    ],
)
def test_elsewhere_turned_wound_up_and_years_later_all_is_as_at_home(subject: Subject) -> None:
    subject.check(everywhere(subject))


@pytest.mark.slow
@pytest.mark.theme("moved")
def test_where_the_origin_is_does_not_matter(subject: Subject, at: Elsewhere) -> None:
    subject.check(at)


@pytest.mark.slow
@pytest.mark.theme("turned")
def test_how_the_axes_lie_does_not_matter(subject: Subject, at: Elsewhere) -> None:
    subject.check(at)


@pytest.mark.slow
@pytest.mark.theme("wound")
def test_whole_turns_of_a_yaw_do_not_matter(subject: Subject, at: Elsewhere) -> None:
    subject.check(at)


@pytest.mark.slow
@pytest.mark.theme("later")
def test_when_it_happens_changes_no_bit(subject: Subject, at: Elsewhere) -> None:
    subject.check(at)


@pytest.mark.slow
@pytest.mark.theme("rounded")
def test_seven_digits_of_input_give_about_as_many(subject: Subject, at: Elsewhere) -> None:
    subject.check(at)
