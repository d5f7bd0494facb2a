"""What names in the values of charts stand for: values of a profile, places of scenes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cobodeck.project.named_files import kind_of
from cobodeck.project.state_catalogue import Catalogue, KnownPlaces, places_of
from engine.chart import Chart
from engine.files import is_file
from engine.files.declared import YAML
from engine.machine import NamedValues
from engine.signals import types_of

PLACE = "place"
"""The key of a place in a chart: `{place: kitchen}`."""


def known_names(
    library: Mapping[str, Chart], catalogue: Catalogue, *, for_run: bool = False
) -> NamedValues:
    """What charts may name before a scene is chosen: by the profile `tuned` and all known scenes.

    But for a run, what no chart of the library can mean is not looked up, and there are no places
    while a scene has mistakes, so that none seems to be missing which stands there.
    """
    by_scene = for_run or any(PLACE in chart.source.text for chart in library.values())
    places = known_places(library, catalogue) if by_scene else None
    if places is not None and not (for_run or places.complete):
        places = None
    by_profile = any("$profile." in chart.source.text for chart in library.values())
    return NamedValues(
        constants=catalogue.tuned.constants if by_profile else {},
        signals=types_of(catalogue.signals),
        named=None if places is None else {PLACE: places.by_name},
    )


def known_places(library: Mapping[str, Chart], catalogue: Catalogue) -> KnownPlaces:
    """The places of all scenes: the shipped ones, a project's, those beside the charts."""
    folders = {Path(chart.file).parent for chart in library.values() if is_file(Path(chart.file))}
    files = (file for folder in folders for ending in YAML for file in folder.glob(f"*{ending}"))
    own = places_of(sorted(str(file) for file in files if kind_of(file) == "scene"))
    shared = catalogue.places
    return KnownPlaces({**shared.by_name, **own.by_name}, shared.complete and own.complete)
