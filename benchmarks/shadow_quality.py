"""Filtered shadows of one ray a pixel against 2048 rays: the figures of docs/measurements/shadows.md.

    python benchmarks/shadow_quality.py [--size 640x360] [--frames 120] [--samples 2048] [--set shadows.denoiser=svgf]
        [--only sequences|penumbra|off|trail] [--sheets FOLDER] [--jitter]

machine_world under five lights, one at a time: suns of 0.5 and 5 degrees, rectangles of 1 and 4 metres, a sphere;
then widths of penumbras, and what is left of a shadow when its light or its object has gone. One JSON object.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import pica
from pica.quality.effects import MeasuredEffect, compare_effect, error_sheet
from pica.quality.sequences import sequence
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, Light, RectangleLight, SphereLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import aim, move

SUN_FROM, LAMP_FROM = (3.0, 6.0, 4.0), (2.5, 4.0, 2.5)
LIGHTS: dict[str, tuple[Light, tuple[float, float, float]]] = {
    "sun 0.5": (DirectionalLight(illuminance=3, angular_diameter=np.radians(0.5)), SUN_FROM),
    "sun 5": (DirectionalLight(illuminance=3, angular_diameter=np.radians(5)), SUN_FROM),
    "rectangle 1 m": (RectangleLight(radiance=40, width=1, height=1), LAMP_FROM),
    "rectangle 4 m": (RectangleLight(radiance=3, width=4, height=4), LAMP_FROM),
    "sphere": (SphereLight(radiance=60, radius=0.4), LAMP_FROM),
}
MOTIONS = {"still": None, "orbit": 0.25, "objects": 1 / 60, "moving_light": None}
"""Sequences, and their speeds: degrees and seconds a frame."""


def lit(scene: Scene, light: Light, eye: tuple[float, float, float]) -> Scene:
    """The scene with this light alone, which shines to the origin; nothing else shines."""
    for node in list(scene.nodes()):
        if node.light is not None and node.parent is None:
            scene.remove(node)
        elif node.light is not None:
            node.light = None
        for section in node.mesh.sections if node.mesh is not None else ():
            section.material.emission = (0.0, 0.0, 0.0)
    scene.environment = None
    lamp = scene.add(Node("lamp", light=light))
    lamp.transform = aim(eye, (0, 0, 0))
    return scene


def shown(section: Any, transform: Any) -> Node:
    """A node with this section."""
    node = Node(mesh=Mesh([section]))
    node.transform = transform
    return node


def sequences(device: Device, size: Any, settings: pica.Settings, arguments: argparse.Namespace) -> dict[str, Any]:
    """Decibels and flicker of each light in each sequence."""
    found: dict[str, Any] = {}
    for name, (light, eye) in LIGHTS.items():
        for motion, speed in MOTIONS.items():
            scene = lit(pica.scenes.machine_world(), light, eye)
            renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
            play = sequence(motion, scene, scene.default_camera(size[0] / size[1]), speed=speed)
            errors = compare_effect(
                renderer, "shadows", play, arguments.frames, arguments.samples, jittered=arguments.jitter
            )
            found.setdefault(name, {})[motion] = {
                "psnr": round(float(np.mean(errors.psnr)), 2),
                "first": round(errors.psnr[0], 2),
                "last": round(errors.psnr[-1], 2),
                "flicker": round(float(np.mean(errors.change)), 5),
            }
            if arguments.sheets:
                arguments.sheets.mkdir(parents=True, exist_ok=True)
                path = arguments.sheets / f"{name} {motion}.png".replace(" ", "_")
                pica.images.pictures.write_png(path, error_sheet(errors))
    return found


def penumbras(device: Device, size: Any, settings: pica.Settings, arguments: argparse.Namespace) -> dict[str, Any]:
    """Pixels from 10 to 90 % of the light across the shadow edge of a board, filtered and by many rays."""
    found = {}
    for height in (0.25, 0.5, 1.0):
        scene = Scene()
        scene.add(shown(plane(20, 20, Material()), np.eye(4)))
        scene.add(shown(box(1, Material()), move(-2, height, 0) @ np.diag([4, 0.02, 8, 1])))
        sun = scene.add(Node("sun", light=DirectionalLight(illuminance=3, angular_diameter=np.radians(5))))
        sun.transform = aim((0.01, 6, 0), (0, 0, 0))
        renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
        measured = MeasuredEffect(renderer, "shadows")
        camera = Camera.look_at(
            (0, 0.2, 1), (0, 0, 0), vertical_fov=np.radians(50)
        )  # below the boards; x runs across the edge
        for _ in range(60):
            renderer.advance(camera, jittered=arguments.jitter, capture=measured.offers)
        (result,), (expected,) = measured.result().values(), measured.reference(arguments.samples).values()
        rows = slice(size[1] // 2 - 4, size[1] // 2 + 4)
        found[f"{height} m"] = [round(_width(layer[rows].mean(0)), 2) for layer in (result, expected)]
    return found


def _width(profile: Any) -> float:
    """Pixels between 10 and 90 %, by linear interpolation along a profile that rises or falls once."""
    rising = profile if profile[0] < profile[-1] else profile[::-1]
    ends = np.interp([0.1, 0.9], np.maximum.accumulate(rising), np.arange(len(rising)))
    return float(ends[1] - ends[0])


def trail(device: Device, size: Any, settings: pica.Settings, arguments: argparse.Namespace) -> dict[str, Any]:
    """Objects sway for 30 frames and stop: the mean square error where shadows changed last, some frames later."""
    found = {}
    for name, (light, eye) in LIGHTS.items():
        scene = lit(pica.scenes.machine_world(), light, eye)
        scene.animations.clear()
        renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
        measured = MeasuredEffect(renderer, "shadows")
        camera = scene.default_camera(size[0] / size[1])
        play = sequence("objects", scene, camera, speed=MOTIONS["objects"])
        before: Any = None
        errors = []
        for frame in range(31 + 60):
            renderer.advance(play(min(frame, 30)), jittered=arguments.jitter, capture=measured.offers)
            if frame in (22, 30, 31, 34, 38, 90):
                (result,), (expected,) = measured.result().values(), measured.reference(512).values()
                if frame == 22:
                    before = expected
                if frame == 30:
                    region = np.abs(expected - before) > 0.2
                if frame > 30:
                    errors.append(float(np.nanmean(((result - expected) ** 2)[region])))
        found[name] = {"1": errors[0], "4": errors[1], "8": errors[2], "60": errors[3], "pixels": int(region.sum())}
    return found


def switched_off(device: Device, size: Any, settings: pica.Settings, arguments: argparse.Namespace) -> dict[str, Any]:
    """Share of the change of the picture that has arrived 1 to 8 frames after one of two lights went."""
    scene = lit(pica.scenes.machine_world(), *LIGHTS["sun 5"])
    lamp = scene.add(Node("second", light=LIGHTS["rectangle 1 m"][0]))
    lamp.transform = aim(LAMP_FROM, (0, 0, 0))
    renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
    camera = scene.default_camera(size[0] / size[1])
    lit_before = renderer.render(40, camera=camera).color
    scene.remove(lamp)
    pictures = [renderer.render(1, camera=camera).color for _ in range(8)]
    after = renderer.render(100, camera=camera).color
    # Noise stays; what counts is how much of the light that went is still there.
    whole = (lit_before - after).sum()
    return {"arrived": [round(float((lit_before - picture).sum() / whole), 4) for picture in pictures]}


PARTS = {"sequences": sequences, "penumbra": penumbras, "trail": trail, "off": switched_off}


def main() -> None:
    """Measure and print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--samples", type=int, default=2048)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--jitter", action="store_true")
    arguments = parser.parse_args()
    size = tuple(int(length) for length in arguments.size.split("x"))
    settings = pica.Settings().with_values(dict(text.split("=") for text in arguments.set))
    device = Device()
    result: dict[str, Any] = {"device": device.name, "size": list(size), "set": arguments.set}
    for name in [arguments.only] if arguments.only else PARTS:
        result[name] = PARTS[name](device, size, settings, arguments)
        print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main()
