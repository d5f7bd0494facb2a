"""`python -m tests.planted [NAME…]`: plant faults, and print which test notices each.

Without names all of the table, some minutes of CPU. Exit code 1 if one is not noticed.
"""

# ruff: noqa: T201  this is a command

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.planted.faults import FAULTS
from tests.planted.planting import Copy


def main(names: Sequence[str]) -> int:
    unknown = sorted(set(names) - {fault.name for fault in FAULTS})
    if unknown:
        print(f"no fault {', '.join(unknown)}; the names stand in tests/planted", file=sys.stderr)
        return 2
    chosen = [fault for fault in FAULTS if not names or fault.name in names]
    missed = cpu_s = 0.0
    with TemporaryDirectory() as folder:
        copy = Copy(Path(folder))
        copy.check(chosen)
        for fault in chosen:
            found = copy.tried(fault)
            missed += not found.noticed
            cpu_s += found.cpu_s
            by = found.by or "NOT NOTICED"
            print(f"{fault.name:44} {found.cpu_s:5.1f} s  {by}", flush=True)
    print(f"{len(chosen)} faults, {missed:.0f} not noticed, {cpu_s:.0f} s of CPU")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
