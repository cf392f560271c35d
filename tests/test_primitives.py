"""Primitives that are not triangles: rays, raster, schedulers, materials, motion, against closed forms and meshes."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.errors import SceneError, ShapeError
from pica.programs.material_types import STANDARD_ONLY
from pica.programs.shape_types import modules_for, shapes_of
from pica.quality.metrics import flip
from pica.scene import shape_registry as shape_types
from pica.scene.camera import Camera
from pica.scene.material import AlphaMode, Texture
from pica.scene.primitives import Primitives, capsules, rounded_boxes, spheres, tori
from pica.scenes.placing import move, rotate, stretch
from tests.building import (
    CAMERA,
    RASTER,
    RAYS,
    assert_schedulers_agree,
    bumps,
    checkered,
    edges,
    lambert,
    leaves,
    orthographic,
    placed,
    render,
    scene_of,
    settings,
    trace,
)
from tests.primitive_scenes import BALL, RADIUS, all_four, first_crossings, lit, meshes, primitives_node, textured
from tests.rays import CAMERA as FROM_CAMERA
from tests.rays import SHADOW, SURFACE, RayCaster

RASTER_ALONE = {**RASTER, "rays.scheduler": "pipeline"}
MIDDLE = (0.1, 0.4, 0.0)
SLANTED = {
    "plain": np.eye(4),
    "stretched": move(0.2, 0.1, 0) @ rotate("y", 30) @ stretch(1.3, 0.8, 1),
    "mirrored": rotate("x", 20) @ stretch(-1, 1, 0.7),
}


@pytest.fixture(autouse=True)
def fresh_registry(monkeypatch):
    monkeypatch.setattr(shape_types, "_registered", {})


@pytest.fixture
def gyroid(request):
    pica.register_shape("gyroid", request.config.rootpath / "tests/shapes/gyroid.slang")
    parameters = {"scale": [9.0], "thickness": [0.06], "radius": [0.8]}
    return Primitives("gyroid", parameters, [[[-0.81] * 3, [0.81] * 3]], lambert(0.7, 0.4, 0.3))


def rays_at(count: int, distance: float = 5.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    outwards = random.normal(size=(count, 3))
    origins = np.array(MIDDLE) + distance * outwards / np.linalg.norm(outwards, axis=1, keepdims=True)
    directions = MIDDLE + random.uniform(-1, 1, (count, 3)) * (1.6, 0.7, 1) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize("name", SLANTED)
def test_rays_meet_the_shapes_where_they_are(device, name):
    """Against sphere tracing in float64, under transforms that keep neither lengths nor angles."""
    world = SLANTED[name]
    cast = RayCaster(device, scene_of(primitives_node(transform=world)))
    local_origins, local_directions = rays_at(3000)
    expected = first_crossings(local_origins, local_directions)
    directions = local_directions @ world[:3, :3].T
    lengths = np.linalg.norm(directions, axis=1)
    origins = local_origins @ world[:3, :3].T + world[:3, 3]
    for kind in (FROM_CAMERA, SURFACE):
        hits = cast(origins, directions / lengths[:, None], kind)
        found = np.where(hits["distance"] < 0, np.inf, hits["distance"] / lengths)
        same = np.isfinite(found) == np.isfinite(expected)
        assert same.mean() > 0.998 and 0.3 < np.isfinite(expected).mean() < 0.95, "but for rays that graze"
        both = np.isfinite(found) & np.isfinite(expected)
        close = np.isclose(found[both], expected[both], rtol=0, atol=2e-4)
        assert close.mean() > 0.998
        assert np.median(np.abs(found[both] - expected[both])) < 2e-6
    shadows = cast(origins, directions / lengths[:, None], SHADOW)["distance"] >= 0
    assert (shadows == np.isfinite(expected)).mean() > 0.998


def test_spheres_in_closed_form(device):
    """A thousand spheres of one section, far away and near: each ray names its own."""
    places = np.stack(np.meshgrid(np.arange(40.0), np.arange(25.0)), -1).reshape(-1, 2)
    centers = np.stack([places[:, 0], np.zeros(1000), places[:, 1]], -1)
    radii = 0.1 + 0.0003 * np.arange(1000)
    cast = RayCaster(device, scene_of(primitives_node([spheres(centers, radii, lambert())])))
    off = radii * 0.6
    hits = cast(centers + np.stack([off, np.full(1000, 50.0), np.zeros(1000)], -1), (0.0, -1.0, 0.0))
    np.testing.assert_array_equal(hits["primitive"], np.arange(1000))
    np.testing.assert_allclose(hits["distance"], 50 - 0.8 * radii, atol=1e-5)
    np.testing.assert_array_equal(hits["record"], 0)


def test_camera_rays_alone_pass_through_backs(device):
    single = spheres([(0, 0, 0)], 1.0, lambert())
    double = spheres([(5, 0, 0)], 1.0, lambert(double_sided=True))
    cast = RayCaster(device, scene_of(primitives_node([single, double])))
    for kind in (FROM_CAMERA, SURFACE, SHADOW):
        inside = cast([(0, 0, 0), (5, 0, 0)], (0.0, 1.0, 0.0), kind)["distance"] >= 0
        assert inside.tolist() == [kind != FROM_CAMERA, True]
        assert (cast([(0, 0, 3), (5, 0, 3)], (0.0, 0.0, -1.0), kind)["distance"] >= 0).all()


def test_rays_keep_to_their_length(device):
    cast = RayCaster(device, scene_of(primitives_node([spheres([(0, 0, 0)], 1.0, lambert())])))
    for maximum, minimum, expected in ((1.99, 0, -1), (2.01, 0, 2), (9, 2.01, 4), (3.99, 2.01, -1), (-1, 0, -1)):
        distance = cast((0, 0, 3), (0.0, 0.0, -1.0), minimum=minimum, maximum=maximum)["distance"]
        np.testing.assert_allclose(distance, expected, rtol=1e-6)


def opaque() -> pica.Scene:
    copies = primitives_node(transform=stretch(-0.5, 0.5, 0.4), name="copies")
    copies.instances = np.stack([move(-2.4, 0.1, 1.4), move(-0.2, 0.0, 2.8) @ rotate("y", 70)])
    return lit(primitives_node(), copies)


def holes() -> pica.Scene:
    return lit(primitives_node(all_four(lambda *_: leaves())))


def blended() -> pica.Scene:
    glass = lambert(0.8, 0.6, 0.4, alpha_mode=AlphaMode.BLEND)
    glass.base_color = (0.8, 0.6, 0.4, 0.5)
    return lit(primitives_node(all_four(lambda *_: glass)))


INSIDE = Camera.look_at(tuple(BALL + 0.49), (0.3, 0.3, 0))
"""In the ball's box, outside of the ball."""
VIEWS = {
    "opaque": (opaque, CAMERA),
    "holes": (holes, CAMERA),
    "blended": (blended, CAMERA),
    "orthographic": (opaque, orthographic((1, 2.5, 3), (0, 0.4, 0), 3.0)),
    "in a box": (opaque, INSIDE),
}


@pytest.mark.parametrize("name", VIEWS)
def test_raster_and_rays_agree(device, name):
    make, camera = VIEWS[name]
    raster, rays = (render(device, make(), 3, camera, (128, 96), values) for values in (RASTER_ALONE, RAYS))
    materials = raster.aov("material")
    inner = ~edges(materials) & ~edges(rays.aov("material"))
    assert len(np.unique(materials)) >= (2 if name == "in a box" else 3)
    if name in ("opaque", "orthographic", "in a box"):
        assert (materials[inner] == rays.aov("material")[inner]).all()
    same = materials == rays.aov("material")
    assert same.mean() > 0.99
    same &= np.isfinite(raster.aov("depth"))
    for aov, tolerance in (("depth", 1e-3), ("normal", 3e-3), ("albedo", 3e-3), ("motion", 1e-3)):
        away = np.abs(raster.aov(aov)[same].astype(float) - rays.aov(aov)[same])
        assert (away > tolerance).mean() < 0.004, aov
    assert np.abs(raster.color - rays.color).mean() < 0.02 * rays.color.mean()


@pytest.mark.slow
@pytest.mark.parametrize("make", [opaque, holes, blended])
def test_schedulers_agree_to_the_bit(device, make):
    assert_schedulers_agree(device, make)


def test_shapes_look_like_fine_meshes(device):
    """Depth, normals and direct light of the same four shapes made of triangles."""
    ours = render(device, lit(primitives_node()), 8, CAMERA, (128, 96), RAYS)
    theirs = render(device, lit(*meshes()), 8, CAMERA, (128, 96), RAYS)
    solid = ours.aov("material") > 0
    assert (solid == (theirs.aov("material") > 0)).mean() > 0.998
    inner = ~edges(ours.aov("material")) & ~edges(theirs.aov("material"))
    np.testing.assert_allclose(ours.aov("depth")[inner], theirs.aov("depth")[inner], atol=0.01)
    assert np.abs(ours.aov("normal")[inner] - theirs.aov("normal")[inner]).mean() < 2e-3
    assert flip(theirs.color, ours.color)[0] < 0.02


def test_textures_and_normal_maps_lie_as_on_meshes(device):
    """Sphere and ring, whose texture coordinates have the same meaning on both."""
    make = textured(Texture(checkered(255, 8)), bumps())
    ours = [p for p in all_four(make) if p.shape in ("sphere", "torus")]
    theirs = [meshes(make)[index] for index in (0, 2)]
    for transform in (np.eye(4), stretch(-1, 1, 1)):
        for node in theirs:
            node.transform = transform @ node.transform
        frames = [
            render(device, scene, 1, CAMERA, (192, 128), RAYS)
            for scene in (lit(primitives_node(ours, transform)), lit(*theirs))
        ]
        inner = ~edges(frames[0].aov("material")) & (frames[0].aov("material") > 1)
        assert inner.sum() > 1000
        for name, mean in (("albedo", 0.01), ("normal", 0.02)):
            first, second = (frame.aov(name)[inner].astype(float) for frame in frames)
            assert first.std() > 0.05
            assert np.abs(first - second).mean() < mean, name


def test_path_tracer_and_hybrid_agree(device):
    hybrid = render(device, opaque(), 64, CAMERA, (48, 32), RAYS).color
    traced = trace(device, opaque(), 64, CAMERA, (48, 32), max_depth=2, values=RAYS).color
    np.testing.assert_allclose(hybrid.mean(axis=(0, 1)) / traced.mean(axis=(0, 1)), 1, atol=0.03)


def test_path_traced_light_is_that_of_meshes(device):
    """Many bounces: nothing leaks in or is caught by the surface that it leaves."""
    ours, theirs = (
        trace(device, lit(*nodes), 64, CAMERA, (48, 32), values=RAYS).color for nodes in ([primitives_node()], meshes())
    )
    np.testing.assert_allclose(ours.mean(axis=(0, 1)) / theirs.mean(axis=(0, 1)), 1, atol=0.02)


@pytest.mark.parametrize("values", [RASTER_ALONE, RAYS], ids=["raster", "rays"])
def test_motion_of_a_moving_primitive(device, values):
    """A ball that moves across the view: every pixel of it by as much as a mesh in its place."""
    frames = []
    for nodes in ([primitives_node()], meshes()):
        scene = lit(*nodes)
        renderer = pica.Renderer(scene, size=(96, 64), settings=settings(values), device=device)
        renderer.render(1, camera=CAMERA)
        for node in nodes:
            node.transform = move(0.1, 0.05, 0) @ node.transform
        frames.append(renderer.render(1, camera=CAMERA))
    ours, theirs = frames
    moving = (ours.aov("material") > 1) & (theirs.aov("material") > 1) & ~edges(ours.aov("material"))
    assert moving.sum() > 200 and np.abs(ours.aov("motion")[moving]).max() > 1
    np.testing.assert_allclose(ours.aov("motion")[moving], theirs.aov("motion")[moving], atol=0.02)


@pytest.mark.slow
def test_primitives_come_and_go(device):
    """With the settings as they come: Embree's rays, where it is installed, give way and come back."""
    scene = lit(placed_ball := meshes()[0])
    renderer = pica.Renderer(scene, size=(48, 32), device=device)
    before = renderer.render(2, camera=CAMERA)
    node = scene.add(primitives_node(transform=move(0.5, 0, 0)))
    renderer.reset()
    among = renderer.render(2, camera=CAMERA)
    assert (among.aov("instance") == 4).sum() > 50
    fresh = pica.Renderer(scene, size=(48, 32), device=device).render(2, camera=CAMERA)
    np.testing.assert_allclose(among.color, fresh.color, atol=1e-4)
    scene.remove(node)
    renderer.reset()
    after = renderer.render(2, camera=CAMERA)
    np.testing.assert_allclose(after.color, before.color, atol=1e-5)
    assert placed_ball in scene.roots


def test_scenes_without_primitives_are_not_told_of_them(device):
    assert modules_for(device, STANDARD_ONLY) == []
    assert not shapes_of(RayCaster(device, lit()).scene.material_types)
    only = RayCaster(device, scene_of(primitives_node([spheres([BALL], RADIUS, lambert())]))).scene
    assert [type_in_use.name for type_in_use in only.material_types] == ["standard", "sphere/standard"]


def test_a_shape_of_ones_own(device, gyroid):
    """Raster and rays see the same; what is seen lies on the surface."""
    scene = scene_of(primitives_node([gyroid]))
    camera = Camera.look_at((0, 0.5, 3), (0, 0, 0), vertical_fov=np.radians(32))
    raster, rays = (render(device, scene, 1, camera, (96, 96), values) for values in (RASTER_ALONE, RAYS))
    inner = ~edges(raster.aov("material")) & ~edges(rays.aov("material")) & (rays.aov("material") > 0)
    assert inner.sum() > 1000 and (raster.aov("material")[inner] == 1).all()
    assert (np.abs(raster.aov("depth")[inner] - rays.aov("depth")[inner]) > 1e-3).mean() < 0.01
    cast = RayCaster(device, scene)
    origins, directions = rays_at(2000, 3.0)
    hits = cast(origins, directions)
    met = hits["distance"] > 0
    place = (origins + directions * hits["distance"][:, None])[met]
    q = 9 * place
    sheet = np.abs((np.sin(q) * np.cos(np.roll(q, -1, axis=1))).sum(1)) / 16.2 - 0.03
    assert met.mean() > 0.2
    assert np.abs(np.maximum(sheet, np.linalg.norm(place, axis=1) - 0.8)).max() < 1e-4


def test_bounds_of_the_scene(device):
    low, high = scene_of(primitives_node([spheres([(1, 2, 3)], 0.5, lambert())], move(1, 0, 0))).bounds()
    np.testing.assert_allclose([low, high], [[1.5, 1.5, 2.5], [2.5, 2.5, 3.5]], atol=1e-5)


def test_shining_primitives_warn(device):
    glowing = spheres([BALL], RADIUS, lambert(emission=(1.0, 1.0, 1.0)))
    with pytest.warns(UserWarning, match="'sphere' shine, but light is not sampled from them"):
        frame = trace(device, scene_of(primitives_node([glowing])), 1, CAMERA, (32, 32), values=RAYS)
    assert frame.color.max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda m: spheres([1, 2, 3], 1, m), r"'sphere': places are \(3,\), not \(count, 3\)"),
        (lambda m: spheres([(1, 2, 3)], [1, 2], m), r"'sphere': \(2,\) radii for 1 places"),
        (lambda m: spheres([(1, 2, 3)], -1, m), "'sphere': a radius is negative or not a number"),
        (lambda m: capsules([(1, 2, 3)], [(1, 2, 3)] * 2, 1, m), "'capsule': 1 starts, but 2 ends"),
        (lambda m: tori([(1, 2, 3)], 1, float("nan"), m), "'torus': a radius is negative or not a number"),
        (lambda m: rounded_boxes([(1, 2, 3)], (1, 1, 1), 0.6, m), "'rounded_box': a radius is larger than half"),
        (lambda m: Primitives("sphere", {}, np.zeros((3, 2)), m), r"'sphere': bounds are \(3, 2\)"),
        (lambda m: Primitives("sphere", {}, [[[1, 0, 0], [0, 0, 0]]], m), "'sphere': bounds are not finite, or low"),
        (lambda m: Primitives("sphere", {"a": [1, 2]}, np.zeros((1, 2, 3)), m), r"parameter 'a' is \(2,\), but there"),
    ],
)
def test_arrays_must_fit(make, fault):
    with pytest.raises(SceneError, match=fault):
        make(lambert())


def shown(device, primitives: Primitives) -> str:
    with pytest.raises(ShapeError) as caught:
        pica.Renderer(scene_of(primitives_node([primitives])), size=(8, 8), device=device)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_parameters_must_be_the_shapes(device):
    ball = spheres([BALL], RADIUS, lambert())
    assert "'blob' is not registered; there are sphere, capsule" in shown(device, replace(ball, shape="blob"))
    assert "lack ['radius']" in shown(device, replace(ball, parameters={"center": [BALL]}))
    assert "have no ['size']" in shown(device, replace(ball, parameters={**ball.parameters, "size": [1]}))
    wrong = replace(ball, parameters={"center": [1.0], "radius": [1.0]})
    assert "parameter 'center' is (1,), but must be (1, 3)" in shown(device, wrong)


def test_registering_says_what_is_wrong(device, tmp_path):
    path = tmp_path / "faulty.slang"
    path.write_text("float one() { return 1; }")
    with pytest.raises(ShapeError, match="'sphere': the name is taken by pica itself"):
        pica.register_shape("sphere", path)
    with pytest.raises(ShapeError, match=r"nothing\.slang: No such file"):
        pica.register_shape("nothing", tmp_path / "nothing.slang")
    pica.register_shape("faulty", path)
    faulty = Primitives("faulty", {}, np.zeros((1, 2, 3)), lambert())
    assert "faulty.slang: no struct implements IShape or ISignedDistance" in shown(device, faulty)


def test_skinned_or_morphed_primitives_are_an_error(device):
    ball = meshes()[0].mesh.sections[0]
    node = placed(replace(ball, morph_positions=ball.positions[None]))
    node.weights = [0.5]
    node.mesh.primitives = all_four()
    with pytest.raises(SceneError, match="has primitives, which cannot be skinned or morphed"):
        pica.Renderer(scene_of(node), size=(8, 8), device=device)
