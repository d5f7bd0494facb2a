"""What docstrings of state classes say of outcomes, arguments and outputs."""

from __future__ import annotations

from engine.files.units import quantity, quantity_text
from engine.state_text import docstring_parts, text_of_class


class _Base:
    """Base.

    Args:
        near: how near.
        far: how far, told by the base.

    Outcomes:
        lost: nothing is there.
    """


class Knock(_Base):
    """Knock at a door.

    It has two lines
    of prose.

    Args:
        far: how far, told by
            itself: twice.

    Outcomes:
        $cases: one of them.

    After the sections.
    """


def test_sections_are_read_and_left_out_of_the_prose() -> None:
    told = text_of_class(Knock)

    assert told.about == "Knock at a door.\n\nIt has two lines\nof prose.\n\nAfter the sections."
    assert told.arguments == {"near": "how near.", "far": "how far, told by itself: twice."}
    assert told.outcomes == {"lost": "nothing is there.", "$cases": "one of them."}
    assert told.outputs == {}


def test_a_class_without_sections_has_its_docstring() -> None:
    assert docstring_parts("One line.\n\n    More:\n    of it.") == (
        "One line.\n\nMore:\nof it.",
        {},
    )


def test_quantities_are_told_as_people_write_them_and_read_again() -> None:
    assert quantity_text(0.5235987755982988, "angle") == "30 deg"
    assert quantity_text(0.002, "angle") == "0.002 rad"
    assert quantity_text(0.0, "angle") == "0 rad"
    assert quantity_text(3.0, "duration") == "3 s"
    assert quantity_text(0, "number") == "0"
    for value, dimension in ((0.5235987755982988, "angle"), (0.3, "length"), (2.5, "speed")):
        assert quantity(quantity_text(value, dimension)) == (value, dimension)
