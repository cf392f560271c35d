"""Other machines need the token, and on this one pages of other servers get nothing."""

import contextlib
import http.client
import socket
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import WebSocketException

import pica
from tests.viewer.scenes import CAMERA, CANVAS, is_whole

pytest.importorskip("viser", reason="the extra pica[view] is not installed")

import viser

from pica.viewer.web.gate import Gate, hidden_address, is_loopback
from tests.viewer.page import Page
from tests.viewer.serving import serving


@pytest.fixture(scope="module")
def web(device):
    with serving(device, host="0.0.0.0") as served:
        yield served


@pytest.fixture
def port(web) -> int:
    return urlsplit(web.address).port


def get(port: int, path: str, headers=()) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path, headers=dict(headers))
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def test_the_address_has_the_token_and_the_name_of_the_machine(web):
    parts = urlsplit(web.address)
    assert parts.hostname == socket.gethostname().lower() and parts.query == f"token={web._gate.token}"
    other = Gate("0.0.0.0", 0, ("127.0.0.1", 1), None)
    assert len(web._gate.token) >= 20 and web._gate.token != other.token
    other.close()
    other.close()


@pytest.mark.parametrize(
    "path", ["/", "/index.html", "/?token=", "/?token=wrong", "/?token=%ff%fe", "/?tokens={token}", "/{token}"]
)
def test_without_the_token_there_is_nothing(web, port, path):
    status, _, body = get(port, path.replace("{token}", web._gate.token))
    assert (status, body) == (403, b"Open the address that pica view has printed.")


def test_no_cookie_but_the_token_s_opens_the_socket(web, port):
    for cookie in (
        "",
        f"pica-{port}=wrong",
        f"other={web._gate.token}",
        "\x7f;=;",
        f"pica-{port + 1}={web._gate.token}",
    ):
        with pytest.raises(WebSocketException):
            Page(f"http://127.0.0.1:{port}", cookie)


def test_the_address_gives_the_cookie_that_gives_the_page(web, port):
    status, headers, _ = get(port, f"/?{urlsplit(web.address).query}")
    assert (status, headers["Location"]) == (303, "/") and "HttpOnly; SameSite=Lax" in headers["Set-Cookie"]
    cookie = headers["Set-Cookie"].partition(";")[0]
    status, _, body = get(port, "/", {"Cookie": f"theme=dark; {cookie}"})
    assert status == 200 and b"<html" in body.lower()
    page = Page(f"http://127.0.0.1:{port}", cookie)
    page.look(CAMERA, CANVAS)
    page.picture(is_whole)
    page.close()


def test_the_server_behind_listens_where_no_page_finds_it(web, local):
    for each in (web, local):
        inner = each._server.get_host()
        assert is_loopback(inner) and inner != "127.0.0.1"
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", each._server.get_port()), timeout=10)
    assert hidden_address() != hidden_address()


@pytest.fixture(scope="module")
def local(device):
    """A server for this machine."""
    with serving(device) as served:
        yield served


def handshake(web, *headers: str) -> bytes:
    """The status of the answer to a WebSocket's first request with these headers."""
    lines = [
        "GET / HTTP/1.1",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        f"Sec-WebSocket-Protocol: viser-v{viser.__version__}",
        *headers,
    ]
    with socket.create_connection(("127.0.0.1", urlsplit(web.address).port), timeout=10) as raw:
        raw.sendall("\r\n".join([*lines, "", ""]).encode())
        return raw.recv(12)


def test_pages_of_the_server_itself_open_its_socket(local):
    port = urlsplit(local.address).port
    for host in ("127.0.0.1", "localhost", "[::1]"):
        assert handshake(local, f"Host: {host}:{port}", f"Origin: http://{host}:{port}") == b"HTTP/1.1 101"
    assert handshake(local, f"Host: 127.0.0.1:{port}") == b"HTTP/1.1 101", "no page, but a program"
    assert handshake(local, "Host: localhost:9000", "Origin: http://localhost:9000") == b"HTTP/1.1 101", "a tunnel"


def test_pages_of_other_servers_do_not(local):
    port = urlsplit(local.address).port
    here = f"Host: 127.0.0.1:{port}"
    for origin in ("http://example.org", f"http://127.0.0.1:{port + 1}", f"http://localhost:{port}", "null", "", "//"):
        assert handshake(local, here, f"Origin: {origin}") == b"HTTP/1.1 403", origin
    for host in (f"example.org:{port}", "", f"127.0.0.1.example.org:{port}", "[", "localhost:x@example.org"):
        assert handshake(local, f"Host: {host}", f"Origin: http://{host}") in (b"HTTP/1.1 403", b""), host
    assert handshake(local, f"Origin: http://127.0.0.1:{port}") == b"HTTP/1.1 403", "no host"
    two = here, f"Origin: http://127.0.0.1:{port}", "Origin: http://example.org"
    assert handshake(local, *two) == b""
    assert handshake(local, here, f"Host: example.org:{port}", f"Origin: http://example.org:{port}") == b""


def test_what_is_no_request_is_dropped(web, port):
    for data in (b"\r\n\r\n", b"\x00" * 100 + b"\r\n\r\n", b"A" * 100_000, b"GET /\r\n\r\n", b""):
        with socket.create_connection(("127.0.0.1", port), timeout=10) as raw:
            try:
                raw.sendall(data)
                raw.shutdown(socket.SHUT_WR)
                assert raw.recv(100) in (
                    b"",
                    b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\nConnection: close\r\n\r\n",
                )
            except ConnectionError:
                pass
    assert get(port, "/")[0] == 403


def test_only_so_many_clients_are_let_wait(port, web):
    waiting = [socket.create_connection(("127.0.0.1", port)) for _ in range(80)]
    dropped = 0
    for each in waiting:
        each.settimeout(0.05)
        with contextlib.suppress(TimeoutError):
            dropped += each.recv(1) == b""
        each.close()
    assert dropped >= 16
    assert get(port, "/")[0] == 403


def test_loopback_addresses_need_none():
    assert all(map(is_loopback, ("127.0.0.1", "127.1.2.3", "::1", "localhost")))
    assert not any(map(is_loopback, ("0.0.0.0", "::", "192.168.1.2", "example.org", "")))


def test_an_address_that_is_taken_is_an_error(port):
    with pytest.raises(pica.PicaError, match=f"cannot listen on '0.0.0.0', port {port} "):
        Gate("0.0.0.0", port, ("127.0.0.1", 1), None)
