"""A repeat gives the object before; one that comes first, as in an excerpt, is read in full."""

from __future__ import annotations

import pytest

from cobodeck.record.format.sample_messages import SampleReader, SampleWriter
from hw import Pose2, Scan

VALUES = [Pose2(1.0, 2.0, 3.0), Scan("front", -1.0, 1.0, (1.0, 2.0, 3.0), 0.0), 7.5]


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_a_repeat_that_comes_first_is_read_like_any_other(value: object) -> None:
    writer = SampleWriter("signal")
    messages = [writer.write(stamp, value) for stamp in (1, 2, 3)]

    whole, part = SampleReader("signal"), SampleReader("signal")
    every = [whole.read(*message) for message in messages]
    later = [part.read(*message) for message in messages[1:]]

    assert [sample.stamp_ns for sample in every] == [1, 2, 3]
    assert [sample.value for sample in later] == [value, value]
    assert later[1].value is later[0].value
    assert every[2].value is every[0].value
