"""What objects say of themselves in a shell."""

import numpy as np
import pytest

import pica
from pica.scene.light import PointLight
from pica.scene.mesh import Mesh
from pica.scene.model import Node, Scene
from pica.scene.primitives import spheres
from pica.scenes.basic_meshes import box, plane
from tests.building import lambert, placed, scene_of, shining, uniform

SIZE = (16, 8)


def room():
    scene = scene_of(placed(plane(2, 2, lambert()), name="floor"), shining(PointLight()), environment=uniform(1))
    scene.name = "room"
    crate = placed(box(1, lambert(name="wood")), name="crate")
    crate.instances = np.tile(np.eye(4), (3, 1, 1))
    scene.add(crate).add(Node("lid", camera=scene.default_camera(1.5)))
    return scene


def test_scenes_say_what_they_hold():
    assert repr(room()) == "<pica.Scene 'room': 4 nodes, 38 triangles, 1 light, 1 camera, environment 8x4>"
    assert repr(Scene()) == "<pica.Scene '': 0 nodes>"
    assert len(repr(Scene("long\n" * 1000))) < 120 and "\n" not in repr(Scene("a\nb"))


def test_nodes_and_meshes_say_what_they_hold():
    floor, light, crate, lid = room().nodes()
    assert repr(floor) == "<pica.Node 'floor': mesh 'floor'>"
    assert repr(light) == "<pica.Node 'light': PointLight>"
    assert repr(crate) == "<pica.Node 'crate': mesh 'crate', children 'lid'>"
    assert repr(lid) == "<pica.Node 'lid': Camera>" and repr(Node()) == "<pica.Node '': nothing>"
    assert repr(crate.mesh) == "<pica.Mesh 'crate': 12 triangles in 1 section>"
    assert repr(crate.mesh.sections[0]) == "<pica.Section: 12 triangles of material 'wood'>"
    for name in "abcd":
        lid.add(Node(name))
    assert repr(lid) == "<pica.Node 'lid': Camera, children 'a', 'b', 'c', and 1 more>"
    balls = Mesh(primitives=[spheres(np.zeros((5, 3)), 1.0, lambert())])
    assert repr(balls) == "<pica.Mesh '': 0 triangles in 0 sections, 5 primitives>"


def test_settings_are_summed_up():
    settings = pica.Settings()
    assert settings.summary() == "quality"
    for preset in ("raster", "performance", "cinematic"):
        assert pica.Settings.preset(preset).summary() == preset
    changed = pica.Settings.preset("cinematic").with_values({"shadows.mode": "hard", "seed": 7})
    assert changed.summary() == "cinematic, shadows.mode=hard, seed=7"


@pytest.mark.device
def test_renderers_say_what_they_render(device):
    scene, settings = room(), pica.Settings.preset("raster").with_values({"seed": 3})
    renderer = pica.Renderer(scene, size=SIZE, settings=settings, device=device)
    told = f"of scene 'room', 16x8 on {device.name}"
    assert repr(renderer) == f"<pica.Renderer {told}: raster, seed=3>"
    renderer.close()
    assert repr(renderer) == f"<pica.Renderer {told}: closed>"
    with pica.PathTracer(scene, size=SIZE, device=device, max_depth=3) as tracer:
        assert repr(tracer).endswith("max_depth=3>") and repr(tracer).startswith(f"<pica.PathTracer {told}: quality")
    assert repr(tracer) == f"<pica.PathTracer {told}: closed>"
