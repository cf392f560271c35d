"""Scenes made in code, but for those that have a file of their own here, and the sky."""

import numpy as np
import pytest

import pica
from pica.scenes.sky import Window, gradient_sky
from tests.wrong_values import VALUES, fault_of


def test_windows_shine_where_they_are():
    window = Window(azimuth=90, elevation=30, width=40, height=30, radiance=(9.0, 8.0, 7.0))
    sky = gradient_sky((1, 1, 1), (1, 1, 1), (1, 1, 1), [window], height=90).radiance
    row, column = np.unravel_index(sky[..., 0].argmax(), sky.shape[:2])
    # Environment: u = 0.5 + azimuth / 360, v = 0.5 - elevation / 180.
    assert abs(column / 180 - 0.75) < 0.06 and abs(row / 90 - (0.5 - 30 / 180)) < 0.06
    np.testing.assert_allclose(sky[row, column], (9, 8, 7), rtol=1e-3)


def test_cornell_is_a_closed_matt_room_with_a_lamp():
    scene = pica.scenes.cornell()
    sections = [section for node in scene.nodes() if node.mesh for section in node.mesh.sections]
    assert all(section.material.specular == 0 and section.material.metallic == 0 for section in sections)
    lamps = [section for section in sections if any(section.material.emission)]
    assert len(lamps) == 1 and len(lamps[0].indices) == 2
    assert len(scene.cameras()) == 1
    lamp = next(node for node in scene.nodes() if node.name == "lamp")
    np.testing.assert_allclose(lamp.world[:3, :3] @ (0, 1, 0), (0, -1, 0), atol=1e-12)  # shines down


def test_sphere_grid_covers_roughness_and_metalness():
    scene = pica.scenes.sphere_grid(columns=4, rows=2)
    balls = [node for node in scene.nodes() if node.name.startswith("sphere ") and node.mesh]
    found = {(n.mesh.sections[0].material.roughness, n.mesh.sections[0].material.metallic) for n in balls}
    assert len(balls) == len(found) == 8
    low, high = np.min(list(found), axis=0), np.max(list(found), axis=0)
    np.testing.assert_allclose([low, high], [(0.05, 0), (1, 1)])
    assert scene.environment is not None


def test_sphere_sweep_is_even_in_squared_roughness():
    scene = pica.scenes.sphere_sweep()
    balls = [node for node in scene.nodes() if node.name.startswith("sphere ") and node.mesh]
    for row, metallic in enumerate((1.0, 0.0)):
        line = sorted((n for n in balls if n.name.startswith(f"sphere {row}")), key=lambda n: n.transform[0, 3])
        materials = [node.mesh.sections[0].material for node in line]
        np.testing.assert_allclose([m.roughness**2 for m in materials], np.linspace(0, 1, 9), atol=1e-12)
        assert {m.metallic for m in materials} == {metallic}
    boards = [node for node in scene.nodes() if node.name.endswith("board")]
    assert len({node.mesh.sections[0].material.emission for node in boards}) == 5


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (pica.scenes.machine_world, ("seed", "machines", "robots")),
        (pica.scenes.landscape, ("seed", "plants")),
        (pica.scenes.sphere_grid, ("columns", "rows")),
    ],
)
def test_what_is_no_number_is_refused_in_one_line(make, names):
    for name in names:
        for label, value in VALUES.items():
            if label not in ("zero", "one"):
                assert name in fault_of(make, **{name: value}), (name, label)
