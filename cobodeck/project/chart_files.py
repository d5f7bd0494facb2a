"""Chart files by the names of their charts: of projects, beside other files, and shipped ones.

A project's chart replaces the shipped one of its name for whoever uses it. Within a project a name
stands for one chart.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from cobodeck.project.named_files import head_of
from cobodeck.project.old_names import OLD_CHARTS
from cobodeck.project.project import projects
from cobodeck.project.state_catalogue import CHARTS, Catalogue, shipped_charts
from cobodeck.terminal import Problem
from engine.files import did_you_mean
from engine.files.declared import YAML


def chart_names(catalogue: Catalogue) -> dict[str, Path]:
    """All charts by name: those of projects, which go first, and the shipped ones."""
    own = (file for project in catalogue.projects for file in project.yaml_files())
    return _by_name((*own, *shipped_charts()))


def names_of_charts(*, own: bool) -> set[str]:
    """The names of all charts, with `own` also those of projects; no code is imported."""
    found = projects(tell=lambda _: None) if own else ()
    files = (file for project in found for file in project.yaml_files())
    return {name for name, _ in _named((*files, *shipped_charts()))}


def chart_file(name_or_path: str, catalogue: Catalogue) -> Path:
    """The file of a chart given by name or by path.

    Raises:
        Problem: there is no such chart.
    """
    path = Path(name_or_path)
    if path.suffix in YAML or path.is_file():
        if path.is_file():
            return path
        raise Problem(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
    names = chart_names(catalogue)
    if name_or_path in names:
        return names[name_or_path]
    hint = OLD_CHARTS.get(name_or_path) or did_you_mean(name_or_path, names)
    raise Problem(f"no chart {name_or_path!r}; {hint}")


def behaviour_of(chart: str) -> str:
    """The behaviour of which a chart is a variant, by the last word of its name.

    `escape`, `paper_escape` and `careful_escape` are Escapes.
    """
    return chart.rpartition("_")[2]


def nodes_of(behaviour: str, uses: Mapping[str, str]) -> frozenset[str]:
    """The nodes that use a variant of a behaviour, but for those inside another one.

    `uses` are the used charts by the paths of the nodes that use them.
    """
    paths = {path for path, chart in uses.items() if behaviour_of(chart) == behaviour}
    return frozenset(p for p in paths if not any(p.startswith(f"{above}/") for above in paths))


def charts_beside(files: Sequence[Path]) -> dict[str, Path]:
    """Charts in the same folders as the given files, by name; the shipped folder is left out."""
    folders = dict.fromkeys(file.parent for file in files)
    inside = [
        file
        for folder in folders
        if folder.resolve() != CHARTS.resolve()
        for file in sorted({file for ending in YAML for file in folder.glob(f"*{ending}")})
        if file not in files
    ]
    return _by_name(inside)


def twins(catalogue: Catalogue) -> dict[Path, Path]:
    """The chart files that share their chart's name with another one of their project."""
    found = {}
    for project in catalogue.projects:
        named = list(_named(project.yaml_files()))
        for name, file in named:
            others = (other for also, other in named if also == name and other != file)
            if (twin := next(others, None)) is not None:
                found[file.resolve()] = twin
    return found


def own_replacements(catalogue: Catalogue) -> dict[str, Path]:
    """The charts of projects that replace shipped ones, by name."""
    shipped = shipped_by_name()
    return {
        name: file
        for name, file in chart_names(catalogue).items()
        if is_replacement(name, file, shipped)
    }


def shipped_by_name() -> dict[str, Path]:
    """The shipped charts by name."""
    return _by_name(shipped_charts())


def is_replacement(name: str, file: str | Path, shipped: Mapping[str, Path]) -> bool:
    """Whether the chart of this name and file is in the place of one of the `shipped`."""
    other = shipped.get(name)
    return other is not None and other.resolve() != Path(file).resolve()


def _by_name(files: Iterable[Path]) -> dict[str, Path]:
    """The first chart file for each name."""
    found: dict[str, Path] = {}
    for name, file in _named(files):
        found.setdefault(name, file)
    return found


def _named(files: Iterable[Path]) -> Iterator[tuple[str, Path]]:
    """The chart files among these, with the names of their charts."""
    for file in files:
        head = head_of(file)
        if head is not None and head[0] == "chart":
            yield head[1], file
