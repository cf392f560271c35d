"""The viewer in the browser: pages that speak viser's protocol, good ones and bad ones."""

import io
import socket
from contextlib import suppress

import numpy as np
import pytest
import rich.console
from PIL import Image

import pica
from tests.viewer.scenes import CAMERA, CANVAS, is_whole, redness, until

viser = pytest.importorskip("viser", reason="the extra pica[view] is not installed")

from pica.viewer.web.client_camera import ClientPose, rotation_of, up_of  # noqa: E402
from pica.viewer.web.panel import described  # noqa: E402
from pica.viewer.web.server import WebViewer  # noqa: E402
from tests.viewer.page import Page, quaternion  # noqa: E402
from tests.viewer.serving import serving  # noqa: E402


@pytest.fixture(scope="module")
def web(device):
    with serving(device) as served:
        yield served


@pytest.fixture
def page(web):
    web.change(lambda: web.viewer.select(None))  # so that inputs of what is selected come with the selection
    until(lambda: web.viewer.node is None)
    made = Page(web.address)
    made.look(CAMERA, CANVAS)
    yield made
    made.close()


def test_a_page_gets_pictures_up_to_the_whole_one(page):
    first = page.picture()
    assert first.shape[0] < 64, "a small one comes first"
    whole = page.picture(is_whole)
    assert abs(redness(whole).mean() - 47.5) < 2, "the cube is in the middle"


def test_the_camera_of_the_page_moves_the_picture(page):
    page.picture(is_whole)
    page.look(pica.Camera.look_at((-1, 1.5, 4), (-1, 0.5, 0)), CANVAS)
    page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() > 55)  # the camera has gone left


def test_pictures_at_rest_are_finer_than_those_in_motion(page):
    moving, resting = (step_of(jpeg_of(quality)) for quality in (75, 95))

    def step(message):
        return step_of(message["rgb_data"]) if message.get("rgb_data") else None

    page.wait(lambda message: step(message) == resting)  # not after a whole one: that may be the last that comes
    for x in range(1, 20):  # a page gets the newest picture alone, and may miss the only one in motion
        page.look(pica.Camera.look_at((-x / 4, 1.5, 4), (-x / 4, 0.5, 0)), CANVAS)
        with suppress(TimeoutError):
            page.wait(lambda message: step(message) == moving, seconds=2)
            break
    else:
        pytest.fail("no picture in motion has come")
    page.wait(lambda message: step(message) == resting)


def jpeg_of(quality: int) -> bytes:
    target = io.BytesIO()
    Image.new("RGB", (8, 8)).save(target, "jpeg", quality=quality)
    return target.getvalue()


def step_of(data: bytes) -> int:
    """Sum of the quantization of brightness in a JPEG."""
    return sum(Image.open(io.BytesIO(data)).quantization[0])


def test_viser_prints_nothing_not_even_in_a_notebook(device, monkeypatch):
    written = io.StringIO()
    console = rich.console.Console(file=written)  # as in a notebook, where it does not write to standard output
    monkeypatch.setattr(rich, "_console", console)
    with serving(device):
        pass
    console.print("done")
    assert written.getvalue() == "done\n"


def test_pictures_have_the_shape_of_the_page(page):
    page.picture(is_whole)
    page.look(CAMERA, (64, 96))
    page.picture(lambda pixels: pixels.shape == (96, 64, 3))


def test_settings_change_the_picture_and_the_panel(web, page):
    before = page.picture(is_whole).mean()
    page.set("Exposure", -2.0)
    after = page.picture(lambda pixels: is_whole(pixels) and pixels.mean() < 0.75 * before)
    assert after.mean() < before
    page.set("Preset", "raster")
    page.picture(lambda pixels: is_whole(pixels) and abs(pixels.mean() - before) < 3)
    assert web.viewer.settings == pica.Settings.preset("raster")
    assert page.texts[page.inputs["Exposure"]]["value"] == 0.0, "the panel has followed"


def test_a_setting_that_cannot_be_is_said_and_put_back(web, page):
    page.picture(is_whole)
    page.set("Exposure", 1e6)
    assert "post.exposure" in page.text("is outside")
    assert page.texts[page.inputs["Exposure"]] == {"value": 0.0}
    assert web.viewer.settings == pica.Settings.preset("raster")


def test_a_fault_in_a_shader_is_said(web, page, monkeypatch):
    page.picture(is_whole)
    faults = [pica.errors.ShaderError("step.slang:3: a fault")]

    def follow():
        if faults:
            raise faults.pop()
        return False

    monkeypatch.setattr(web.viewer, "follow_shaders", follow)
    assert "a fault" in page.text("step.slang&#58;3"), "on top, until the next picture"
    page.look(pica.Camera.look_at((-1, 1.5, 4), (-1, 0.5, 0)), CANVAS)
    page.picture(is_whole)


def test_an_aov_is_shown_instead(web, page):
    page.picture(is_whole)
    page.set("Shown", "instance")
    colours = page.picture(lambda pixels: is_whole(pixels) and pixels[-1, 48].std() > 15)
    assert not np.allclose(colours[-1, 48], colours[32, 48], atol=20)
    page.set("Shown", "display")
    page.picture(lambda pixels: is_whole(pixels) and pixels[-1, 48].std() < 15)


def test_clicks_pick(web, page):
    page.picture(is_whole)
    page.click(0.5, 0.4)
    pixel = page.text("geometric normal")
    assert "albedo | 0.8, 0.1, 0.1" in pixel and "sRGB" in pixel
    page.click(0.5, 0.0)
    assert page.text("Click a surface")
    page.click(0.5, 0.5)
    text = page.text("cube")
    assert "section 0" in text and "red&#124;paint" in text, "names have no meaning in Markdown"
    page.click(0.5, 0.0)
    assert page.text("Click a surface")
    page.click(float("nan"), 5.0)
    page.click(0.5, 0.99)
    assert "floor" in page.text("floor")


def test_the_animation_plays_and_is_scrubbed(web, page):
    page.picture(is_whole)
    page.set("Seconds", 1.0)
    scrubbed = page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() > 60)
    assert scrubbed is not None and web.viewer.playback.time == 1.0
    page.set("Speed", -1.0)
    page.set("Loop", False)
    page.set("Play", True)
    until(lambda: web.viewer.playback.playing)
    until(lambda: not web.viewer.playback.playing)
    ended = {"uuid": page.inputs["Play"], "updates": {"value": False}, "type": "GuiUpdateMessage"}
    page.picture_and(lambda message: message == ended, lambda pixels: is_whole(pixels) and redness(pixels).mean() < 50)
    assert web.viewer.playback.time == 0.0 and not web.viewer.playback.playing


def test_buttons_move_the_camera_of_their_page_alone(web, page):
    other = Page(web.address)
    other.look(pica.Camera.look_at((0, 8, 0.1), (0, 0, 0)), CANVAS)
    page.picture(is_whole)
    page.look(pica.Camera.look_at((-1, 1.5, 4), (-1, 0.5, 0)), CANVAS, (-1, 0.5, 0))
    page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() > 55)
    page.set("Home", True)
    moved = page.wait(lambda message: message["type"] == "SetCameraPositionMessage" and message)
    np.testing.assert_allclose(moved["position"], (0, 1.5, 4), atol=1e-6)
    page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() < 55)
    with pytest.raises(TimeoutError):
        other.wait(lambda message: message["type"] == "SetCameraPositionMessage" and not message["initial"], 2.0)
    other.close()


def test_a_picture_is_sent_as_a_file(page):
    page.picture(is_whole)
    page.set("Save picture", True)
    start = page.wait(lambda message: message["type"] == "FileTransferStartDownload" and message)
    assert start["filename"] == "display.png" and start["mime_type"] == "image/png"


def test_a_frame_is_sent_with_its_aovs(page, tmp_path):
    page.picture(is_whole)
    page.set("Save .exr", True)
    starts, parts = [], []

    def come(message):
        if message["type"] == "FileTransferStartDownload":
            starts.append(message)
        if message["type"] == "FileTransferPart":
            parts.append(message["content"])
        return starts and sum(map(len, parts)) == starts[0]["size_bytes"]

    page.wait(come)
    assert starts[0]["filename"] == "frame.exr"
    (tmp_path / "frame.exr").write_bytes(b"".join(parts))
    channels = pica.read_exr(tmp_path / "frame.exr")
    assert channels["R"].shape == (64, 96) and {"depth.Z", "normal.X"} <= channels.keys()


def test_numbers_of_the_camera_are_typed(web, page):
    page.picture(is_whole)
    page.set("Position", (-1.0, 1.5, 4.0))
    moved = page.wait(lambda message: message["type"] == "SetCameraPositionMessage" and message)
    np.testing.assert_allclose(moved["position"], (-1, 1.5, 4), atol=1e-6)
    page.set("Target", (-1.0, 0.5, 0.0))
    page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() > 55)
    until(lambda: page_control(web).camera.transform[0, 3] == pytest.approx(-1))
    np.testing.assert_allclose(page_control(web).pivot, (-1, 0.5, 0))
    page.set("Field of view", 1e9)  # nothing in the page's own code would send that
    until(lambda: np.degrees(page_control(web).camera.vertical_fov) == pytest.approx(170))
    page.set("Position", (1.0, 2.0))
    page.set("Position", (float("nan"), 2.0, 3.0))
    page.set("Field of view", 45.0)
    until(lambda: np.degrees(page_control(web).camera.vertical_fov) == pytest.approx(45))
    assert page_control(web).camera.transform[0, 3] == pytest.approx(-1)


def page_control(web):
    """The camera control of the only page."""
    [client] = web._clients.values()
    return client.view.control


def test_a_path_is_recorded_and_sent(web, page):
    page.picture(is_whole)
    page.set("Path", "Add")
    assert page.text("Cameras: 1")
    page.set("Path", "Add")
    assert page.text("Cameras: 2")
    page.set("Path", "Save")
    start = page.wait(lambda message: message["type"] == "FileTransferStartDownload" and message)
    assert start["filename"] == "cameras.json" and start["size_bytes"] == len(web.viewer.path.file()) > 100
    page.set("Path", "Clear")
    until(lambda: not len(web.viewer.path))


def test_bad_pages_stop_nobody(web, page):
    page.picture(is_whole)
    for data in (b"", b"\xc1garbage", "text", b"\x81\xa4type\xa4Nope"):
        bad = Page(web.address)
        bad.socket.send(data)
        bad.close()
    gone = Page(web.address)
    gone.look(CAMERA, CANVAS)
    gone.socket.socket.shutdown(socket.SHUT_RDWR)  # without a word
    wrong = Page(web.address)
    for canvas, target in [((10**9, 1), (0, 0, 0)), ((0, 0), (0, 0, 0)), (CANVAS, (np.nan, 0, 0))]:
        wrong.look(CAMERA, canvas, target)
    with socket.create_connection(("127.0.0.1", int(web.address.rpartition(":")[2]))) as raw:
        raw.sendall(b"GET / HTTP/9\r\n\r\n\x00\xff")
    page.look(pica.Camera.look_at((-1, 1.5, 4), (-1, 0.5, 0)), CANVAS)
    page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() > 55)


def test_nobody_may_open_a_tunnel(web):
    from viser import _messages

    assert _messages.ShareUrlRequest not in web._server._connection._incoming_handlers


def test_an_address_that_is_taken_is_an_error(web, device):
    port = int(web.address.rpartition(":")[2])
    for host, number, fault in [
        ("127.0.0.1", port, "in use"),
        ("203.0.113.1", 0, "assign"),
        ("127.0.0.1", 70000, "65535"),
    ]:
        with pytest.raises(pica.PicaError, match=f"cannot listen on '{host}', port {number} .*{fault}"):
            WebViewer(web.viewer, size=CANVAS, host=host, port=number)


def test_without_viser_one_line_names_the_extra(web, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(pica.PicaError, match=r"pip install pica\[view\]"):
        WebViewer(web.viewer, size=CANVAS, port=0)


def test_poses_go_over_and_back():
    class Handle:
        wxyz, position = quaternion(CAMERA.pose("opencv")[:3, :3]), tuple(CAMERA.transform[:3, 3])
        fov, look_at, image_width, image_height = CAMERA.vertical_fov, (0, 0.5, 0), 96, 64

    pose = ClientPose.of(Handle())
    np.testing.assert_allclose(pose.transform, CAMERA.transform, atol=1e-12)
    np.testing.assert_allclose(rotation_of((2, 0, 0, 0)), np.eye(3))
    Handle.position = (np.nan, 0, 0)
    assert ClientPose.of(Handle()) is None
    np.testing.assert_array_equal(up_of(CAMERA), (0, 1, 0))
    tilted = pica.Camera.look_at((0, 0, 4), (0, 0, 0), up=(1, 1, 0))
    np.testing.assert_allclose(up_of(tilted), np.array((1, 1, 0)) / np.sqrt(2), atol=1e-12)


def test_what_is_picked_is_described_without_a_surface():
    assert "Click" in described(None)


def test_the_tree_selects_and_properties_change_the_scene(web, page):
    page.picture(is_whole)
    page.set("Node", "cube")
    page.input("Emitted radiance")
    page.set("Translation", (-1.0, 0.5, 0.0))
    page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() < 40)
    page.set("Base colour", (30, 30, 250))
    page.picture(lambda pixels: is_whole(pixels) and pixels[32, 24, 2] / 2 > pixels[32, 24, 0])
    page.set("Visible", False)
    page.wait(lambda message: message["type"] == "BackgroundImageMessage")
    cube = web.viewer.node
    until(lambda: not cube.visible_to_camera)
    for _ in range(3):
        page.set("Changes", "Undo")
    page.picture(lambda pixels: is_whole(pixels) and len(redness(pixels)) and abs(redness(pixels).mean() - 47.5) < 2)
    assert cube.visible_to_camera and not web.viewer.edits.can_undo
    page.set("Node", "(nothing)")
    until(lambda: web.viewer.node is None)


def test_values_that_no_page_sends_are_ignored(web, page):
    page.picture(is_whole)
    page.set("Node", "no such node")
    page.set("Shown", "no such picture")
    page.set("Node", "floor")
    page.input("Emitted radiance")
    for label, value in [("Translation", (1.0,)), ("Base colour", (1, 2, 3, 4)), ("Scale", (float("nan"), 0.0, 1.0))]:
        page.set(label, value)
    page.set("Node", "(nothing)")
    until(lambda: web.viewer.node is None)
    assert not web.viewer.edits.can_undo


def test_a_preset_is_compared_with_at_a_place_that_moves(web, page):
    page.picture(is_whole)
    page.set("Exposure", 2.0)
    page.picture(lambda pixels: is_whole(pixels) and pixels[60, 80].mean() > 180)
    page.set("Beside it", "raster")
    page.picture(lambda pixels: is_whole(pixels) and pixels[60, 10].mean() > 180 > pixels[60, 80].mean())
    page.set("Split", 0.9)
    page.picture(lambda pixels: is_whole(pixels) and pixels[60, 80].mean() > 180 > pixels[60, 92].mean())
    page.set("Beside it", "(none)")
    page.picture(lambda pixels: is_whole(pixels) and pixels[60, 92].mean() > 180)
    page.set("Exposure", 0.0)
    until(lambda: web.viewer.settings == pica.Settings.preset("raster"))
