"""Files that are dropped onto the page: viser's page with a script more, which sends them by a request of its own."""

import asyncio
import gzip
from collections.abc import Callable
from urllib.parse import parse_qs, urlsplit

_LARGEST = 1 << 30
"""Bytes of a file."""
_PATH = "/dropped"
_SCRIPT = b"""<script>
addEventListener("dragover", (event) => event.preventDefault(), true);
addEventListener("drop", (event) => {
  event.preventDefault();
  const file = event.dataTransfer.files[0];
  if (file) fetch("/dropped?name=" + encodeURIComponent(file.name), { method: "POST", body: file });
}, true);
</script></head>"""


class DroppedFiles:
    """Answers the requests for the page and those of its script, in the place of viser's server."""

    def __init__(self, page: bytes, opened: Callable[[str, bytes], object]) -> None:
        """`page`: viser's, HTML. `opened`: called with the name and the content of each file."""
        self._page = gzip.compress(page.replace(b"</head>", _SCRIPT, 1))
        self._opened = opened

    async def answer(self, request: str, headers: dict[str, str], body: asyncio.StreamReader) -> bytes | None:
        """The answer to a request, by its first line; None: it is another's. Raises ValueError for what is none."""
        method, target, _ = request.split(" ")
        parts = urlsplit(target)
        if (method, parts.path) == ("POST", _PATH):
            return await self._receive(parts.query, headers, body)
        is_page = (method, parts.path) == ("GET", "/") and "upgrade" not in headers
        if is_page and "gzip" in headers.get("accept-encoding", ""):
            kind = "Content-Type: text/html; charset=utf-8", "Content-Encoding: gzip"
            return _answer("200 OK", *kind, content=self._page)
        return None

    async def _receive(self, query: str, headers: dict[str, str], body: asyncio.StreamReader) -> bytes:
        length = int(headers.get("content-length", ""))
        if not 0 <= length <= _LARGEST:
            return _answer("413 Content Too Large")
        name = parse_qs(query).get("name", [""])[0]
        self._opened(name, await body.readexactly(length))
        return _answer("204 No Content")


def _answer(status: str, *headers: str, content: bytes = b"") -> bytes:
    lines = [f"HTTP/1.1 {status}", *headers, f"Content-Length: {len(content)}", "Connection: close", "", ""]
    return "\r\n".join(lines).encode() + content
