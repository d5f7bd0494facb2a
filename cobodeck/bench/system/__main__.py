"""Write down and draw what campaigns that vary one thing each came to.

    cobodeck campaign precision_tick --out DIR/precision_tick --json > DIR/precision_tick.json
    …
    python -m cobodeck.bench.system DIR [precision] [disturbed] [keys]

Reads `DIR/X.json` of each campaign X in `knobs`; writes `precision`, `disturbed` and `keys`, or
those that are named, with their pictures to `cobodeck/campaign/results`.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from cobodeck.bench.system.comparison import compared
from cobodeck.bench.system.drawn import COST, FIGURES, NOTES
from cobodeck.bench.system.knobs import DISTURBED, KEYS, PRECISION, SystemKnob
from cobodeck.bench.system.page import RESULTS
from cobodeck.pictures import draw_knobs
from cobodeck.record.format import machine, versions

ALL = {"precision": PRECISION, "disturbed": DISTURBED, "keys": KEYS}
MOST = 8
"""Knobs of a picture at most."""


def main() -> None:
    """Read, compare, write, draw."""
    parser = argparse.ArgumentParser(prog="python -m cobodeck.bench.system")
    parser.add_argument("folder", type=Path, metavar="DIR", help="what the campaigns have printed")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(ALL)}")
    given = parser.parse_args()
    for name in given.names or ALL:
        result = _result(given.folder, ALL[name])
        (RESULTS / f"{name}.json").write_text(f"{json.dumps(result, indent=1)}\n", encoding="utf-8")
        _draw(name, result["knobs"])


def _draw(name: str, knobs: Sequence[Mapping[str, Any]]) -> None:
    """Draw a picture, or several of about as many knobs, X_1.svg, X_2.svg."""
    pictures = math.ceil(len(knobs) / MOST)
    size = math.ceil(len(knobs) / pictures)
    for number in range(pictures):
        part = knobs[number * size : (number + 1) * size]
        file = f"{name}_{number + 1}.svg" if pictures > 1 else f"{name}.svg"
        draw_knobs(part, FIGURES[name], NOTES[name], RESULTS / file, {COST})


def _result(folder: Path, knobs: Sequence[SystemKnob]) -> dict[str, Any]:
    rows = []
    for knob in knobs:
        printed = json.loads((folder / f"{knob.campaign}.json").read_text(encoding="utf-8"))
        rows.append(compared(knob, printed["cells"]))
    made = {"date": date.today().isoformat(), "machine": machine(), "versions": versions()}
    return {**made, "knobs": rows}


if __name__ == "__main__":
    main()
