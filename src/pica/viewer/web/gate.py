"""Lets those clients through to a server on this machine that know a token.

The server itself listens on the loopback interface alone. A browser that opens the address with the token gets a
cookie, and sends it with each request and with the handshake of its WebSocket (RFC 6265); then its bytes are passed on
as they are. All others get a line that says so.
"""

import asyncio
import contextlib
import ipaddress
import secrets
import threading
from collections.abc import Coroutine
from http.cookies import CookieError, SimpleCookie
from typing import Any, TypeVar
from urllib.parse import parse_qs, urlsplit

from pica.errors import PicaError, shown

_LONGEST = 16384
"""Bytes of a request's head."""
_SECONDS = 10.0
"""That a client may take to send it."""
_CLIENTS = 64
"""Connections at once; a page takes one, and some more while it loads."""
T = TypeVar("T")
_CHUNK = 1 << 16
_HELP = b"Open the address that pica view has printed, with its token."
_REFUSED = (
    b"HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain\r\nContent-Length: %d\r\nConnection: close\r\n\r\n%s"
    % (len(_HELP), _HELP)
)


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches an address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class Gate:
    """Listens on an address until `close`, by a thread of its own, with a new token."""

    def __init__(self, host: str, port: int, inner: int) -> None:
        """`port`: 0 for any free one. `inner`: the server's port on 127.0.0.1. Raises PicaError if the address cannot
        be listened on."""
        self.token = secrets.token_urlsafe(16)
        self.port = port
        self._inner, self._open = inner, 0
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="pica.gate", daemon=True)
        self._thread.start()
        try:
            self._server = self._run(asyncio.start_server(self._serve, host, port, limit=_LONGEST))
        except OSError as error:
            self._end()
            raise PicaError(f"cannot listen on {shown(host)}, port {port} ({error.strerror or error})") from None
        self.port = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """End all connections. Does nothing the second time."""
        if not self._loop.is_closed():
            self._run(self._shut())
            self._end()

    def _run(self, work: Coroutine[Any, Any, T]) -> T:
        """In the thread: that of the caller may have an event loop of its own."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _shut(self) -> None:
        self._server.close()
        clients = asyncio.all_tasks() - {asyncio.current_task()}
        for client in clients:
            client.cancel()
        await asyncio.gather(*clients, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._open += 1
        try:
            if self._open > _CLIENTS:
                return
            async with asyncio.timeout(_SECONDS):
                head = await reader.readuntil(b"\r\n\r\n")
            target, cookies = _parsed(head)
            if self._is_token(cookies.get(self._cookie, "")):
                await self._pass_on(head, reader, writer)
            elif self._is_token(parse_qs(urlsplit(target).query).get("token", [""])[0]):
                writer.write(
                    f"HTTP/1.1 303 See Other\r\nLocation: /\r\nContent-Length: 0\r\nConnection: close\r\n"
                    f"Set-Cookie: {self._cookie}={self.token}; HttpOnly; SameSite=Lax; Path=/\r\n\r\n".encode()
                )
            else:
                writer.write(_REFUSED)
            await writer.drain()
        except (OSError, ValueError, CookieError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # a client that speaks no HTTP, or has gone
        finally:
            self._open -= 1
            writer.close()

    @property
    def _cookie(self) -> str:
        """Its name: cookies do not tell ports apart."""
        return f"pica-{self.port}"

    def _is_token(self, text: str) -> bool:
        return secrets.compare_digest(text.encode(), self.token.encode())

    async def _pass_on(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Connect a client with the server until either ends."""
        from_server, to_server = await asyncio.open_connection("127.0.0.1", self._inner)
        try:
            to_server.write(head)
            pipes = [asyncio.create_task(_copy(*ends)) for ends in ((reader, to_server), (from_server, writer))]
            try:
                await asyncio.wait(pipes, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for pipe in pipes:
                    pipe.cancel()
                await asyncio.gather(*pipes, return_exceptions=True)
        finally:
            to_server.close()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(_CHUNK):
            writer.write(data)
            await writer.drain()


def _parsed(head: bytes) -> tuple[str, dict[str, str]]:
    """The target and the cookies of a request. Raises ValueError or CookieError for what is none."""
    lines = head.decode("latin-1").split("\r\n")
    _, target, _ = lines[0].split(" ")
    cookies: SimpleCookie = SimpleCookie()
    for line in lines[1:]:
        name, _, value = line.partition(":")
        if name.lower() == "cookie":
            cookies.load(value.strip())
    return target, {name: cookie.value for name, cookie in cookies.items()}
