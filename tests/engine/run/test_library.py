"""The page for those who use the engine as a library, run with nothing installed but PyYAML."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[3]


def test_the_library_page_runs_with_nothing_but_pyyaml(tmp_path: Path) -> None:
    (page,) = re.findall(
        r"```python\n# library\n(.*?)```", (ROOT / "engine/README.md").read_text(), re.S
    )
    (tmp_path / "engine").symlink_to(ROOT / "engine")
    packages = Path(yaml.__file__).parents[1]
    for name in ("yaml", "_yaml"):
        (tmp_path / name).symlink_to(packages / name)
    (tmp_path / "page.py").write_text(page)
    # -I and -S: no site-packages, no environment; what can be imported is in this folder
    start = f"import runpy, sys; sys.path.insert(0, {str(tmp_path)!r}); runpy.run_path('page.py')"
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", start], cwd=tmp_path, capture_output=True, text=True
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("full\n")
    assert '"pump","preempted"' in done.stdout
