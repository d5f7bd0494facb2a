"""Write down and draw what campaigns that vary one thing each came to.

    cobodeck campaign precision_tick --out DIR/precision_tick --json > DIR/precision_tick.json
    …
    python -m cobodeck.bench.system DIR

Reads `DIR/X.json` of each campaign X in `knobs`; writes `precision` and `disturbed` with their
pictures to `cobodeck/campaign/results`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any

from cobodeck.bench.system.comparison import compared
from cobodeck.bench.system.drawn import COST, FIGURES, NOTES
from cobodeck.bench.system.knobs import DISTURBED, PRECISION, SystemKnob
from cobodeck.bench.system.page import RESULTS
from cobodeck.pictures import draw_knobs
from cobodeck.record.format import machine, versions


def main() -> None:
    """Read, compare, write, draw."""
    parser = argparse.ArgumentParser(prog="python -m cobodeck.bench.system")
    parser.add_argument("folder", type=Path, metavar="DIR", help="what the campaigns have printed")
    folder = parser.parse_args().folder
    for name, knobs in (("precision", PRECISION), ("disturbed", DISTURBED)):
        result = _result(folder, knobs)
        (RESULTS / f"{name}.json").write_text(f"{json.dumps(result, indent=1)}\n", encoding="utf-8")
        picture = RESULTS / f"{name}.svg"
        draw_knobs(result["knobs"], FIGURES[name], NOTES[name], picture, {COST})


def _result(folder: Path, knobs: Sequence[SystemKnob]) -> dict[str, Any]:
    rows = []
    for knob in knobs:
        printed = json.loads((folder / f"{knob.campaign}.json").read_text(encoding="utf-8"))
        rows.append(compared(knob, printed["cells"]))
    made = {"date": date.today().isoformat(), "machine": machine(), "versions": versions()}
    return {**made, "knobs": rows}


if __name__ == "__main__":
    main()
