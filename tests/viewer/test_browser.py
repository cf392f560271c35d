"""The page in a real browser, where there is one: dragging orbits, a click picks, a setting changes the picture."""

import base64
import io
import shutil
import time

import numpy as np
import pytest
from PIL import Image

import pica
from tests.viewer.scenes import CAMERA, redness, scene, until
from tests.viewer.serving import serving

pytest.importorskip("viser", reason="the extra pica[view] is not installed")
sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright, which drives a browser")


BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None, reason="no chromium or google-chrome"),
]
SOFTWARE = ["--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


@pytest.fixture
def open_browser():
    """Opens an empty page of a size."""
    with sync_api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=SOFTWARE)
        yield lambda viewport: browser.new_page(viewport=viewport)
        browser.close()


def test_a_page_is_looked_at_and_used(device, open_browser):
    with serving(device, (320, 200)) as web:
        page = open_browser({"width": 1000, "height": 640})
        page.goto(web.address)
        page.get_by_text("2 frames").wait_for(timeout=60_000)
        [client] = web._clients.values()
        before = client.view.control.camera
        np.testing.assert_allclose(before.transform, CAMERA.transform, atol=1e-6)
        page.mouse.move(200, 400)
        page.mouse.down()
        page.mouse.move(320, 400, steps=10)
        page.mouse.up()
        until(lambda: abs(client.view.control.camera.transform[0, 3]) > 1)
        after, pivot = client.view.control.camera.transform[:3, 3], client.view.control.pivot
        distance = np.linalg.norm(CAMERA.transform[:3, 3] - pivot)
        assert np.linalg.norm(after - pivot) == pytest.approx(distance, rel=1e-3), "an orbit"
        time.sleep(1.0)
        page.mouse.click(500, 320)
        page.get_by_text("section 0").wait_for(timeout=10_000)
        assert web.viewer.node.name == "cube"
        page.get_by_role("tab", name="Settings").click()
        page.get_by_text("Post", exact=True).click()
        page.get_by_label("Auto exposure").click()
        until(lambda: not web.viewer.settings.post.auto_exposure)


def test_a_file_is_opened_from_the_page(device, open_browser, tmp_path):
    green, path = scene(), tmp_path / "green.glb"
    green.roots[1].mesh.sections[0].material.base_color = (0.1, 0.8, 0.1, 1.0)
    green.save(path)
    raster = pica.Settings.preset("raster")
    with pica.view(scene(), size=(320, 200), camera=CAMERA, settings=raster, device=device, frames=2) as shown:
        page = open_browser({"width": 1000, "height": 640})
        page.goto(shown.address)
        page.get_by_text("2 frames").wait_for(timeout=60_000)
        until(lambda: len(redness(screenshot(page)[:, 330:600])) > 1000)
        page.get_by_role("tab", name="Scene").click()
        with page.expect_file_chooser() as chooser:
            page.get_by_role("button", name="Open .glb").click()
        chooser.value.set_files(path)
        until(lambda: not len(redness(screenshot(page)[:, 330:600])))
        page.get_by_text("2 frames").wait_for(timeout=60_000)


def test_a_file_is_dropped_onto_the_page(device, open_browser, tmp_path):
    green = scene()
    green.roots[1].mesh.sections[0].material.base_color = (0.1, 0.8, 0.1, 1.0)
    green.save(tmp_path / "green.glb")
    content = base64.b64encode((tmp_path / "green.glb").read_bytes()).decode()
    with serving(device, (320, 200)) as web:
        page = open_browser({"width": 1000, "height": 640})
        page.goto(web.address)
        page.get_by_text("2 frames").wait_for(timeout=60_000)
        until(lambda: len(redness(screenshot(page)[:, 330:600])) > 1000)
        data = page.evaluate_handle(
            """(content) => {
                const data = new DataTransfer();
                const bytes = Uint8Array.from(atob(content), (letter) => letter.charCodeAt(0));
                data.items.add(new File([bytes], "green.glb"));
                return data;
            }""",
            content,
        )
        page.dispatch_event("canvas >> nth=0", "drop", {"dataTransfer": data})
        until(lambda: not len(redness(screenshot(page)[:, 330:600])))


def test_a_notebook_s_cell_shows_the_page(device, open_browser):
    raster = pica.Settings.preset("raster")
    with pica.view(scene(), size=(480, 540), camera=CAMERA, settings=raster, device=device, frames=2) as shown:
        cell = open_browser({"width": 1000, "height": 640})
        cell.set_content(f"<p>Out[1]:</p>{shown._repr_html_()}")
        frame = cell.frame_locator("iframe")
        frame.get_by_text("2 frames").wait_for(timeout=60_000)
        time.sleep(1.0)
        cube = screenshot(cell)[:, 330:690]  # beside viser's note and the panel
        columns, rows = redness(cube), redness(cube.transpose(1, 0, 2))
        assert 0.8 < np.ptp(columns) / np.ptp(rows) < 1.25 and len(columns) > 3000, "the cube, as wide as high"


def test_a_browser_gets_in_with_the_token_once(device, open_browser):
    with serving(device, (320, 200), host="0.0.0.0") as web:
        root, _, token = web.address.partition("/?")
        root = f"http://127.0.0.1:{root.rpartition(':')[2]}"
        page = open_browser({"width": 1000, "height": 640})
        assert page.goto(root).status == 403
        assert page.get_by_text("Open the address").count() == 1
        page.goto(f"{root}/?{token}")
        page.get_by_text("2 frames").wait_for(timeout=60_000)
        assert "token" not in page.url
        page.reload()
        until(lambda: len(redness(screenshot(page)[:, 330:600])) > 1000)


def screenshot(page) -> np.ndarray:
    """(height, width, 3) of what the browser shows."""
    return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
