"""A page in a real browser; where there is none, tests are skipped and say why."""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
from pathlib import Path
from typing import Any, Self

import pytest

PLACE = Path(
    os.environ.get("BROWSER_TRIAL", Path(__file__).parents[3] / "out" / "browser")
).absolute()
PATIENCE_S = 90.0


def chromium() -> str | None:
    found = (shutil.which(name) for name in ("chromium", "chromium-browser", "google-chrome"))
    return next((path for path in found if path), None)


def why_not() -> str:
    """What is missing for a browser; empty: nothing."""
    if shutil.which("node") is None:
        return "no `node` on the PATH"
    if not (PLACE / "node_modules" / "playwright-core").is_dir():
        return f"no playwright-core in {PLACE}; tests/cobodeck/live/README.md says how to get it"
    if chromium() is None:
        return "no Chromium; on Debian: apt-get install chromium"
    return ""


class Browser:
    """One page at a time; `open` begins anew, with no memory of the one before."""

    def __enter__(self) -> Self:
        if reason := why_not():
            pytest.skip(reason)
        self._node = subprocess.Popen(
            ["node", str(Path(__file__).with_name("browser.mjs")), str(PLACE), str(chromium())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        self._answer()
        return self

    def __exit__(self, *_: object) -> None:
        assert self._node.stdin
        self._node.stdin.close()
        try:
            self._node.wait(20)
        except subprocess.TimeoutExpired:
            self._node.kill()
            self._node.wait()
        assert self._node.stdout
        self._node.stdout.close()

    def _answer(self) -> Any:
        assert self._node.stdout
        ready, _, _ = select.select([self._node.stdout], [], [], PATIENCE_S)
        line = self._node.stdout.readline() if ready else ""
        assert line, "the browser does not answer"
        answer = json.loads(line)
        assert answer["ok"], answer["value"]
        return answer["value"]

    def _do(self, what: str, **how: Any) -> Any:
        assert self._node.stdin
        self._node.stdin.write(json.dumps({"do": what, **how}) + "\n")
        return self._answer()

    def open(self, url: str, width: int = 1440, height: int = 900, scheme: str = "light") -> None:
        self._do("open", url=url, width=width, height=height, scheme=scheme)

    def see(self, js: str) -> Any:
        """The value of an expression in the page."""
        return self._do("see", js=js)

    def until(self, js: str) -> None:
        """Waits for an expression to be true."""
        self._do("until", js=js)

    def text(self, on: str) -> str:
        return str(self.see(f"document.querySelector({json.dumps(on)}).textContent"))

    def until_text(self, on: str, part: str) -> None:
        self.until(
            f"document.querySelector({json.dumps(on)})?.textContent.includes({json.dumps(part)})"
        )

    def click(self, on: str) -> None:
        self._do("click", on=on)

    def fill(self, on: str, text: str) -> None:
        self._do("fill", on=on, text=text)

    def focus(self, on: str) -> None:
        self._do("focus", on=on)

    def press(self, *keys: str) -> None:
        for key in keys:
            self._do("press", key=key)

    def let_in(self, name: str, token: str) -> None:
        """Give the page a name and the token."""
        self.fill("#name", name)
        self.fill("#token", token)
        self.click("#auth button")

    def find(self, path: str) -> None:
        """Show the details of a node."""
        self.fill("#find", path)
        self.press("Enter")
        self.until_text("#details-head", path)

    def opens_from(self, page: str, url: str) -> bool:
        """Whether another page gets a WebSocket."""
        return bool(self._do("foreign", page=page, url=url))

    def drag(self, on: str, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Of an element, from and to shares of its width and height."""
        self._do("drag", on=on, **{"from": start, "to": end})

    def resize(self, width: int, height: int) -> None:
        self._do("resize", width=width, height=height)

    def scheme(self, scheme: str) -> None:
        self._do("scheme", scheme=scheme)

    def shot(self, file: Path) -> None:
        file.parent.mkdir(exist_ok=True)
        self._do("shot", file=str(file))

    @property
    def errors(self) -> list[str]:
        """Errors and warnings in the console of the page."""
        return list(self._do("heard")["errors"])

    @property
    def urls(self) -> list[str]:
        """What the page asked for."""
        return list(self._do("heard")["urls"])
