"""Objects come and go for thousands of frames, or a camera flies far: does memory stay flat?

    python benchmarks/endurance.py [--scene NAME] [--flight surfels|path_traced] [--frames 20000] [--size 64x36]
        [--surfels 250000] [--device NAME] [--strip FILE.png]

With --scene in a built-in scene, which plays meanwhile, with lens effects. Prints the process's resident memory and
pica's own count of device memory twenty times. With --flight a camera flies four laps through a world of 200 metres
whose light surfels or the radiance cache keep, twelve metres a second at 60 frames a second with 10,000 frames; then
also how many surfels or entries are in use at most, and milliseconds of a frame; at the end the last lap's median over
the second's, which sees the same, and FLIP of the last picture against a renderer that has flown for 48 frames alone.
--strip shows both of the last picture and of four before it.
"""

import argparse
import os
import time
from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np
import PIL.Image

import pica
from pica.quality.picture_errors import compare
from pica.quality.playback import last_frame
from pica.rhi.device import Device
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight
from pica.scene.material import Image, Material, Texture
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move


def resident() -> float:
    """Megabytes that the process holds (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def guest(seed: int) -> Node:
    """A ball with a material and a texture of its own; every fourth one morphs, every seventh one shines."""
    random = np.random.default_rng(seed)
    pixels = random.integers(0, 255, (8 << seed % 3, 16, 4)).astype(np.uint8)
    shine = (2.0, 1.0, 0.5) if seed % 7 == 0 else (0.0, 0.0, 0.0)
    material = Material(metallic=0.0, base_color_texture=Texture(Image(pixels)), emission=shine)
    section = sphere(0.3, material, 6 + seed % 9)
    node = Node(mesh=Mesh([section]))
    if seed % 4 == 0:
        section.morph_positions = random.normal(0, 0.1, (1, len(section.positions), 3)).astype(np.float32)
        node.weights = [0.0]
    node.transform = move(*random.uniform(-2, 2, 3))
    return node


def world() -> Scene:
    """Six hundred blocks on 200 x 200 metres of ground, in the sun."""
    random = np.random.default_rng(1)
    scene = Scene(environment=Environment(np.full((2, 4, 3), 0.3, np.float32)))
    scene.add(Node(mesh=Mesh([plane(200, 200, Material(metallic=0.0))])))
    for _ in range(600):
        size = random.uniform((1, 1, 1), (5, 8, 5))
        color = (*random.uniform(0.2, 0.8, 3), 1.0)
        block = scene.add(Node(mesh=Mesh([box(size, Material(base_color=color, metallic=0.0, roughness=0.9))])))
        x, z = random.uniform(-98, 98, 2)
        block.transform = move(x, size[1] / 2, z)
    sun = scene.add(Node(light=DirectionalLight(illuminance=10.0)))
    sun.transform = aim((3, 5, 2), (0, 0, 0))
    return scene


def fly(mode: str, size: tuple[int, int], frames: int, surfels: int, device: str | None, strip: str | None) -> None:
    """Four laps, in a figure of eight five metres above the ground."""
    values = {"global_illumination.mode": mode, "global_illumination.surfels": str(surfels)}
    scene, opened, settings = world(), Device(device), pica.Settings().with_values(values)
    renderer = pica.Renderer(scene, size=size, settings=settings, device=opened)
    count = "count.surfels" if mode == "surfels" else "count.cache_entries"

    def place(share: float) -> tuple[float, float, float]:
        turn = 8 * np.pi * share
        return 90 * np.sin(turn), 5.0, 90 * np.sin(2 * turn) / 2

    def view(frame: int) -> pica.Camera:
        return pica.Camera.look_at(place(frame / frames), place((frame + 20) / frames), vertical_fov=np.radians(60))

    milliseconds, most = [], 0
    for frame in range(frames):
        camera = view(frame)
        began = time.perf_counter()
        renderer.advance(camera, capture=(count,))
        renderer.device.handle.wait_for_idle()
        milliseconds.append(1e3 * (time.perf_counter() - began))
        most = max(most, renderer.captured[count]()) if frame % 10 == 0 else most
        if (frame + 1) % max(frames // 20, 1) == 0:
            print(
                f"{frame + 1} frames: resident {resident():.1f} MB, device {renderer.device.memory / 2**20:.2f} MB, "
                f"at most {most} {count.removeprefix('count.')},"
                f" {np.median(milliseconds[-(frames // 20) :]):.1f} ms a frame",
                flush=True,
            )
    lap = frames // 4
    second, last = np.median(milliseconds[lap : 2 * lap]), np.median(milliseconds[3 * lap :])
    print(f"last lap over second: {last / second:.3f}")
    pictures = []
    for each in renderer, pica.Renderer(scene, size=size, settings=settings, device=opened):
        pictures.append([last_frame(each, view, range(end - 8, end)) for end in range(frames + 8, frames + 49, 8)])
    flown, fresh = (row[-1].color for row in pictures)
    print(f"FLIP of the last picture against a fresh renderer: {compare(fresh, flown).flip:.4f}")
    if strip:
        rows = [np.concatenate([frame.display[..., :3] for frame in row[-5:]], 1) for row in pictures]
        PIL.Image.fromarray(np.concatenate(rows)).save(strip)


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", metavar="NAME")
    parser.add_argument("--flight", choices=["surfels", "path_traced"])
    parser.add_argument("--strip", metavar="FILE.png")
    parser.add_argument("--frames", type=int, default=20_000)
    parser.add_argument("--size", default="64x36")
    parser.add_argument("--surfels", type=int, default=250_000)
    parser.add_argument("--device")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    if arguments.flight:
        device, strip = arguments.device, arguments.strip
        fly(arguments.flight, (width, height), arguments.frames, arguments.surfels, device, strip)
        return
    settings = pica.Settings()
    if arguments.scene:
        scene = getattr(pica.scenes, arguments.scene)()
        camera = replace(scene.default_camera(width / height), f_number=2.8, focus_distance=10.0)
        settings = settings.with_values({"post.bloom": 0.1, "post.shutter": 0.5, "post.vignette": 0.3})
    else:
        scene = Scene(environment=Environment(np.ones((2, 4, 3), np.float32)))
        scene.add(Node(mesh=Mesh([plane(6, 6, Material())])))
        camera = pica.Camera.look_at((0, 3, 6), (0, 0, 0), vertical_fov=np.radians(45))
    renderer = pica.Renderer(scene, size=(width, height), settings=settings, device=Device(arguments.device))
    guests: deque[Node] = deque()
    for frame in range(1, arguments.frames + 1):
        scene.animate(frame / 60)
        guests.append(scene.add(guest(frame)))
        if len(guests) > 5 + frame % 11:
            scene.remove(guests.popleft())
        if len(guests) > 12:
            scene.remove(guests.popleft())
        for node in guests:
            if node.weights is not None:
                node.weights = [np.sin(0.1 * frame)]
        renderer.advance(camera)
        if frame % max(arguments.frames // 20, 1) == 0:
            print(
                f"{frame} frames: resident {resident():.1f} MB, device {renderer.device.memory / 2**20:.2f} MB",
                flush=True,
            )


if __name__ == "__main__":
    main()
