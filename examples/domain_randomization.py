"""A training set with random colours, places and lights: the views of one scene differ by arrays.

    python examples/domain_randomization.py folder --batches 16 --views 8

NNNN.png is the picture, NNNN.ids.png the number of the node that each pixel shows. data_set.json has the nodes' names
and, for each picture, the bounding box of each block that is seen: left, top, width and height in pixels.
"""

import argparse
import json
from pathlib import Path

import numpy as np

import pica

BLOCKS = ("red block", "green block", "blue block")
CORNERS = np.array(np.meshgrid([-0.5, 0.5], [0, 1], [-0.5, 0.5], indexing="ij")).reshape(3, 8).T  # metres
SQUARES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [[a, b, c] for p, q, r, s in SQUARES for a, b, c in ((p, q, r), (p, r, s))]


def table() -> pica.Scene:
    """Three blocks on a table, below a lamp and a sky."""
    sky = np.linspace([1.0, 1.0, 1.0], [0.4, 0.35, 0.3], 8)[:, None].repeat(16, axis=1)
    scene = pica.Scene("table", pica.Environment(sky))
    wood = pica.Material("table", metallic=0.0)
    top = np.array([[-4, 0, -4], [-4, 0, 4], [4, 0, 4], [4, 0, -4]], np.float32)
    scene.add(pica.Node("table", mesh=pica.Mesh.from_arrays(top, [[0, 1, 2], [0, 2, 3]], material=wood)))
    for name in BLOCKS:
        paint = pica.Material(name, metallic=0.0)
        scene.add(pica.Node(name, mesh=pica.Mesh.from_arrays(CORNERS, TRIANGLES, material=paint, smooth=False)))
    scene.add(pica.Node("lamp", light=pica.PointLight(intensity=30.0, radius=0.1)))
    return scene


def randomize(views: pica.SceneViews, random: np.random.Generator) -> None:
    """Values for each view: arrays with a row each. Tensors of PyTorch, JAX or CuPy do as well."""
    count = len(views)
    for index, name in enumerate(BLOCKS):
        angle, size = random.uniform(0, 2 * np.pi, count), random.uniform(0.4, 0.9, count)
        places = np.tile(np.eye(4), (count, 1, 1))
        places[:, 0, 0] = places[:, 2, 2] = np.cos(angle) * size
        places[:, 0, 2], places[:, 2, 0] = np.sin(angle) * size, -np.sin(angle) * size
        places[:, 1, 1] = size
        places[:, 0, 3] = 1.3 * (index - 1) + random.uniform(-0.2, 0.2, count)
        places[:, 2, 3] = random.uniform(-0.8, 0.8, count)
        views.set_transforms(name, places)
        views.set_visible(name, random.random(count) < 0.8)
        colors = np.ones((count, 4))
        colors[:, :3] = random.uniform(0.02, 0.2, (count, 3))
        colors[:, index] = random.uniform(0.4, 0.9, count)
        views.set_material(name, base_color=colors, roughness=random.uniform(0.1, 1.0, count))
    colors = np.column_stack([random.uniform(0.1, 0.8, (count, 3)), np.ones(count)])
    views.set_material("table", base_color=colors, roughness=random.uniform(0.2, 1.0, count))
    lamps = np.tile(np.eye(4), (count, 1, 1))
    lamps[:, :3, 3] = random.uniform([-2, 1.5, -1], [2, 3, 2], (count, 3))
    views.set_transforms("lamp", lamps)
    views.set_light("lamp", intensity=random.uniform(5, 60, count), color=random.uniform(0.6, 1, (count, 3)))
    views.set_environment(strength=random.uniform(0.1, 1.0, count), rotation=random.uniform(0, 2 * np.pi, count))


def box_of(mask: np.ndarray) -> list[int]:
    """Left, top, width and height of the pixels that are True."""
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    return [int(columns[0]), int(rows[0]), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1]


def main() -> None:
    """Render it."""
    parser = argparse.ArgumentParser(description="Pictures with random colours, places and lights.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--batches", type=int, default=4)
    parser.add_argument("--views", type=int, default=8, help="pictures of a batch")
    parser.add_argument("--size", default="128x96")
    parser.add_argument("--frames", type=int, default=8, help="rendered for each picture, which is their mean")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    arguments.folder.mkdir(parents=True, exist_ok=True)

    views, pictures = pica.SceneViews(table(), arguments.views), []
    with pica.Renderer(views, size=(width, height)) as renderer:
        for number in range(arguments.batches):
            random = np.random.default_rng((1, number))
            randomize(views, random)
            eyes = random.uniform([-2, 1.5, 3], [2, 3, 5], (arguments.views, 3))
            cameras = [pica.Camera.look_at(eye, (0, 0.3, 0)) for eye in eyes]
            # A cut: a batch depends on its number alone, not on the batches before.
            batch = renderer.render(arguments.frames, camera=cameras, cut=True, aovs=("instance",))
            for frame in batch:
                stem = str(arguments.folder / f"{len(pictures):04}")
                frame.save(f"{stem}.png")
                frame.save_aov("instance", f"{stem}.ids.png", exact=True)
                masks = {name: frame.mask(name) for name in BLOCKS}
                pictures.append({name: box_of(mask) for name, mask in masks.items() if mask.any()})
    nodes = {number: label.path for number, label in frame.ids.items() if label.mesh is not None}
    (arguments.folder / "data_set.json").write_text(json.dumps({"nodes": nodes, "boxes": pictures}, indent=1))


if __name__ == "__main__":
    main()
