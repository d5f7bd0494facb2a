"""The profile of a run, with the values of `--set`, and the charts with its values."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager

from behaviors.profile import Profile, load_profile
from cobodeck.fitness import require
from cobodeck.terminal import Problem
from engine.chart import Chart
from engine.files import FileError


def profile_with(name: str, sets: Sequence[str]) -> Profile:
    """A profile by name or file, with the values of `--set`.

    Raises:
        Problem: a value of `sets` is wrong; FileError: the profile is.
    """
    with blaming_sets():
        return load_profile(name, sets)


def with_values(
    profile: Profile, charts: Mapping[str, Chart], used: Collection[str]
) -> dict[str, Chart]:
    """The charts with a profile's values; all that those `used` pick has to be there.

    Raises:
        Problem: a value of `--set` is wrong; FileError: the profile or a chart is.
    """
    with blaming_sets():
        require("setup", profile=profile, library=charts)
        return profile.apply(charts, used)


@contextmanager
def blaming_sets() -> Iterator[None]:
    """Turn a FileError into a Problem if all its findings are in values of `--set`."""
    try:
        yield
    except FileError as error:
        if all(finding.place.file.startswith("--set ") for finding in error.findings):
            raise Problem(str(error)) from None
        raise
