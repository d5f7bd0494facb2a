"""Another interpreter, in a folder of the test's own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def python(folder: Path, *arguments: str, before: str = "") -> subprocess.CompletedProcess[str]:
    """Run it; modules are looked for in `before`, then in the checkout."""
    path = f"{before}{os.pathsep}{ROOT}" if before else str(ROOT)
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
