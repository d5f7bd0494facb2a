"""The report of an evaluation: one HTML page, the requests as CSV, the figures, and JSON."""

from __future__ import annotations

import base64
import csv
import json
from collections.abc import Callable, Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from cobodeck.campaign import run_cell
from cobodeck.paper.conditions import CONDITIONS, EvaluationPlan
from cobodeck.paper.tables import JUDGED, ResultTable, tables
from cobodeck.terminal import PART

Result = Mapping[str, Any]
Progress = Callable[[str, float | None], None]
PAGE, REQUESTS, RESULT = "report.html", "requests.csv", "result.json"
STYLE = """
:root { color-scheme: light dark; --ink: #1c2733; --paper: #fff; --line: #c9d0d8; --no: #b00020; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e8ed; --paper: #14191f; --line: #3c4653; --no: #ff8a80; }
}
body { color: var(--ink); background: var(--paper); font: 15px/1.45 sans-serif;
       max-width: 76rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .85rem; }
th, td { border-bottom: 1px solid var(--line); padding: .3rem .6rem; text-align: left;
         vertical-align: top; }
td { font-variant-numeric: tabular-nums; } td.NO { color: var(--no); font-weight: bold; }
figure { display: inline-block; margin: .5rem .5rem .5rem 0; background: #fff; padding: .4rem; }
figure img { display: block; max-width: 100%; height: auto; }
p.note { font-size: .85rem; }
@media print {
  body { max-width: none; margin: 0; font-size: 10px; }
  tr, figure { break-inside: avoid; } .wide { overflow: visible; }
}
"""


def record_conditions(plan: EvaluationPlan, folder: Path, progress: Progress) -> dict[str, Path]:
    """Run each condition once more, the same bits, and keep a record of it in a folder."""
    records = {name: folder / f"{name}.mcap" for name in CONDITIONS}
    for number, (name, file) in enumerate(records.items()):
        progress(f"record of {name}", number / len(records))
        for earlier in (file, file.with_name(f"{file.name}{PART}")):  # also one broken off
            earlier.unlink(missing_ok=True)
        run_cell(plan.cell(name), file)
    return records


def draw_figures(
    result: Result, records: Mapping[str, Path], folder: Path, progress: Progress
) -> list[Path]:
    """Figures 8, 9 and 10 as PNG files in a folder."""
    from cobodeck.paper.drawings import draw_responses, draw_to_safety, draw_trajectories

    conditions, files = result["conditions"], []
    for number, (name, record) in enumerate(records.items()):
        progress(f"figure 8, {name}", number / len(records))
        files.append(folder / f"figure_8_{name}.png")
        draw_trajectories(name, record, conditions[name], files[-1])
    files += [folder / "figure_9.png", folder / "figure_10.png"]
    draw_responses(conditions, files[-2])
    draw_to_safety(conditions, files[-1])
    return files


def write_report(result: Result, pictures: Iterable[Path], folder: Path) -> list[Path]:
    """Write page, CSV and JSON into an existing folder; pictures (PNG) become part of the page."""
    files = {
        PAGE: page(result, pictures),
        RESULT: json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
    }
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    with (folder / REQUESTS).open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(request_rows(result))
    return [folder / name for name in (PAGE, REQUESTS, RESULT)]


def request_rows(result: Result) -> list[list[Any]]:
    """The head and a row per request of the three conditions; m, s, rad; empty: did not occur."""
    head = ["condition", "number", "asked_s", "served", "response_s", "arm_s", "travelled_m"]
    rows: list[list[Any]] = [[*head, *(f"deep_{k}" for k in "xyz"), "user_x", "user_y", "user_yaw"]]
    for name in CONDITIONS:
        for number, asked in enumerate(result["conditions"][name]["request_list"], 1):
            figures = [asked[key] for key in head[2:]]
            user = asked["user"] or [None] * 3
            rows.append([name, number, *figures, *asked["deep"], *user])
    return rows


def page(result: Result, pictures: Iterable[Path]) -> str:
    """The report as one HTML page without scripts or links to other files."""
    plan = result["plan"]
    held = sum(claim["holds"] is True for claim in result["claims"])
    about = (
        f"Profile {plan['profile']}, tier {plan['tier']}, {plan['requests']} requests per "
        f"condition, {plan['seeds']} random routes. {held} of {len(result['claims'])} claims "
        "hold; one that does not is an answer, with its measured cause."
    )
    if "machine" in result:
        machine = result["machine"]
        about += f" {result['date']}, {machine['name']}, {machine['system']}."
    first, *rest = tables(result)
    shown = "".join(map(_picture, pictures))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>CoboDeck: section 5</title><style>{STYLE}</style></head><body>"
        f"<h1>The paper's evaluation, section 5</h1><p>{escape(about)}</p>"
        f"{_table(first)}{shown}{''.join(map(_table, rest))}</body></html>\n"
    )


def _picture(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    title = escape(path.stem.replace("_", " "))
    return f'<figure><img alt="{title}" src="data:image/png;base64,{data}"></figure>'


def _table(table: ResultTable) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in table.head)
    rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return (
        f'<h2>{escape(table.title)}</h2><div class="wide"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>{note}"
    )


def _cell(text: str) -> str:
    marked = ' class="NO"' if text == JUDGED[False] else ""
    return f"<td{marked}>{escape(text)}</td>"
