"""The G-buffer: the same from raster and rays, and right against what is known of simple scenes."""

import numpy as np
import pytest

import pica
from pica.frame.aovs import motion_of
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.material import AlphaMode, Material
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane, sphere, torus
from pica.scenes.placing import at, move, rotate, stretch
from tests.building import (
    CAMERA,
    RASTER,
    RAYS,
    SIZE,
    bumps,
    edges,
    lambert,
    leaves,
    open_cone,
    orthographic,
    placed,
    projected,
    render,
    scene_of,
    settings,
    still_life,
    uniform,
)

WAYS = pytest.mark.parametrize("values", [RASTER, RAYS], ids=["raster", "rays"])


def cones():
    """Single- and double-sided cones, from outside and into them, one mirrored."""
    single, double = lambert(0.2, 0.6, 0.3), lambert(0.7, 0.4, 0.2, double_sided=True)
    tilt = [rotate("x", 110), rotate("x", -60), rotate("z", 100), rotate("x", 160)]
    nodes = [
        placed(open_cone(material), move(x, 0.4 + 0.1 * row, -1.2 * row) @ tilt[index])
        for row, material in enumerate((single, double))
        for index, x in enumerate((-1.5, -0.5, 0.5, 1.5))
    ]
    nodes[1].transform = nodes[1].transform @ stretch(-1, 1, 1)
    return scene_of(*nodes)


def masks():
    """Boards with holes, behind each other; their textures are read point by point."""
    nodes = [
        placed(
            plane(1.6, 1.6, leaves()), move(0.3 * row, 0.6, -0.8 * row) @ rotate("x", 75) @ rotate("y", 10 + 20 * row)
        )
        for row in range(3)
    ]
    return scene_of(*nodes, placed(plane(6, 6, lambert(0.4))))


def glass():
    """Half-transparent planes before a box."""
    material = leaves(AlphaMode.BLEND)
    material.base_color = (0.5, 0.7, 0.9, 0.6)
    nodes = [placed(plane(1.5, 1.5, material), move(0, 0.6, 0.5 * row) @ rotate("x", 80)) for row in range(2)]
    return scene_of(*nodes, placed(box(0.8, lambert(0.8, 0.2, 0.2)), move(0, 0.4, -0.8)))


def bumpy():
    material = Material(base_color=(0.5, 0.6, 0.7, 1), metallic=0.3, roughness=0.4, normal_texture=bumps())
    nodes = [
        placed(torus(0.5, 0.2, material), move(-0.6, 0.5, 0) @ rotate("x", 50)),
        placed(box(0.8, material, 0.1), move(0.7, 0.4, 0) @ rotate("y", 35)),
        placed(sphere(0.4, material), move(0, 0.4, -1.2) @ stretch(1, 0.7, 1)),
    ]
    return scene_of(*nodes, placed(plane(5, 5, lambert(0.5))))


VIEWS = {
    "still life": (still_life, CAMERA),
    "cones": (cones, Camera.look_at((0, 1.2, 3.6), (0, 0.3, -0.3), vertical_fov=np.radians(45))),
    "masks": (masks, CAMERA),
    "blend": (glass, CAMERA),
    "bumpy": (bumpy, CAMERA),
    "orthographic": (still_life, orthographic((1, 2.5, 3), (0, 0.4, 0), 3.0)),
    "cornell": (pica.scenes.cornell, None),
}


@pytest.mark.parametrize("name", VIEWS)
def test_raster_and_rays_agree(device, name):
    """Pixel by pixel away from edges; the third frame, so that the sample lies off the pixel's centre."""
    make, camera = VIEWS[name]
    size = (128, 96)
    # Blended surfaces are in the G-buffer where nothing else shows them.
    more = {"transparency.mode": "off"} if name == "blend" else {}
    raster, rays = (render(device, make(), 3, camera, size, {**values, **more}) for values in (RASTER, RAYS))
    ids = raster.aov("instance")
    inner = ~edges(ids) & ~edges(rays.aov("instance"))
    assert inner.mean() > 0.3 and len(np.unique(ids[inner])) > 2
    different = ids[inner] != rays.aov("instance")[inner]
    # A blended surface is met by chance, the same in both ways; rounding may tip the scale in a few pixels.
    assert different.mean() <= (0.002 if name == "blend" else 0.0)
    same = inner & (ids == rays.aov("instance"))
    np.testing.assert_array_equal(raster.aov("material")[same], rays.aov("material")[same])
    np.testing.assert_allclose(raster.aov("depth")[same], rays.aov("depth")[same], rtol=1e-4)
    np.testing.assert_allclose(raster.aov("motion")[same], rays.aov("motion")[same], atol=1e-3)
    # On a seam between two triangles of one surface the two may take either, whose normals differ a little.
    for aov, tolerance in (("normal", 2e-3), ("geometric_normal", 1e-3), ("albedo", 2e-3), ("roughness", 1e-3)):
        away = np.abs(raster.aov(aov)[same].astype(float) - rays.aov(aov)[same])
        assert (away > tolerance).mean() < 0.002, aov
    assert (ids == rays.aov("instance")).mean() > 0.98


@WAYS
def test_depth_of_a_plane_is_the_distance_along_the_axis(device, values):
    frame = render(device, scene_of(placed(plane(50, 50, lambert()), rotate("x", 90))), 1, front(3.0), values=values)
    np.testing.assert_allclose(frame.aov("depth"), 3.0, rtol=1e-6)


@WAYS
@pytest.mark.parametrize("perspective", [True, False], ids=["perspective", "orthographic"])
def test_depth_of_a_slanted_plane_in_closed_form(device, values, perspective):
    """The floor y = 0 seen from above: the ray through each pixel centre meets it at a known distance."""
    camera = (
        Camera.look_at((0, 2, 3), (0, 0, -1), vertical_fov=np.radians(40))
        if perspective
        else orthographic((0, 2, 3), (0, 0, -1), 2.5)
    )
    frame = render(device, scene_of(placed(plane(200, 200, lambert()))), 1, camera, values=values)
    origins, directions = pixel_rays(camera, SIZE)
    distance = -origins[..., 1] / directions[..., 1]
    depth = distance * (directions @ -camera.transform[:3, 2])
    assert (distance > 0).all()
    np.testing.assert_allclose(frame.aov("depth"), depth, rtol=2e-5)


def front(distance, **more):
    return Camera.look_at((0, 0, distance), (0, 0, 0), **more)


def pixel_rays(camera, size):
    """Origins and unit directions through the pixel centres, (height, width, 3) each."""
    width, height = size
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    flat = camera.orthographic_height is not None
    half = camera.orthographic_height / 2 if flat else np.tan(camera.vertical_fov / 2)
    right, up, back, eye = camera.transform[:3, :4].T
    offset = x[..., None] * right * half * width / height + y[..., None] * up * half
    directions = np.broadcast_to(-back, offset.shape) if flat else offset - back
    return eye + (offset if flat else 0), directions / np.linalg.norm(directions, axis=-1, keepdims=True)


@WAYS
def test_near_plane_cuts(device, values):
    """What lies before the near plane along the axis is not seen, towards the corners as little as in the middle."""
    near_wall = placed(plane(20, 20, lambert(0.9)), move(0, 0, -1) @ rotate("x", 90))
    far_wall = placed(plane(50, 50, lambert(0.1)), move(0, 0, -3) @ rotate("x", 90))
    scene = scene_of(near_wall, far_wall)
    for near, seen in ((0.99, 1), (1.01, 2)):
        camera = Camera.look_at((0, 0, 0), (0, 0, -1), vertical_fov=np.radians(90), near=near)
        assert (render(device, scene, 1, camera, values=values).aov("instance") == seen).all()


@WAYS
def test_far_plane_of_an_orthographic_camera_cuts(device, values):
    wall = placed(plane(50, 50, lambert()), rotate("x", 90))
    for far, seen in ((3.01, 1), (2.99, 0)):
        camera = orthographic((0, 0, 3), (0, 0, 0), 2.0, far=far)
        assert (render(device, scene_of(wall), 1, camera, values=values).aov("instance") == seen).all()


@WAYS
def test_normals_and_depth_of_a_sphere(device, values):
    camera = front(4.0, vertical_fov=np.radians(40))
    frame = render(device, scene_of(placed(sphere(1, lambert(), 128))), 1, camera, (96, 96), values)
    origins, directions = pixel_rays(camera, (96, 96))
    along = -np.sum(origins * directions, -1)
    square = 1 - (np.sum(origins * origins, -1) - along**2)
    inside = square > 0.02
    distance = along - np.sqrt(np.where(inside, square, 0))
    points = origins + distance[..., None] * directions
    np.testing.assert_allclose(frame.aov("normal")[inside], points[inside], atol=6e-3)
    depth = distance * (directions @ -camera.transform[:3, 2])
    np.testing.assert_allclose(frame.aov("depth")[inside], depth[inside], atol=5e-3)
    outside = square < -0.02
    assert np.isinf(frame.aov("depth")[outside]).all() and not frame.aov("normal")[outside].any()


@WAYS
def test_ids_and_material_values(device, values):
    materials = [
        Material("a", base_color=(0.1, 0.5, 0.9, 1), metallic=0.0, roughness=0.25),
        Material("b", base_color=(0.8, 0.3, 0.2, 1), metallic=1.0, roughness=0.75, emission=(2.0, 0.5, 0.25)),
    ]
    empty = Node("empty")
    left, right = (
        placed(plane(2, 10, material), move(x, 0, 0) @ rotate("x", 90))
        for material, x in zip(materials, (-1, 1), strict=False)
    )
    scene = scene_of(empty, left, right)
    frame = render(device, scene, 1, orthographic((0, 0, 5), (0, 0, 0), 4.0, near=0.1), (64, 64), values)
    left_half = np.s_[:, 2:30]
    right_half = np.s_[:, 34:62]
    assert (frame.aov("instance")[left_half] == 2).all() and (frame.aov("instance")[right_half] == 3).all()
    for half, material in ((left_half, materials[0]), (right_half, materials[1])):
        number = np.unique(frame.aov("material")[half])
        assert len(number) == 1 and number[0] > 0
        expected = {
            "albedo": material.base_color[:3],
            "metallic": material.metallic,
            "roughness": material.roughness,
            "emission": material.emission,
            "normal": (0, 0, 1),
            "geometric_normal": (0, 0, 1),
            "motion": (0, 0),
            "depth": 5.0,
        }
        for name, value in expected.items():
            found = frame.aov(name)[half]
            np.testing.assert_allclose(found, np.broadcast_to(value, found.shape), atol=3e-3, err_msg=name)
    assert not np.array_equal(frame.aov("material")[left_half][0, 0], frame.aov("material")[right_half][0, 0])


@WAYS
def test_vertex_colours_multiply(device, values):
    wall = plane(2, 2, lambert(0.5, 1, 1))
    wall.colors = np.where(wall.positions[:, :1] < 0, (1, 0, 0.5, 1), (1, 1, 0.5, 1)).astype(np.float32)
    albedo = render(
        device, scene_of(placed(wall, rotate("x", 90))), 1, orthographic((0, 0, 2), (0, 0, 0), 2.0), (64, 64), values
    ).aov("albedo")
    np.testing.assert_allclose(albedo[..., 0], 0.5, atol=1e-3)
    np.testing.assert_allclose(albedo[..., 1], np.tile((np.arange(64) + 0.5) / 64, (64, 1)), atol=1e-3)
    np.testing.assert_allclose(albedo[..., 2], 0.5, atol=1e-3)


@WAYS
def test_backs_of_single_sided_surfaces_are_not_seen(device, values):
    away = rotate("x", -90)
    behind = placed(plane(50, 50, lambert(0.3)), move(0, 0, -2) @ rotate("x", 90))
    for double_sided, mirrored, expected in ((False, False, 2), (True, False, 1), (False, True, 2)):
        wall = placed(plane(50, 50, lambert(double_sided=double_sided)), away @ stretch(-1 if mirrored else 1, 1, 1))
        frame = render(device, scene_of(wall, behind), 1, front(3.0), values=values)
        assert (frame.aov("instance") == expected).all()
        np.testing.assert_allclose(frame.aov("normal"), np.broadcast_to([0, 0, 1], (*SIZE[::-1], 3)), atol=1e-4)


@WAYS
def test_mask_covers_half_of_a_board(device, values):
    frame = render(
        device, scene_of(placed(plane(2, 2, leaves()), rotate("x", 90))), 1, orthographic((0, 0, 2), (0, 0, 0), 2.0),
        (64, 64), values,
    )  # fmt: skip
    solid = np.kron(np.indices((4, 4)).sum(0) % 2, np.ones((16, 16), int)) == 1
    np.testing.assert_array_equal(frame.aov("instance") == 1, solid)


@WAYS
def test_blend_covers_a_share_of_the_frames(device, values):
    material = lambert(alpha_mode=AlphaMode.BLEND)
    material.base_color = (1, 1, 1, 0.25)
    scene = scene_of(placed(plane(9, 9, material), rotate("x", 90)))
    alone = settings({**values, "transparency.mode": "off"})
    renderer = pica.Renderer(scene, size=(64, 64), settings=alone, device=device)
    covered = [(renderer.render(1, camera=front(2.0)).aov("instance") == 1).mean() for _ in range(4)]
    assert np.mean(covered) == pytest.approx(0.25, abs=0.015)
    assert len(set(covered)) > 1, "another frame, other pixels"


def frames_of_a_move(device, scene, values, before, after, change=lambda: None):
    """The second of two frames, with the jitter of both at the pixel centre."""
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    renderer.render(1, camera=before)
    change()
    return renderer.render(1, camera=after)


def expected_motion(frame, camera, before, place_before=None):
    """(height, width, 2) pixels to where the seen points were, from depth; `place_before` moves points back."""
    origins, directions = pixel_rays_at(camera, sample_positions(SIZE, 1))
    points = origins + directions * frame.aov("depth")[..., None] / (directions @ -camera.transform[:3, 2])[..., None]
    if place_before is not None:
        points = np.einsum("ij,yxj->yxi", place_before[:3, :3], points) + place_before[:3, 3]
    found = projected(before, points.reshape(-1, 3), SIZE).reshape(*points.shape[:2], 2)
    return found - sample_positions(SIZE, 1)


def sample_positions(size, index):
    """(height, width, 2) where frame `index` looks for each pixel."""
    from pica.frame.context import radical_inverse

    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    return np.stack([x + 0.5 + radical_inverse(2, index), y + 0.5 + radical_inverse(3, index)], -1)


def pixel_rays_at(camera, positions):
    width, height = SIZE
    ndc = positions / (width, height) * 2 - 1
    flat = camera.orthographic_height is not None
    half = camera.orthographic_height / 2 if flat else np.tan(camera.vertical_fov / 2)
    right, up, back, eye = camera.transform[:3, :4].T
    offset = ndc[..., :1] * right * half * width / height - ndc[..., 1:] * up * half
    directions = np.broadcast_to(-back, offset.shape) if flat else offset - back
    return eye + (offset if flat else 0), directions / np.linalg.norm(directions, axis=-1, keepdims=True)


CAMERAS = {
    "travel": (Camera.look_at((0.2, 1.4, 3.5), (0, 0.4, 0)), Camera.look_at((0.5, 1.5, 3.3), (0.3, 0.5, -0.2))),
    "turn": (Camera.look_at((0.2, 1.4, 3.5), (0, 0.4, 0)), Camera.look_at((0.2, 1.4, 3.5), (0.4, 0.3, 0))),
    "zoom": (
        Camera.look_at((0.2, 1.4, 3.5), (0, 0.4, 0), vertical_fov=np.radians(45)),
        Camera.look_at((0.2, 1.4, 3.5), (0, 0.4, 0), vertical_fov=np.radians(41)),
    ),
    "orthographic": (orthographic((0, 2, 3), (0, 0.3, 0), 3.0), orthographic((0.3, 2.2, 3), (0.2, 0.3, 0), 3.1)),
}


@WAYS
@pytest.mark.parametrize("name", CAMERAS)
def test_motion_of_a_moving_camera(device, values, name):
    before, camera = CAMERAS[name]
    scene = scene_of(placed(plane(9, 9, lambert())), placed(box(1, lambert(0.9)), move(0, 0.5, 0) @ rotate("y", 30)))
    frame = frames_of_a_move(device, scene, values, before, camera)
    seen = frame.aov("instance") > 0
    expected = expected_motion(frame, camera, before)
    assert seen.mean() > 0.5 and np.abs(expected[seen]).max() > 1
    assert np.abs(frame.aov("motion") - expected)[seen].max() < 0.02


@WAYS
def test_motion_of_a_moving_object(device, values):
    scene = scene_of(placed(plane(9, 9, lambert())), placed(box(1, lambert(0.9)), move(0, 0.5, 0) @ rotate("y", 30)))
    node = list(scene.nodes())[1]
    old, new = node.transform, move(0.2, 0.6, 0.1) @ rotate("y", 42) @ stretch(1, 1.1, 1)

    def change():
        node.transform = new

    frame = frames_of_a_move(device, scene, values, CAMERA, CAMERA, change)
    seen = frame.aov("instance") == 2
    expected = expected_motion(frame, CAMERA, CAMERA, old @ np.linalg.inv(new))
    assert seen.sum() > 200 and np.abs(expected[seen]).max() > 2
    assert np.abs(frame.aov("motion") - expected)[seen].max() < 0.02
    np.testing.assert_allclose(frame.aov("motion")[frame.aov("instance") == 1], 0, atol=1e-3)


@WAYS
def test_motion_ends_when_the_object_stops(device, values):
    scene = scene_of(placed(box(1, lambert())))
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    renderer.render(1, camera=CAMERA)
    next(scene.nodes()).transform = move(0.3, 0, 0)
    assert np.abs(renderer.render(1, camera=CAMERA).aov("motion")).max() > 1
    np.testing.assert_allclose(renderer.render(1, camera=CAMERA).aov("motion"), 0, atol=1e-3)


@WAYS
@pytest.mark.parametrize("name", ["travel", "turn", "zoom"])
def test_motion_of_the_surroundings(device, values, name):
    """They are infinitely far: only turning and zooming move them."""
    before, camera = CAMERAS[name]
    if name == "travel":
        transform = camera.transform.copy()
        transform[:3, :3] = before.transform[:3, :3]
        camera = Camera(transform, vertical_fov=before.vertical_fov)
    frame = frames_of_a_move(device, scene_of(environment=uniform(1)), values, before, camera)
    _, directions = pixel_rays_at(camera, sample_positions(SIZE, 1))
    expected = projected(before, (before.transform[:3, 3] + directions).reshape(-1, 3), SIZE).reshape(*SIZE[::-1], 2)
    expected -= sample_positions(SIZE, 1)
    assert np.abs(frame.aov("motion") - expected).max() < 0.02
    assert (np.abs(expected).max() > 1) == (name != "travel")


@WAYS
@pytest.mark.parametrize("name", ["rest", "travel", "turn", "zoom"])
def test_surroundings_of_an_orthographic_camera_do_not_move(device, values, name):
    """It sees one direction of them in all its pixels; another one when it turns, which has no motion."""
    before = orthographic((0, 2, 3), (0, 0.3, 0), 3.0)
    camera = {
        "rest": before,
        "travel": orthographic((0.5, 2.2, 3.1), (0.5, 0.5, 0.1), 3.0),
        "turn": orthographic((0, 2, 3), (0.2, 0.3, 0), 3.0),
        "zoom": orthographic((0, 2, 3), (0, 0.3, 0), 2.5),
    }[name]
    renderer = pica.Renderer(scene_of(environment=uniform(1)), size=SIZE, settings=settings(values), device=device)
    renderer.advance(before)
    motion = motion_of(renderer.advance(camera)["motion"].to_numpy())
    np.testing.assert_array_equal(motion[..., :2], 0)
    assert (np.isnan(motion[..., 2]) == (name == "turn")).all(), "no history is its own"


@WAYS
def test_depth_change(device, values):
    """The third channel of the motion texture: metres along the axis to where the surface was."""
    scene = scene_of(placed(plane(50, 50, lambert()), rotate("x", 90)))
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    renderer.advance(front(3.0))
    motion = motion_of(renderer.advance(front(2.75))["motion"].to_numpy())
    np.testing.assert_allclose(motion[..., 2], 0.25, atol=1e-4)


def test_first_frame_has_no_motion(device):
    frame = render(device, still_life(), 1, CAMERA)
    np.testing.assert_allclose(frame.aov("motion"), 0, atol=1e-3)


def test_auto_rasterizes_on_the_cpu_and_traces_on_gpus(device):
    frame = render(device, scene_of(placed(box(1, lambert()))))
    assert ("raster" in frame.timings) == device.is_software
    assert ("primary_rays" in frame.timings) != device.is_software


@WAYS
def test_unlit_shows_its_colour_in_any_light(device, values):
    from tests.building import shining

    wall = placed(plane(50, 50, lambert(0.8, 0.4, 0.2, unlit=True)), rotate("x", 90))
    scene = scene_of(wall, shining(DirectionalLight(illuminance=100)), environment=uniform(9))
    frame = render(device, scene, 2, front(2.0), values=values)
    np.testing.assert_allclose(frame.color, np.broadcast_to([0.8, 0.4, 0.2], frame.color.shape), rtol=1e-3)


def test_sections_placed_by_hand_look_like_nodes(device):
    """The same triangles moved by NumPy and by the node's matrix."""
    section = torus(0.4, 0.15, lambert(0.7))
    place = move(0.2, 0.5, 0) @ rotate("x", 60) @ stretch(1.2, 1.2, 1.2)
    by_node, by_hand = (
        render(device, scene_of(node), 1, CAMERA) for node in (placed(section, place), placed(at(section, place)))
    )
    inner = ~edges(by_hand.aov("instance"))
    np.testing.assert_allclose(by_node.aov("depth")[inner], by_hand.aov("depth")[inner], rtol=1e-4)
    assert np.quantile(np.abs(by_node.aov("normal") - by_hand.aov("normal"))[inner], 0.99) < 2e-3
