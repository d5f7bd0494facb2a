"""What names in the values of charts stand for: values of a profile, places of scenes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cobodeck.project.named_files import kind_of
from cobodeck.project.state_catalogue import Catalogue
from engine.chart import Library
from engine.files import FileError
from engine.files.declared import YAML
from engine.machine import NamedValues
from engine.signals import types_of
from hw import Pose2

PLACE = "place"
"""The key of a place in a chart: `{place: kitchen}`."""


def constants_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a profile as charts name them: `escape.ahead` as `profile.escape.ahead`."""
    return {f"profile.{key}": value for key, value in values.items()}


def known_names(library: Library, catalogue: Catalogue) -> NamedValues:
    """What charts may name before a run is chosen: by the profile `tuned` and all known scenes.

    What no chart of the library can mean is not looked up.
    """
    from behaviors.profile import load_profile

    texts = [chart.source.text for chart in library.values()]
    by_profile = any("$profile." in text for text in texts)
    by_scene = any(PLACE in text for text in texts)
    return NamedValues(
        constants=constants_of(load_profile("tuned").values) if by_profile else {},
        signals=types_of(catalogue.signals),
        named={PLACE: _known_places(library)} if by_scene else None,
    )


def _known_places(library: Library) -> dict[str, Pose2]:
    """The places of all scenes by name: the shipped ones, a project's, those beside the charts.

    Scenes with mistakes, which others report, have none.
    """
    from hw.scene import load_scene, scene_names

    folders = {Path(chart.file).parent for chart in library.values()}
    files = (file for folder in folders for ending in YAML for file in folder.glob(f"*{ending}"))
    beside = sorted(str(file) for file in files if kind_of(file) == "scene")
    found: dict[str, Pose2] = {}
    for name in (*scene_names(), *beside):
        try:
            found |= load_scene(name).places
        except FileError:
            continue
    return found
