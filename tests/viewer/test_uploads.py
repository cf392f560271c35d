"""Files that pages send: another scene, an environment, and what is neither."""

import gzip
import http.client
from urllib.parse import quote, urlsplit

import numpy as np
import pytest

import pica
from pica.images.pictures import write_exr
from pica.viewer.uploads import uploaded_environment, uploaded_scene
from tests.viewer.scenes import CAMERA, CANVAS, is_whole, redness, scene, until

pytest.importorskip("viser", reason="the extra pica[view] is not installed")

from tests.viewer.page import Page
from tests.viewer.serving import serving


@pytest.fixture(scope="module")
def glb(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("glb") / "two.glb"
    other = pica.Scene("two")
    for root in list((given := scene()).roots):
        given.remove(root)
        other.add(root)
    other.roots[1].mesh.sections[0].material.base_color = (0.1, 0.8, 0.1, 1.0)
    other.add(pica.Node("sun", light=pica.DirectionalLight(illuminance=3.0))).transform = pica.Camera.look_at(
        (1, 3, 2), (0, 0, 0)
    ).transform
    other.add(pica.Node("camera", camera=CAMERA)).transform = CAMERA.transform
    other.save(path)
    return path.read_bytes()


@pytest.fixture(scope="module")
def sky(tmp_path_factory) -> bytes:
    """A blue one."""
    path = tmp_path_factory.mktemp("sky") / "blue.exr"
    write_exr(
        path, {name: np.full((8, 16), value, np.float32) for name, value in zip("RGB", (0.1, 0.2, 2), strict=True)}
    )
    return path.read_bytes()


@pytest.fixture
def web(device):
    with serving(device) as served:
        yield served


@pytest.fixture
def page(web):
    made = Page(web.address)
    made.look(CAMERA, CANVAS)
    made.picture(lambda pixels: is_whole(pixels) and len(redness(pixels)))
    yield made
    made.close()


def test_another_scene_is_shown_instead_with_the_same_settings(web, page, glb):
    before = web.viewer
    page.set("Exposure", 0.5)
    page.upload("Open .glb", "two.GLB", glb)
    green = page.picture(lambda pixels: is_whole(pixels) and pixels[32, 48, 1] / 1.5 > pixels[32, 48, 0])
    assert not len(redness(green)) and web.viewer is not before and web.viewer.settings.post.exposure == 0.5
    assert not web.viewer.scene.animations or web.viewer.scene is not before.scene
    page.look(CAMERA, CANVAS)
    page.set("Node", "cube")
    until(lambda: web.viewer.node is not None)
    assert web.viewer.node.name == "cube" and web.viewer.node in web.viewer.scene, "the panel is the new scene's"


def test_an_environment_is_opened_turned_and_undone(web, page, sky):
    page.upload("Open .hdr, .exr, .ktx2", "blue.exr", sky)
    page.picture(lambda pixels: is_whole(pixels) and pixels[2, 48, 2] / 1.25 > pixels[2, 48, 0])
    page.set("Turned by", 90.0)
    until(lambda: web.viewer.scene.environment.rotation == pytest.approx(np.pi / 2))
    page.set("Strength", 0.5)
    until(lambda: web.viewer.scene.environment.strength == 0.5)
    for _ in range(3):
        page.set("Changes", "Undo")
    page.picture(lambda pixels: is_whole(pixels) and pixels[2, 48, 2] < 1.2 * pixels[2, 48, 0])
    web.change(lambda: setattr(web.viewer.scene, "environment", None))
    until(lambda: not web._panel._scene._environment)


def test_what_is_no_scene_is_said_and_changes_nothing(web, page, sky, glb):
    before, shown = web.viewer, web.viewer.scene.environment
    for label, name, content, fault in [
        ("Open .glb", "sky.exr", sky, "'sky.exr': the name must end in .glb"),
        ("Open .glb", "broken.glb", glb[:100], "'broken.glb'"),
        ("Open .glb", "../../none.glb", b"", "'../../none.glb'"),
        ("Open .hdr, .exr, .ktx2", "two.glb", glb, "must end in .hdr or .exr"),
        ("Open .hdr, .exr, .ktx2", "picture.hdr", b"garbage", "'picture.hdr'"),
    ]:
        page.upload(label, name, content)
        said = page.text(fault)
        assert "/tmp" not in said, "no path of this machine"
    assert web.viewer is before and web.viewer.scene.environment is shown


def test_uploads_have_the_limits_of_loading(glb, sky):
    with pytest.raises(pica.SceneError, match=r"'two.glb'.*pica.Limits"):
        uploaded_scene("two.glb", glb, pica.Limits(vertices=3))
    with pytest.raises(pica.SceneError, match=r"'sky.exr'.*pica.Limits"):
        uploaded_environment("sky.exr", sky, pica.Limits(pixels=3))


def requested(web, method, path, content=b"", **headers):
    """The status and the content of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", urlsplit(web.address).port, timeout=30)
    connection.request(method, path, content, headers)
    answer = connection.getresponse()
    return answer.status, answer.read()


def test_a_file_that_is_dropped_is_opened(web, page, glb, sky):
    before = web.viewer
    assert requested(web, "POST", f"/dropped?name={quote('two & more.glb')}", glb) == (204, b"")
    page.picture(lambda pixels: is_whole(pixels) and not len(redness(pixels)))
    assert web.viewer is not before
    assert requested(web, "POST", "/dropped?name=blue.exr", sky)[0] == 204
    page.picture(lambda pixels: is_whole(pixels) and pixels[:5, :, 2].mean() > pixels[:5, :, 0].mean() + 30)
    assert requested(web, "POST", "/dropped", b"what")[0] == 204
    page.text("the name must end in .glb")


def test_only_the_page_itself_drops_files(web, glb):
    before, port = web.viewer, urlsplit(web.address).port
    assert requested(web, "POST", "/dropped?name=two.glb", glb, Origin="http://example.org")[0] == 403
    own = {"Origin": f"http://127.0.0.1:{port}", "Content-Length": str(1 << 40)}
    assert requested(web, "POST", "/dropped?name=two.glb", **own)[0] == 413
    for length in ("-1", "many"):
        try:
            status, _ = requested(web, "POST", "/dropped?name=two.glb", **{"Content-Length": length})
        except (http.client.HTTPException, ConnectionError):
            continue
        assert status == 413
    assert web.viewer is before and web._due.empty()


def test_the_page_has_the_script_that_sends_files(web):
    status, content = requested(web, "GET", "/", **{"Accept-Encoding": "gzip"})
    page = gzip.decompress(content)
    assert status == 200 and page.count(b"/dropped?name=") == 1 and page.rstrip().endswith(b"</html>")
