"""Sprites, ribbons, bent meshes, mesh particles and landscapes on the GPU."""

import numpy as np
import pytest

import pica
from pica.frame.aovs import motion_of
from pica.frame.context import radical_inverse
from pica.scene.landscape import Landscape
from pica.scene.model import Mesh, Node
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scene.spline import Spline, bend
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from pica.scenes.terrain import fractal_heights
from pica.tracing import embree
from tests.building import RASTER, RAYS, lambert, leaves, orthographic, placed, projected, scene_of, settings, uniform

SIZE = (120, 80)
CAMERA = pica.Camera.look_at((0.5, 2.0, 5.5), (0, 0.6, 0), vertical_fov=np.radians(40))
CURVE = np.array([(-2, 0.3, 0), (-1, 0.5, 1), (0, 0.3, -1), (1, 1, 0), (2, 0.3, 0.5)], float)


class Sprite:
    """Quads about the origin, their node away from it."""

    def __init__(self):
        self.deformer = Sprites(12, lambert(double_sided=True))
        self.deformer.node.transform = move(0.2, 0.1, -0.1) @ rotate("y", 30)
        self.at(0.0)

    def at(self, time):
        rng = np.random.default_rng(1)
        places = rng.uniform((-1.6, 0.2, -1), (1.6, 1.6, 1), (10, 3))
        places += 0.3 * np.sin(time + np.arange(10))[:, None] * (1, 0.5, 0.2)
        sizes = rng.uniform(0.3, 0.7, (10, 2))
        self.deformer.particles = Particles(
            places, sizes, rng.random((10, 4)), time * np.arange(10), np.linspace(0, 1, 10)
        )


class Ribbon:
    def __init__(self):
        self.deformer = Ribbons(3, 12, lambert(double_sided=True))
        self.deformer.node.transform = rotate("z", 10)
        self.at(0.0)

    def at(self, time):
        along = np.linspace(-1.8, 1.8, 12)
        strands = [np.stack([along, 0.4 + 0.5 * i + 0.3 * np.sin(2 * along + time + i), 0.4 * np.cos(along + i)], -1)
                   for i in range(3)]  # fmt: skip
        self.deformer.set(strands, np.linspace(0.2, 0.4, 12), np.linspace(0.2, 1, 48).reshape(12, 4))


class Bent:
    def __init__(self):
        self.deformer = Spline(CURVE)
        bend(Mesh([box((0.5, 0.3, 1), lambert(), 0.05)]), self.deformer, copies=8)

    def at(self, time):
        points = CURVE + 0.3 * np.sin(time + np.arange(5))[:, None] * (0, 1, 0.4)
        self.deformer.set(points, rolls=0.5 * time * np.arange(5) / 4, scales=1 + 0.4 * np.sin(time + np.arange(5)))


class Cloth:
    """A sheet in waves; normals of its own at odd times."""

    def __init__(self):
        node = placed(plane(3, 2, lambert(double_sided=True), 24), move(0.1, 0.6, 0) @ rotate("x", 60))
        self.rest = node.mesh.sections[0].positions
        self.deformer = pica.DynamicVertices(node)

    def at(self, time):
        x, _, z = self.rest.T
        waves = 0.2 * np.sin(3 * x + time) * np.cos(2 * z)
        normals = np.stack([0.1 * x, np.full_like(x, 2.0), -0.1 * z], 1) if time == 0.7 else None
        self.deformer.set(np.stack([x, waves, z + 0.1 * np.sin(time + x)], 1), normals)


KINDS = [Sprite, Ribbon, Bent, Cloth]


def renderer_of(scene, device, size=SIZE, **values):
    return pica.Renderer(scene, size=size, settings=settings(values), device=device)


def gpu_section(renderer, node):
    (part,) = gpu_mesh(renderer, node).sections
    return part


def gpu_mesh(renderer, node):
    """What the renderer's view shows a node by."""
    view = renderer.view
    return view.own.mesh(node) if node.follows_camera else view.scene.placements[node].mesh


def reference(deformer, section, camera):
    """Positions, normals and tangents as the NumPy reference has them for a camera."""
    return deformer.deform(section, *([deformer.eye(camera)] if deformer.node.follows_camera else []))


def gpu_rows(buffer, first, count, width=3, kind=np.float32):
    return buffer.to_numpy().view(kind).reshape(-1, width)[first : first + count]


@pytest.mark.parametrize("kind", KINDS)
def test_vertices_are_where_the_reference_has_them(device, kind):
    shown = kind()
    node = shown.deformer.node
    scene = scene_of(node, environment=uniform(1, 1, 1))
    renderer = renderer_of(scene, device)
    for time, camera in ((0.0, CAMERA), (0.7, CAMERA), (0.7, orthographic((3, 2, 1), (0, 0.6, 0), 4))):
        shown.at(time)
        renderer.advance(camera)
        part, geometry = gpu_section(renderer, node), renderer.view.geometry
        expected, normals, tangents = reference(shown.deformer, part.section, camera)
        found = gpu_rows(geometry.positions, part.first_vertex, len(expected))
        np.testing.assert_allclose(found, expected, atol=2e-6)
        packed = gpu_rows(geometry.vertices, part.first_vertex, len(expected), 8, np.uint32)
        np.testing.assert_allclose(directions(packed[:, 0]), normals, atol=2e-4)
        np.testing.assert_allclose(directions(packed[:, 1] & ~np.uint32(1)), tangents[:, :3], atol=3e-4)


def directions(packed):
    """(n, 3) from octahedral 16-bit pairs."""
    p = np.stack([packed.astype(np.uint16).view(np.int16), (packed >> 16).astype(np.uint16).view(np.int16)], -1) / 32767
    z = 1 - np.abs(p).sum(1)
    folded = (1 - np.abs(p[:, ::-1])) * np.where(p >= 0, 1, -1)
    v = np.column_stack([np.where(z[:, None] < 0, folded, p), z])
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_sprites_carry_colour_and_age(device):
    shown = Sprite()
    renderer = renderer_of(scene_of(shown.deformer.node, environment=uniform(1, 1, 1)), device)
    renderer.advance(CAMERA)
    part = gpu_section(renderer, shown.deformer.node)
    packed = gpu_rows(renderer.view.geometry.vertices, part.first_vertex, 40, 8, np.uint32)
    colors = np.ascontiguousarray(packed[:, 6:8]).view(np.uint16) / 65535
    np.testing.assert_allclose(colors, np.repeat(shown.deformer.particles.colors, 4, axis=0), atol=1e-5)
    np.testing.assert_allclose(packed[:, 4].view(np.float32), np.repeat(np.linspace(0, 1, 10), 4), atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_motion_vectors_are_finite_differences_of_the_reference(device, kind):
    """Time and camera both go on; the same point of the same triangle, one frame before."""
    shown = kind()
    node = shown.deformer.node
    renderer = renderer_of(scene_of(node, environment=uniform(1, 1, 1)), device)
    cameras = CAMERA, pica.Camera.look_at((0.6, 2.05, 5.45), (0.05, 0.6, 0), vertical_fov=np.radians(40))
    seen = []
    for index, camera in enumerate(cameras):
        shown.at(0.1 * index)
        buffers = renderer.advance(camera)
        part = gpu_section(renderer, node)
        world = node.world
        points = reference(shown.deformer, part.section, camera)[0] @ world[:3, :3].T + world[:3, 3]
        seen.append((points, camera))
    (before, camera_before), (after, camera_after) = seen
    motion, visible = motion_of(buffers["motion"].to_numpy()), buffers["visibility"].to_numpy()
    jitter = np.array([radical_inverse(2, 1), radical_inverse(3, 1)])
    errors, rows, columns = [], *np.nonzero(visible[..., 0])
    for row, column in zip(rows, columns, strict=True):
        corners = part.section.indices[visible[row, column, 1]]
        place = np.array([column, row]) + 0.5 + jitter
        weights = weights_at(after[corners], camera_after, place)
        was = projected(camera_before, (weights @ before[corners])[None], SIZE)[0]
        errors.append(np.abs(motion[row, column, :2] - (was - place)).max())
    assert len(errors) > 300 and np.percentile(errors, 99) < 0.05
    assert np.abs(motion[rows, columns, :2]).max() > 0.5


def weights_at(corners, camera, place):
    """(3,) weights of a triangle's corners in space of the point that shows at a place in the picture."""
    a, b, c = corners
    local = (np.array(place) / SIZE * (2, -2) + (-1, 1)) * np.tan(camera.vertical_fov / 2) * (SIZE[0] / SIZE[1], 1)
    ray = camera.transform[:3, :3] @ (*local, -1)
    u, v, _ = np.linalg.solve(np.column_stack([b - a, c - a, -ray]), camera.transform[:3, 3] - a)
    return np.array([1 - u - v, u, v])


def test_a_particle_that_takes_over_a_row_has_not_moved(device):
    sprites = Sprites(2, lambert(double_sided=True))
    bits = Node("bits", mesh=Mesh([box(1.0, lambert())]))

    def show(x, identity):
        for where, target in ((0.4, sprites), (1.4, bits)):
            particles = Particles(np.array([[x, where, 0]]), sizes=[0.6], identities=np.array([identity]))
            if target is sprites:
                sprites.particles = particles
            else:
                particles.place(bits)

    show(-1.0, 7)
    renderer = renderer_of(scene_of(sprites.node, bits, environment=uniform(1, 1, 1)), device)
    motions = []
    for x, identity in ((-1.0, 7), (-0.8, 7), (0.8, 8), (0.8, 8), (0.9, 8)):
        show(x, identity)
        frame = renderer.render(1, camera=CAMERA)
        ids = frame.aov("instance")
        motions.append([np.abs(frame.aov("motion")[ids == number]).max() for number in np.unique(ids[ids > 0])])
    assert all(len(m) == 2 for m in motions)
    moved = np.array(motions) > 0.5
    np.testing.assert_array_equal(moved.any(1), [False, True, False, False, True])
    np.testing.assert_array_equal(moved[:, 0], moved[:, 1])


def test_a_turning_camera_leaves_a_tree_that_refits_and_new_arrays_rebuild_it(device):
    shown = Sprite()
    node = shown.deformer.node
    renderer = renderer_of(scene_of(node, environment=uniform(1, 1, 1)), device)
    renderer.advance(CAMERA)
    (part,) = gpu_mesh(renderer, node).parts
    builds, refits = part.geometry.builds, part.geometry.refits
    renderer.advance(pica.Camera.look_at((1, 2, 5), (0, 0.6, 0), vertical_fov=np.radians(40)))
    assert (part.geometry.builds, part.geometry.refits) == (builds, refits + 1)
    shown.at(0.5)
    renderer.advance(CAMERA)
    assert part.geometry.builds == builds + 1
    for _ in range(3):
        renderer.advance(CAMERA)
    builds, refits = part.geometry.builds, part.geometry.refits
    memory = device.memory
    renderer.advance(CAMERA)
    assert (part.geometry.builds, part.geometry.refits) == (builds, refits), "what stands still costs nothing"
    for step in range(4):
        shown.at(0.1 * step)
        renderer.advance(CAMERA)
    assert device.memory == memory, "no allocation per frame"


def zoo():
    """Everything that changes its geometry, over hills."""
    kinds = [kind() for kind in KINDS]
    kinds[0].deformer.node.mesh.sections[0].material = leaves()
    hills = Landscape(fractal_heights(17, 6, 0.4, seed=2) - 0.8, 0.5, lambert(0.4, 0.6, 0.3), 4, 3, 3.5)
    bits = Node("bits", mesh=Mesh([box(0.2, lambert(0.9, 0.7, 0.1))]))
    Particles(np.random.default_rng(3).uniform(-1.5, 1.5, (12, 3)), rotations=np.arange(12.0)).place(bits)
    return scene_of(*(kind.deformer.node for kind in kinds), hills.node, bits, environment=uniform(1, 0.9, 0.8)), kinds


TRACERS = {
    "raster": RASTER,
    "pipeline": RAYS,
    "buffers": {"visibility.primary": "rays", "rays.scheduler": "buffers", "rays.tracer": "device"},
}
if embree.missing() is None:
    TRACERS["embree"] = {"visibility.primary": "rays", "rays.scheduler": "buffers", "rays.tracer": "embree"}


def test_raster_both_schedulers_and_embree_see_the_same(device):
    pictures = {}
    for name, values in TRACERS.items():
        scene, kinds = zoo()
        renderer = renderer_of(scene, device, **values)
        renderer.render(1, camera=pica.Camera.look_at((-3, 3, 4), (0, 0, 0), vertical_fov=np.radians(45)))
        for kind in kinds:
            kind.at(0.4)
        pictures[name] = renderer.render(1, camera=CAMERA)
    expected = pictures["pipeline"]
    for name, picture in pictures.items():
        same = picture.aov("instance") == expected.aov("instance")
        assert same.mean() > 0.995, name
        shown = same & (expected.aov("instance") > 0)
        close = np.isclose(picture.aov("depth"), expected.aov("depth"), rtol=1e-3)[shown]
        assert close.mean() > 0.995, name
        assert np.percentile(np.abs(picture.aov("motion") - expected.aov("motion"))[shown], 99) < 0.05, name
    assert len(np.unique(expected.aov("instance"))) > 8
    np.testing.assert_array_equal(pictures["buffers"].color, expected.color)


@pytest.mark.parametrize("tracer", TRACERS)
def test_nothing_shows_between_patches_of_different_levels(device, tracer):
    """Steep hills from above, over a plane that shines."""
    heights = fractal_heights(65, 10, 3.0, seed=5)
    hills = Landscape(heights, 0.25, lambert(0.3), patch=8, levels=4, full_detail=1.5)
    glow = placed(plane(40, 40, lambert(0, emission=(100.0, 0.0, 0.0))), move(y=-8))
    scene = scene_of(glow, hills.node, environment=uniform(1, 1, 1))
    renderer = renderer_of(scene, device, (160, 160), **TRACERS[tracer])
    for eye in ((0.3, 3.5, 0.2), (-5, 4, 4)):
        camera = pica.Camera.look_at(eye, (eye[0] * 0.5, 0, eye[2] * 0.5 - 0.01), vertical_fov=np.radians(80))
        for _ in range(2):
            seen = renderer.advance(camera)["visibility"].to_numpy()[..., 0]
            assert len(np.unique(hills.levels_for(camera).levels)) >= 3 and (seen > 0).mean() > 0.9
            rows, columns = np.nonzero(seen == renderer.view.scene.placements[glow].records.start + 1)
            local = np.column_stack([(columns + 0.5) / 80 - 1, 1 - (rows + 0.5) / 80]) * np.tan(camera.vertical_fov / 2)
            rays = np.column_stack([local, -np.ones(len(local))]) @ camera.transform[:3, :3].T
            # Where a ray gets below the lowest place, it must have passed beside the hills.
            below = camera.transform[:3, 3] + rays * ((heights.min() - eye[1]) / rays[:, 1])[:, None]
            assert (np.abs(below[:, [0, 2]]).max(1) > 7.9).all()


def test_a_change_of_level_costs_only_the_patches_that_change(device):
    hills = Landscape(fractal_heights(65, 20, 1.0), 0.5, lambert(), patch=8, levels=3, full_detail=4.0)
    renderer = renderer_of(scene_of(hills.node, environment=uniform(1, 1, 1)), device, (32, 32))
    from_left, from_right = (pica.Camera.look_at((x, 3, 0), (x, 0, 0.1)) for x in (-3.0, -1.0))
    first = renderer.render(1, camera=from_left)
    gpu = renderer.view
    before = {node: gpu.own.mesh(node) for node in hills.node.children}
    uploads = []
    store = gpu.geometry._store
    upload = store._upload
    store._upload = lambda encoder, mesh, *more: (uploads.append(mesh), upload(encoder, mesh, *more))[1]
    renderer.advance(from_left)
    assert not uploads
    renderer.reset()
    second = renderer.render(1, camera=from_right)
    changed = hills.differing(hills.levels_for(from_right), hills.levels_for(from_left))
    assert 0 < len(changed) < len(before)
    assert len(uploads) == len(changed)
    for node in hills.node.children:
        assert (gpu.own.mesh(node) is not before[node]) == (node in changed)
    numbers = np.unique(np.concatenate([first.aov("instance"), second.aov("instance")]))
    assert numbers.max() <= 2 + len(hills.node.children), "a patch keeps its number"
    renderer.reset()
    back = renderer.render(1, camera=from_left)
    np.testing.assert_array_equal(back.aov("depth"), first.aov("depth"))


def test_the_path_tracer_sees_what_the_camera_faces(device):
    scene, _ = zoo()
    traced = pica.PathTracer(scene, size=SIZE, max_depth=2, settings=settings({}), device=device).render(
        1, camera=CAMERA
    )
    frame = renderer_of(scene, device).render(1, camera=CAMERA)
    assert (traced.aov("instance") == frame.aov("instance")).mean() > 0.995
