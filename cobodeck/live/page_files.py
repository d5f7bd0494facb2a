"""Answers to plain requests: the files of the page by their names, and refusals."""

from __future__ import annotations

import mimetypes
from http import HTTPStatus
from pathlib import Path

from websockets.datastructures import Headers
from websockets.http11 import Response

PAGE = Path(__file__).parent / "page"
"""Its files are served: `index.html` as `/`, the others as `/page/NAME`."""
SECURE = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


def page_file(path: str) -> Response:
    """A file of the page; names are compared, so no path leads elsewhere."""
    name = "index.html" if path == "/" else path.removeprefix("/page/")
    file = {found.name: found for found in PAGE.iterdir() if found.is_file()}.get(name)
    if file is None or (path != "/" and not path.startswith("/page/")):
        return refusal(HTTPStatus.NOT_FOUND, "there is no such page")
    kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
    return _response(HTTPStatus.OK, file.read_bytes(), kind)


def refusal(status: HTTPStatus, text: str) -> Response:
    """Why there is no answer to a request."""
    return _response(status, f"{text}\n".encode(errors="backslashreplace"), "text/plain")


def _response(status: HTTPStatus, body: bytes, kind: str) -> Response:
    text = f"{kind}; charset=utf-8" if kind.startswith("text/") else kind
    length = str(len(body))
    headers = {"Content-Type": text, "Content-Length": length, "Connection": "close", **SECURE}
    return Response(status.value, status.phrase, Headers(headers), body)
