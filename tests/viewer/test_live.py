"""pica.view: a page by a thread of its own, while the program goes on."""

import subprocess
import sys
import time

import pytest

import pica
from pica.scenes.placing import move
from tests.viewer.scenes import CAMERA, CANVAS, is_whole, redness, scene

pytest.importorskip("viser", reason="the extra pica[view] is not installed")

from tests.viewer.page import Page

RASTER = pica.Settings.preset("raster")


@pytest.fixture(scope="module")
def shown(device):
    with pica.view(scene(), size=CANVAS, camera=CAMERA, settings=RASTER, device=device, frames=2) as live:
        yield live


def test_changes_by_the_program_are_on_the_page(shown):
    page = Page(shown.address)
    page.look(CAMERA, CANVAS)
    page.picture(is_whole)
    [cube] = [node for node in shown._web.viewer.scene.nodes() if node.name == "cube"]
    with shown.paused():
        cube.transform = move(1, 0.5, 0)
    page.picture(lambda pixels: is_whole(pixels) and redness(pixels).mean() > 55)
    time.sleep(1.0)  # nothing is rendered any more
    with shown.paused():
        cube.mesh.sections[0].material.base_color = (0.1, 0.8, 0.1, 1.0)
    page.picture(lambda pixels: is_whole(pixels) and not len(redness(pixels)))
    page.close()


def test_a_cell_shows_the_page(shown):
    html = shown._repr_html_()
    assert f'<iframe src="{shown.address}"' in html and 'height="64"' in html
    assert repr(shown) == f"<pica.view of {shown.address}>"


def test_another_view_of_a_scene_ends_the_one_before(device):
    model = scene()
    first = pica.view(model, size=CANVAS, settings=RASTER, device=device)
    second = pica.view(model, size=CANVAS, settings=RASTER, device=device)
    assert first.closed and not second.closed and "closed" in first._repr_html_()
    with pytest.raises(OSError):
        Page(first.address)
    Page(second.address).close()
    second.close()
    second.close()
    assert second.closed and not second._thread.is_alive()


def test_a_process_ends_with_a_page_open(device):
    program = (
        "import pica; page = pica.view(pica.scenes.cornell(), settings=pica.Settings.preset('raster'), "
        f"device={device.name!r}); print(page.address)"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert (run.returncode, run.stderr) == (0, "") and run.stdout.startswith("http://127.0.0.1:")


@pytest.mark.parametrize("wrong", [{"scene": 1}, {"size": (0, 9)}, {"frames": 0}, {"settings": "fast"}])
def test_what_cannot_be_shown_is_an_error(wrong):
    given = {"scene": pica.Scene()} | wrong
    with pytest.raises(pica.PicaError, match=next(iter(wrong))):
        pica.view(given.pop("scene"), **given)


def test_without_viser_one_line_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(pica.PicaError, match=r"pip install pica\[view\]"):
        pica.view(pica.Scene())
