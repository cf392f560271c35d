"""pica's path tracer against Mitsuba 3 with the same light transport, and the comparison against itself."""

import math

import numpy as np
import pytest

import pica
from pica.scene.light import DirectionalLight, DiskLight, PointLight, RectangleLight, SphereLight, SpotLight
from pica.scene.material import AlphaMode, Image, Material, Texture
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import aim, mesh, move, place
from tests.assets import ASSETS, needs_assets
from tests.reference.mitsuba_material import Lobes
from tests.reference.mitsuba_scene import render_reference
from tests.reference.variant import dr, mi

pytestmark = pytest.mark.thorough
CAMERA = pica.Camera.look_at((0.7, 0.6, 1.2), (0, 0.34, 0), vertical_fov=math.radians(35))


def matt(*color):
    return Material(base_color=(*color, 1.0), metallic=0.0, specular=0.0)


def lit_floor(light, placement, environment=None):
    """A matt white floor of 2 x 2 metres under one light."""
    scene = Scene(environment=environment)
    root = scene.add(Node())
    place(root, "floor", mesh("floor", [plane(2, 2, matt(1, 1, 1))]))
    place(root, "light", light, placement)
    return scene


def looking_down(height=1.0, fov=2.0):
    """A camera that sees little more than the origin of the floor."""
    return pica.Camera.look_at((0, height, 0), (0, 0, 0), vertical_fov=math.radians(fov))


DOWN = np.array([[1, 0, 0, 0], [0, 0, 1, 2], [0, -1, 0, 0], [0, 0, 0, 1]], np.float64)
"""A light 2 metres above the origin that shines straight down."""


@pytest.mark.parametrize(
    ("light", "irradiance"),
    [
        (DirectionalLight(illuminance=3.0), 3.0),
        (DirectionalLight(illuminance=3.0, angular_diameter=0.2), 3.0),
        (PointLight(intensity=8.0), 2.0),
        (PointLight(intensity=8.0, radius=0.1), 2.0),
        (PointLight(intensity=8.0, range=3.0), 2.0 * (1 - (2 / 3) ** 4)),
        (SpotLight(intensity=8.0, radius=0.1), 2.0),
        # Form factors of a facing disk and rectangle: Howell, "Radiation Transfer Configuration Factors", B-12, B-5.
        (DiskLight(radiance=5.0, radius=0.5), 5.0 * math.pi * 0.25 / 4.25),
        (RectangleLight(radiance=5.0), 20.0 * 0.25 / 1.0625**0.5 * math.atan(0.25 / 1.0625**0.5)),
        (SphereLight(radiance=5.0, radius=0.5), 5.0 * math.pi * 0.25 / 4.0),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, float) else "",
)  # fmt: skip
def test_reference_lights_have_closed_form_irradiance(light, irradiance):
    picture = render_reference(lit_floor(light, DOWN), looking_down(), (4, 4), samples=4096, max_depth=2)
    assert picture.mean() == pytest.approx(irradiance / math.pi, rel=0.01)


def test_reference_environment_faces_the_right_way():
    """One bright quarter of the surroundings, from +X to +Z, lights balls from there; turned, from +Z to -X."""
    radiance = np.zeros((64, 128, 3), np.float32)
    radiance[:, 64:96] = 1  # u from 0.5 (+X) to 0.75 (+Z)
    for rotation, corner in ((0.0, (1, 1)), (math.pi / 2, (1, -1)), (-math.pi / 2, (-1, 1))):
        scene = Scene(environment=pica.Environment(radiance, rotation=rotation))
        scene.add(Node(mesh=mesh("ball", [sphere(0.5, matt(1, 1, 1), 64)])))
        x, z = corner
        toward = np.array([x, 0, z]) / math.sqrt(2)
        lit, dark = (
            render_reference(
                scene, pica.Camera.look_at(side * toward * 3, (0, 0, 0), vertical_fov=math.radians(5)), (8, 8), 64, 2
            ).mean()
            for side in (1, -1)
        )
        assert lit > 0.4 and dark < 0.01 * lit


def test_reference_textures_are_upright():
    """The texture's first row is at v = 0, which is towards -Z on a plane."""
    pixels = np.zeros((2, 2, 4), np.uint8)
    pixels[..., 3] = 255
    pixels[0, 0, 0] = pixels[0, 1, 1] = pixels[1, 0, 2] = 255
    material = matt(1, 1, 1)
    material.base_color_texture = Texture(Image(pixels))
    scene = Scene(environment=pica.Environment(np.ones((8, 16, 3), np.float32)))
    scene.add(Node(mesh=mesh("floor", [plane(2, 2, material)])))
    camera = pica.Camera.look_at((0, 4, 0), (0, 0, 0), vertical_fov=2 * math.atan(0.25), up=(0, 0, -1))
    picture = render_reference(scene, camera, (4, 4), samples=64, max_depth=2)
    corners = picture[[0, 0, 3, 3], [0, 3, 0, 3]]
    np.testing.assert_allclose(corners > 0.3, np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], bool))


@pytest.mark.parametrize(("mode", "alpha", "share"), [("MASK", 0.3, 1.0), ("MASK", 0.7, 0.0), ("BLEND", 0.3, 0.7)])
def test_reference_shadow_rays_see_alpha(mode, alpha, share):
    """A sheet between a light and the floor lets through what it does not cover; depth 2 still is direct light."""
    scene = lit_floor(PointLight(intensity=8.0), DOWN)
    sheet = Material(base_color=(1, 1, 1, alpha), metallic=0.0, alpha_mode=AlphaMode(mode))
    place(scene.roots[0], "sheet", mesh("sheet", [plane(2, 2, sheet)]), move(y=1.5))
    picture = render_reference(scene, looking_down(), (4, 4), samples=4096, max_depth=2)
    assert picture.mean() == pytest.approx(share * 2 / math.pi, rel=0.02, abs=1e-6)


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_reference_material_keeps_all_light(roughness, metallic):
    """In white surroundings a white surface that absorbs nothing is white from every side."""
    lobes = Lobes(mi.Color3f(1), mi.Float(metallic), mi.Float(roughness), 1.5, mi.Float(1), mi.Color3f(1))
    rng = mi.PCG32(size=2**20)
    for cosine in (0.2, 0.9):
        view = mi.Vector3f(math.sqrt(1 - cosine**2), 0, cosine)
        light = lobes.sample(view, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
        pdf = lobes.pdf(view, light)
        share = dr.mean(dr.select((light.z > 0) & (pdf > 0), lobes.evaluate(view, light).x * light.z / pdf, 0))
        # Between full metal and full dielectric glTF's mix is not exactly white.
        assert float(share[0]) == pytest.approx(1.0, abs=0.005 if metallic in (0.0, 1.0) else 0.03)


@needs_assets
@pytest.mark.device
@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_path_tracer_matches_on_a_textured_scene_under_an_environment():
    scene = pica.load(ASSETS / "FlightHelmet" / "FlightHelmet.gltf", environment=ASSETS / "env" / "courtyard.hdr")
    low, _ = scene.bounds()
    floor = Material("floor", base_color=(0.5, 0.5, 0.5, 1.0), metallic=0.0, roughness=0.6)
    scene.add(Node("floor", mesh=mesh("floor", [plane(10, 10, floor)]))).transform = move(y=float(low[1]))
    _compare(scene, samples=256, max_depth=5)


@pytest.mark.device
@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_path_tracer_matches_on_all_kinds_of_light():
    scene = Scene()
    root = scene.add(Node())
    place(root, "floor", mesh("floor", [plane(4, 4, Material(base_color=(0.6, 0.5, 0.4, 1), metallic=0.0))]))
    copper = Material(base_color=(0.9, 0.5, 0.3, 1), metallic=1.0, roughness=0.3)
    place(root, "ball", mesh("ball", [sphere(0.3, copper)]), move(0, 0.34, 0))
    for light, x, z in (
        (DirectionalLight((1, 0.9, 0.8), 1.0, math.radians(5)), 1, 2),
        (PointLight((1, 0.6, 0.4), 1.0, radius=0.1), -1, 1),
        (SpotLight((0.4, 0.6, 1), 4.0, 0.2, 0.5, radius=0.05), 1, -1),
        (RectangleLight((0.5, 1, 0.5), 3.0, 0.6, 0.4), -1, -1),
        (DiskLight((1, 0.4, 1), 3.0, 0.3), 0, 1.5),
        (SphereLight((1, 1, 0.5), 6.0, 0.15), 1.3, 0.4),
    ):
        place(root, type(light).__name__, light, aim((x, 1.5, z), (0, 0.2, 0)))
    _compare(scene, samples=256, max_depth=4)


def _compare(scene, samples, max_depth):
    """Mean radiance within 1 % of the whole picture and within 2 % of each of its colours."""
    size = (160, 120)
    picture = pica.PathTracer(scene, size=size, max_depth=max_depth).render(samples=samples, camera=CAMERA).color
    reference = render_reference(scene, CAMERA, size, samples=1024, max_depth=max_depth)
    assert picture.mean() == pytest.approx(reference.mean(), rel=0.01)
    np.testing.assert_allclose(picture.mean((0, 1)), reference.mean((0, 1)), rtol=0.02)
