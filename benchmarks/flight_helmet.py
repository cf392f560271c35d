"""FlightHelmet on a 10 m plane under a 5-degree sun: the figures of docs/measurements/performance.md.

    python benchmarks/flight_helmet.py FlightHelmet.gltf [--size 1920x1080] [--frames 200] [--device NAME] [--picture F]

Prints one JSON line per way to primary visibility. The camera is that of the other renderers' figures.
"""

import argparse
import json
import math

import numpy as np

import pica
from pica.quality.benchmark import benchmark
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import plane


def helmet_on_plane(path: str, environment: str | None = None) -> tuple[Scene, pica.Camera]:
    """The scene and the camera."""
    scene = pica.load(path, environment=environment or pica.Environment(np.zeros((1, 2, 3), np.float32)))
    low, high = scene.bounds()
    ground = Material(name="ground", base_color=(0.5, 0.5, 0.5, 1.0), metallic=0.0, roughness=1.0, specular=0.0)
    place = np.eye(4)
    place[:3, 3] = (low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2
    node = Node(name="ground", mesh=Mesh([plane(10.0, 10.0, ground)], name="ground"))
    node.transform = place
    scene.add(node)
    # A node's -Z is where its light shines.
    towards_sun = pica.Camera.look_at((0.5, 0.8, 0.4), (0.0, 0.0, 0.0))
    sun = Node(name="sun", light=DirectionalLight(illuminance=3.0, angular_diameter=math.radians(5.0)))
    sun.transform = towards_sun.transform
    scene.add(sun)
    return scene, pica.Camera.look_at((0.7, 0.6, 1.2), (0.0, 0.34, 0.0), vertical_fov=math.radians(35.0))


def main() -> None:
    """Measure both ways to primary visibility."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--device")
    parser.add_argument("--env")
    parser.add_argument("--picture")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = Device(arguments.device)
    for primary in ("raster", "rays"):
        scene, camera = helmet_on_plane(arguments.path, arguments.env)
        settings = pica.Settings().with_values({"visibility.primary": primary})
        renderer = pica.Renderer(scene, size=(width, height), settings=settings, device=device)
        measured = benchmark(renderer, camera, frames=arguments.frames)
        print(json.dumps({"device": device.name, "size": [width, height], "primary": primary, **measured}), flush=True)
        if arguments.picture:
            renderer.render(16, camera=camera).save(arguments.picture.replace(".png", f"_{primary}.png"))


if __name__ == "__main__":
    main()
