"""A scene from NumPy arrays.

An island that is coloured by its height, with 200 trees that are copies of one mesh:

    python examples/scene_from_arrays.py island.png
"""

import argparse

import numpy as np

import pica

GRID = 129
"""Vertices along each side."""


def island() -> pica.Node:
    """40 by 40 metres, highest in the middle."""
    x, z = np.meshgrid(*[np.linspace(-20, 20, GRID)] * 2)
    height = 6 * np.exp(-(x**2 + z**2) / 120) + 0.4 * np.sin(x) * np.cos(0.7 * z) - 1
    positions = np.stack([x, height, z], -1).reshape(-1, 3)
    first = (np.arange(GRID - 1)[:, None] * GRID + np.arange(GRID - 1)).reshape(-1, 1)
    triangles = np.concatenate([first + np.array([0, GRID, GRID + 1]), first + np.array([0, GRID + 1, 1])])
    colors = np.where(positions[:, 1:2] < 0.3, [0.75, 0.65, 0.4], [0.15, 0.35, 0.08])  # linear: sand and grass
    ground = pica.Material("ground", metallic=0.0, roughness=0.9)
    return pica.Node("island", mesh=pica.Mesh.from_arrays(positions, triangles, colors=colors, material=ground))


def trees(ground: pica.Node, count: int = 200) -> pica.Node:
    """Cones that stand on some of the ground's vertices."""
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    cone = np.vstack([np.stack([0.4 * np.cos(angles), 0 * angles, 0.4 * np.sin(angles)], -1), [[0, 1.6, 0]]])
    sides = [[12, (corner + 1) % 12, corner] for corner in range(12)]
    green = pica.Material("needles", base_color=(0.05, 0.2, 0.06, 1.0), metallic=0.0, roughness=0.8)
    assert ground.mesh is not None
    vertices = ground.mesh.sections[0].positions
    copies = np.tile(np.eye(4), (count, 1, 1))
    copies[:, :3, 3] = np.random.default_rng(1).choice(vertices[vertices[:, 1] > 0.5], count)
    return pica.Node("trees", mesh=pica.Mesh.from_arrays(cone, sides, material=green, smooth=False), instances=copies)


def main() -> None:
    """Render it."""
    parser = argparse.ArgumentParser(description="A scene from NumPy arrays.")
    parser.add_argument("output", help="a .png or .exr")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=32)
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))

    sky = np.linspace([0.3, 0.5, 1.0], [0.5, 0.5, 0.5], 16)[:, None].repeat(32, axis=1)  # (16, 32, 3), blue on top
    scene = pica.Scene("island", pica.Environment(sky))
    ground = scene.add(island())
    scene.add(trees(ground))
    sun = scene.add(pica.Node("sun", light=pica.DirectionalLight(illuminance=4.0)))
    sun.transform = pica.Camera.look_at((3, 4, 2), (0, 0, 0)).transform  # lights shine along -Z, as cameras look
    camera = pica.Camera.look_at((18, 14, 26), (0, 1, 0))
    with pica.Renderer(scene, size=(width, height)) as renderer:
        renderer.render(arguments.frames, camera=camera).save(arguments.output)


if __name__ == "__main__":
    main()
