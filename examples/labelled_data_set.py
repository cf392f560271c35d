"""A data set: pictures with depth, ids and masks, and the cameras that saw them.

    python examples/labelled_data_set.py folder --views 50

NNNN.png is the picture, NNNN.depth.exr metres along the view axis, NNNN.ids.png the number of the node that each pixel
shows (16 bits), NNNN.CLASS.png a mask for each class. data_set.json has the nodes' names and, for each view, the matrix
K and the camera to world pose, both as OpenCV has them.
"""

import argparse
import json
import math
from pathlib import Path

import numpy as np

import pica
from pica.images.labels import NodeLabel

CLASSES = {"belt": ("long belt", "cross belt"), "fruit": ("apple", "orange", "plum"), "robot": ("walker", "balancer")}
"""Names of nodes by class; what is below such a node has its class too."""


def class_of(node: NodeLabel) -> str | None:
    """By name here; `frame.semantic("class")` takes it from `node.extras["class"]`."""
    return next((name for name, words in CLASSES.items() if node.name.startswith(words)), None)


def main() -> None:
    """Render it."""
    parser = argparse.ArgumentParser(description="Pictures with depth, ids, masks and cameras.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--frames", type=int, default=8, help="rendered for each picture, which is their mean")
    arguments = parser.parse_args()
    size = tuple(int(length) for length in arguments.size.split("x"))
    arguments.folder.mkdir(parents=True, exist_ok=True)

    scene = pica.scenes.machine_world(seed=1)
    random = np.random.default_rng(1)
    views = []
    with pica.Renderer(scene, size=size) as renderer:
        for view in range(arguments.views):
            angle, height = random.uniform(0, 2 * math.pi), random.uniform(1, 4)
            camera = pica.Camera.look_at((8 * math.sin(angle), height, 8 * math.cos(angle)), (0, 0.8, 0))
            scene.animate(random.uniform(0, 24))
            # A cut: nothing of one view is taken along into the next, so each is the same in any order.
            frame = renderer.render(arguments.frames, camera=camera, cut=True, aovs=("depth", "instance"))
            stem = str(arguments.folder / f"{view:04}")
            frame.save(f"{stem}.png")
            frame.save_aov("depth", f"{stem}.depth.exr")
            frame.save_aov("instance", f"{stem}.ids.png", exact=True)
            labels, names = frame.semantic(class_of, list(CLASSES))
            for number, name in enumerate(names[1:], start=1):
                pica.write_labels(f"{stem}.{name}.png", labels == number)
            views.append({"K": camera.intrinsics(size).tolist(), "pose": camera.pose("opencv").tolist()})
    nodes = {number: label.path for number, label in frame.ids.items() if label.mesh is not None}
    described = {"size": size, "nodes": nodes, "views": views}
    (arguments.folder / "data_set.json").write_text(json.dumps(described, indent=1))


if __name__ == "__main__":
    main()
