"""What a mirror shows of a place that the picture does not: how it is lit indirectly.

    python benchmarks/off_picture.py [--size 160x90] [--frames 64] [--samples 512] [--paths 256] [--out FOLDER]

The darker one of two rooms, whose wall has a mirror that shows what is behind the camera, by light of the other room
alone. One JSON line for each way of global illumination, with and without a light map baked of PATHS paths a probe, and
with surfels also after the camera has turned about once: of the mirror's pixels FLIP and `light` over that of the path
tracer's, as pairs of both after 1, 8 and FRAMES still frames, and while the camera turns by 20 degrees in 12 frames.
With --out the last still picture of each, and one in motion.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images.pictures import write_png
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box
from pica.scenes.placing import mesh, move, place

_EYE, _TURN = np.array([1.6, 2.0, 1.0]), 20
_LOOK = 48
"""Frames of a turn about."""
_WAYS = (
    ("path_traced", False, False),
    ("path_traced", True, False),
    ("light_map", True, False),
    ("surfels", False, False),
    ("surfels", False, True),
)


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="160x90")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--paths", type=int, default=256)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    width, height = (int(length) for length in given.size.split("x"))
    size = width, height
    scene = _rooms()
    tracer = pica.PathTracer(scene, size=size)
    truth = {turned: tracer.render(given.samples, camera=_camera(turned)).color for turned in (0, _TURN)}
    light_map = pica.bake(scene, samples=given.paths)
    for mode, mapped, looks in _WAYS:
        settings = pica.Settings().with_values({"global_illumination.mode": mode})
        renderer = pica.Renderer(scene, size=size, settings=settings, light_map=light_map if mapped else None)
        for degrees in np.linspace(0, 360, _LOOK) if looks else ():
            renderer.advance(_camera(degrees))
        errors = {}
        for frame in range(1, given.frames + 1):
            still = renderer.render(1, camera=_camera(0))
            if frame in (1, 8, given.frames):
                errors[str(frame)] = _error(still, truth[0])
        for step in range(1, 13):
            moved = renderer.render(1, camera=_camera(_TURN * step / 12))
        errors["moving"] = _error(moved, truth[_TURN])
        name = f"{mode}{' with a map' if mapped else ''}{' after a turn about' if looks else ''}"
        print(json.dumps({"way": name, **errors}), flush=True)
        if given.out is not None:
            given.out.mkdir(parents=True, exist_ok=True)
            for what, frame in (("still", still), ("moving", moved)):
                write_png(given.out / f"{name.replace(' ', '_')}_{what}.png", frame.display)


def _rooms() -> Scene:
    """No lamp shines on the mirror, or the path tracer's picture would be full of single bright paths."""
    scene = pica.scenes.rooms()
    silver = Material(base_color=(0.9, 0.9, 0.9, 1.0), metallic=1.0, roughness=0.0)
    slab = mesh("mirror", [box((0.02, 1.2, 3.4), silver)])
    place(scene.add(Node("looking glass")), "mirror", slab, move(3.93, 1.8, 0.1))
    return scene


def _camera(degrees: Any) -> Camera:
    angle = np.radians(degrees) - np.arctan2(1.2, 2.3)
    return Camera.look_at(
        _EYE, _EYE + np.array([2.6 * np.cos(angle), -0.3, 2.6 * np.sin(angle)]), vertical_fov=np.radians(70)
    )


def _error(frame: pica.Frame, truth: NDArray[np.float32]) -> tuple[float, float]:
    mirror, exposure = frame.aov("metallic") > 0.5, quality.exposure_for(truth)
    _, errors = quality.flip(*(quality.exposed(picture, exposure) for picture in (truth, frame.color)))
    light = frame.color[mirror].mean() / truth[mirror].mean()
    return round(float(errors[mirror].mean()), 3), round(float(light), 3)


if __name__ == "__main__":
    main()
