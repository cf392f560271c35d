"""Lets those clients through to a server on this machine that may use it.

On a loopback address these are pages of the server's own: a browser names the page that opens a WebSocket in its header
Origin (RFC 6455, 10.2), and the name by which it has found the server in Host, so that another page cannot pass by a
name of its own for this machine (DNS rebinding). On other addresses they know a token: a browser that opens the address
with the token gets a cookie, and sends it with each request and with the handshake of its WebSocket (RFC 6265). Then
bytes are passed on as they are. All others get a line that says so.

The server itself listens at a random address of the loopback network, where no page finds it.
"""

import asyncio
import contextlib
import ipaddress
import secrets
import threading
from collections.abc import Awaitable, Callable, Coroutine
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
Answer = Callable[[str, dict[str, str], asyncio.StreamReader], Awaitable[bytes | None]]
"""Answers a request, by its first line and its headers, in the place of the server; None: the server does."""
_CHUNK = 1 << 16
_HELP = b"Open the address that pica view has printed."
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


def hidden_address() -> str:
    """A random address of the loopback network, 127.0.0.0/8."""
    return ".".join(["127", *(str(1 + secrets.randbelow(254)) for _ in range(3))])


class Gate:
    """Listens on an address until `close`, by a thread of its own."""

    def __init__(self, host: str, port: int, inner: tuple[str, int], answer: Answer) -> None:
        """`port`: 0 for any free one. `inner`: the server's address and port. `answer`: called first with the requests
        of clients that may pass. Raises PicaError if the address cannot be listened on."""
        self.token = "" if is_loopback(host) else secrets.token_urlsafe(16)
        """That clients must know, a new one; "" on loopback addresses, where there is none."""
        self.port = port
        self._inner, self._answer, self._open = inner, answer, 0
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
            request, headers = _parsed(head)
            _, target, _ = request.split(" ")
            if self._may_pass(headers):
                answer = await self._answer(request, headers, reader)
                if answer is None:
                    await self._pass_on(head, reader, writer)
                else:
                    writer.write(answer)
            elif self.token and self._is_token(parse_qs(urlsplit(target).query).get("token", [""])[0]):
                writer.write(
                    f"HTTP/1.1 303 See Other\r\nLocation: /\r\nContent-Length: 0\r\nConnection: close\r\n"
                    f"Set-Cookie: {self._cookie}={self.token}; HttpOnly; SameSite=Lax; Path=/\r\n\r\n".encode()
                )
            else:
                writer.write(_REFUSED)
            await writer.drain()
        except (OSError, ValueError, CookieError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # a client that speaks no HTTP, or has gone
        except asyncio.CancelledError:
            pass  # by `close`; asyncio of Python 3.11 writes a traceback for tasks of connections that end by it
        finally:
            self._open -= 1
            writer.close()

    def _may_pass(self, headers: dict[str, str]) -> bool:
        if not self.token:
            return is_loopback(_host(headers)) and _is_own_page(headers)
        cookies = SimpleCookie(headers.get("cookie", ""))
        return self._cookie in cookies and self._is_token(cookies[self._cookie].value)

    @property
    def _cookie(self) -> str:
        """Its name: cookies do not tell ports apart."""
        return f"pica-{self.port}"

    def _is_token(self, text: str) -> bool:
        return secrets.compare_digest(text.encode(), self.token.encode())

    async def _pass_on(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Connect a client with the server until either ends."""
        from_server, to_server = await asyncio.open_connection(*self._inner)
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
    """The first line and the headers of a request, by their names in lower case. Raises ValueError for what is none."""
    lines = head.decode("latin-1").split("\r\n")
    headers: dict[str, str] = {}
    for line in lines[1:]:
        name, _, value = line.partition(":")
        name, value = name.lower(), value.strip()
        if name in headers and name in ("host", "origin"):
            raise ValueError(f"two headers {name}")
        headers[name] = f"{headers[name]}; {value}" if name in headers else value
    return lines[0], headers


def _host(headers: dict[str, str]) -> str:
    """The name by which the client has found the server. Raises ValueError for what is none."""
    return urlsplit(f"//{headers.get('host', '')}").hostname or ""


def _is_own_page(headers: dict[str, str]) -> bool:
    """Whether a request is of no page, or of one from there where it goes."""
    origin = headers.get("origin")
    return origin is None or urlsplit(origin).netloc == headers.get("host", "")
