"""The page in a real browser, where there is one: dragging orbits, a click picks, a setting changes the picture."""

import shutil
import threading
import time

import numpy as np
import pytest

import pica
from pica.viewer.viewer import Viewer
from tests.viewer.test_web import CAMERA, scene, until

pytest.importorskip("viser", reason="the extra pica[view] is not installed")
sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright, which drives a browser")
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None, reason="no chromium or google-chrome"),
]
SOFTWARE = ["--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


def test_a_page_is_looked_at_and_used(device):
    from pica.viewer.web.server import WebViewer

    viewer = Viewer(scene(), settings=pica.Settings.preset("raster"), device=device, frames=2)
    web = WebViewer(viewer, size=(320, 200), port=0, camera=CAMERA)
    thread = threading.Thread(target=web.run, daemon=True)
    thread.start()
    try:
        with sync_api.sync_playwright() as play:
            browser = play.chromium.launch(executable_path=BROWSER, args=SOFTWARE)
            page = browser.new_page(viewport={"width": 1000, "height": 640})
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
            assert viewer.selected.node.name == "cube"
            page.get_by_text("Post", exact=True).click()
            page.get_by_label("Auto exposure").click()
            until(lambda: not viewer.settings.post.auto_exposure)
            browser.close()
    finally:
        web.stop()
        thread.join(30)
