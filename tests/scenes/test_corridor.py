"""The lift lobby: what there is, and how it moves."""

import numpy as np
import pytest

import pica
from pica.scene.light import RectangleLight
from pica.scenes.figure_motion import bent_leg
from pica.scenes.figures import ANKLE, SHIN, THIGH
from pica.scenes.motion import LOOP, turned

FIGURES = ("officer", "white guard", "bronze guard")


@pytest.fixture(scope="module")
def lobby():
    return pica.scenes.corridor()


@pytest.fixture(scope="module")
def motion(lobby):
    """(times, nodes, 4, 4) where everything is, 30 times a second, and the rows by the names below the lobby."""
    nodes, names = zip(*named(lobby.roots[0]), strict=True)
    found = []
    for time in np.linspace(0, LOOP, 721):
        lobby.animate(time)
        found.append([node.world for node in nodes])
    return np.array(found), {name: row for row, name in enumerate(names)}


def named(root, above=""):
    """Each node below with the names on the way to it."""
    for child in root.children:
        yield child, above + child.name
        yield from named(child, f"{above}{child.name}/")


def triangles(root, without=()):
    """(count, 3, 3) in the world."""
    if root.name in without:
        return np.zeros((0, 3, 3))
    own = [s.positions[s.indices] for s in root.mesh.sections] if root.mesh else []
    parts = [part @ root.world[:3, :3].T + root.world[:3, 3] for part in own]
    return np.concatenate([np.zeros((0, 3, 3)), *parts, *(triangles(child, without) for child in root.children)])


def test_no_ray_leaves_the_lobby(lobby):
    lobby.animate(9.0)  # the lift is open
    shapes = triangles(lobby.roots[0], without=FIGURES)
    a, u, v = shapes[:, 0], shapes[:, 1] - shapes[:, 0], shapes[:, 2] - shapes[:, 0]
    rng = np.random.default_rng(0)
    for direction in rng.normal(size=(200, 3)):
        # Möller and Trumbore 1997
        p = np.cross(direction, v)
        determinant = np.einsum("tk,tk->t", p, u)
        with np.errstate(divide="ignore", invalid="ignore"):
            offset = np.array((0.1, 1.3, rng.uniform(-4, 4))) - a
            x = np.einsum("tk,tk->t", offset, p) / determinant
            q = np.cross(offset, u)
            y = q @ direction / determinant
            met = (x >= 0) & (y >= 0) & (x + y <= 1) & (np.einsum("tk,tk->t", q, v) / determinant > 0)
        assert met.any(), direction


def test_each_light_shines_inwards_from_a_plate_that_only_the_camera_sees(lobby):
    lights = [node for node in lobby.nodes() if node.light]
    assert len(lights) == 10 and lobby.environment is None
    for node in lights:
        assert isinstance(node.light, RectangleLight)
        inwards = (0, 1.5, -5) if node.name == "lift light" else (0, 1.5, node.world[2, 3] * 0.7)
        assert (inwards - node.world[:3, 3]) @ -node.world[:3, 2] > 0.5, node.name
        (plate,) = (child for child in node.children if child.name.endswith("plate"))
        assert plate.visible_to_camera and not plate.visible_to_reflections and not plate.casts_shadows
        corners = plate.mesh.sections[0].positions @ plate.transform[:3, :3].T + plate.transform[:3, 3]
        np.testing.assert_allclose(np.ptp(corners, axis=0)[:2], (node.light.width, node.light.height), rtol=1e-5)
        assert (corners[:, 2] > 0).all()  # behind the light, or it would be in its own way
        normals = plate.mesh.sections[0].normals @ plate.transform[:3, :3].T
        np.testing.assert_allclose(normals, np.broadcast_to((0, 0, -1), normals.shape), atol=1e-6)
        shine = np.multiply(node.light.color, node.light.radiance)
        np.testing.assert_allclose(plate.mesh.sections[0].material.emission, shine)


def test_the_lobby_has_mirrors_and_gloss_of_many_kinds(lobby):
    materials = {m.name: m for node in lobby.nodes() if node.mesh for m in (s.material for s in node.mesh.sections)}
    metals = {m.roughness for m in materials.values() if m.metallic == 1}
    assert min(metals) == 0.02 and {0.08, 0.15} < metals
    assert materials["polished floor"].roughness == 0.25 and materials["white armour"].metallic == 0
    assert 100_000 < lobby.triangle_count() < 200_000


def test_the_lobby_ends_where_it_began_and_nothing_jumps(lobby, motion):
    matrices, _ = motion
    assert {animation.name for animation in lobby.animations} == {"figures", "lift"}
    np.testing.assert_allclose(matrices[-1], matrices[0], atol=1e-6)
    speed = np.linalg.norm(np.diff(matrices[..., :3, 3], axis=0), axis=-1) * 30
    assert 0.5 < speed.max() < 2.5  # metres per second: boots in mid-step


def test_the_lift_opens_and_shuts(motion):
    matrices, rows = motion
    gap = matrices[:, rows["right leaf"], 0, 3] - matrices[:, rows["left leaf"], 0, 3]
    assert gap.min() == pytest.approx(1.0) and gap.max() == pytest.approx(1.0 + 2 * 0.96)
    assert (gap == gap[0])[:120].all() and (gap > 2.9)[190:380].all()


def test_boots_stand_still_while_they_are_down_and_never_sink(motion):
    matrices, rows = motion
    boots = matrices[:, [rows[f"officer/{side} boot"] for side in ("left", "right")]][..., :3, 3]
    assert boots[..., 1].min() == pytest.approx(ANKLE, abs=2e-3)
    down = (boots[1:, :, 1] < ANKLE + 3e-3) & (boots[:-1, :, 1] < ANKLE + 3e-3)
    slide = np.linalg.norm(np.diff(boots[..., [0, 2]], axis=0), axis=-1) * 30
    assert 0.4 < down.mean() < 0.6
    assert np.median(slide[down]) < 0.01 and slide.max() > 0.8
    assert (down.any(1)).mean() > 0.9  # one boot at least


def test_shins_end_in_their_boots(motion):
    matrices, rows = motion
    for figure in FIGURES:
        for side in ("left", "right"):
            ankle = matrices[:, rows[f"{figure}/{side} thigh/{side} shin"]] @ (0, -SHIN, 0, 1)
            boot = matrices[:, rows[f"{figure}/{side} boot"], :3, 3]
            assert np.abs(ankle[:, :3] - boot).max() < 0.012, figure


def test_figures_keep_apart_and_off_the_walls(motion):
    matrices, rows = motion
    places = matrices[:, [rows[figure] for figure in FIGURES]][..., [0, 2], 3]
    gaps = np.linalg.norm(places[:, :, None] - places[:, None], axis=-1)[:, *np.triu_indices(3, 1)]
    assert gaps.min() > 0.65  # from middle to middle
    assert (np.abs(places) < np.array((2.5, 4.5)) - 0.5).all()


@pytest.mark.parametrize("ankle", [(0.0, -0.8, 0.1), (0.05, -0.7, -0.25), (-0.02, -0.6, 0.3)])
def test_a_bent_leg_ends_at_the_ankle_with_its_knee_in_front(ankle):
    upper, lower = bent_leg(np.array([ankle]))
    knee = turned(upper, (0, -THIGH, 0))
    found = knee + turned(upper, turned(lower, (0, -SHIN, 0)))
    np.testing.assert_allclose(found, [ankle], atol=1e-9)
    along = np.array(ankle) / np.linalg.norm(ankle)
    assert (knee[0] - knee[0] @ along * along)[2] > 0


def test_a_leg_points_at_what_it_does_not_reach():
    upper, lower = bent_leg(np.array([(0.0, -2.0, 0.0)]))
    np.testing.assert_allclose(np.abs([upper[0, 3], lower[0, 3]]), 1, atol=1e-9)
