"""Diffuse global illumination against many paths: converged, in the first frame, and after a step of the light.

    python benchmarks/global_illumination.py [SCENE ...] [--mode path_traced] [--size 480x270] [--frames 300]
        [--samples 1024] [--set NAME=VALUE] [--spacing M] [--paths 1024] [--out FOLDER]

Scenes: built-in ones, unless told cornell, machine_world, rooms and court. Of each, as JSON: `mean`, the light that
surfaces reflect diffusely of others over that of as many paths with the same number of bounces from the same G-buffer,
and `psnr`, both after FRAMES still frames without jitter; `flip` of a whole still picture against the path tracer
without a limit, and `flip_depth` against one that ends where this does; `first`, the first frame's light over the
converged one; `flicker`, its mean change from frame to frame at rest, as a share; `door`, the light of a room behind a
closed door over that of the lit one. And after all lamps became three times as bright, the frames until 80 and 95 % of
the step have come, and by how much it was overshot. With --out a sheet of each scene.
With --mode light_map each scene is baked first, with SPACING and PATHS as `pica bake` has them: `probes`, `spacing`,
metres between the nearest, `bake`, seconds, and `megabytes`; such light does not follow the lamps.
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images.pictures import write_png
from pica.quality.effects import MeasuredEffect
from pica.scene.camera import Camera

_STEP = 3.0


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=["cornell", "machine_world", "rooms", "court"], metavar="SCENE")
    parser.add_argument("--mode", default="path_traced")
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--set", action="append", default=[], dest="values")
    parser.add_argument("--spacing", type=float)
    parser.add_argument("--paths", type=int, default=1024)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    width, height = (int(length) for length in given.size.split("x"))
    values = {"global_illumination.mode": given.mode, **dict(value.split("=") for value in given.values)}
    settings = pica.Settings().with_values(values)
    for name in given.scenes:
        scene = getattr(pica.scenes, name)()
        camera = scene.default_camera(width / height)
        light_map, found = None, {}
        if given.mode == "light_map":
            light_map, found = _baked(scene, given.spacing, given.paths)
        found |= _converged(scene, camera, (width, height), settings, light_map, given.frames, given.samples)
        if light_map is None:
            found |= _step(scene, camera, (width, height), settings)
        found |= _whole(name, (width, height), settings, light_map, given.frames, given.samples, given.out)
        if name == "rooms":
            found["door"] = _door((width, height), settings, given.spacing, given.paths)
        print(
            json.dumps({"scene": name, "mode": given.mode, **{key: round(found[key], 4) for key in found}}), flush=True
        )


def _baked(scene: Any, spacing: float | None, paths: int) -> tuple[pica.LightMap, dict[str, float]]:
    began = time.perf_counter()
    light_map = pica.bake(scene, spacing=spacing, samples=paths)
    found = {"bake": time.perf_counter() - began, "probes": float(len(light_map.harmonics))}
    with TemporaryDirectory() as folder:
        file = Path(folder) / "scene.lightmap"
        light_map.save(file)
        found |= {"spacing": light_map.bricks.spacing, "megabytes": file.stat().st_size / 1e6}
    return light_map, found


def _light(renderer: pica.Renderer) -> NDArray[np.float64]:
    return renderer.captured["diffuse_indirect"]().astype(np.float64)


def _converged(
    scene: Any,
    camera: Camera,
    size: tuple[int, int],
    settings: pica.Settings,
    light_map: pica.LightMap | None,
    frames: int,
    samples: int,
) -> dict[str, float]:
    renderer = pica.Renderer(scene, size=size, settings=settings, light_map=light_map)
    changes, first = [], 0.0
    before = None
    for frame in range(frames):
        renderer.advance(camera, jittered=False, capture=("diffuse_indirect",))
        if frame == 0:
            first = _light(renderer).mean()
        if frame >= frames - 20:
            now = _light(renderer)
            if before is not None:
                changes.append(np.abs(now - before).mean() / now.mean())
            before = now
    measured = MeasuredEffect(renderer, "global_illumination")
    light, truth = measured.result()["diffuse_indirect"], measured.reference(samples)["diffuse_indirect"]
    there = np.isfinite(truth).all(-1)
    white = np.percentile(truth[there], 95)
    error = np.clip(light[there] / white, 0, 1) - np.clip(truth[there] / white, 0, 1)
    return {
        "mean": float(light[there].mean() / truth[there].mean()),
        "psnr": float(-10 * np.log10(np.mean(error**2))),
        "first": float(first / light.mean()),
        "flicker": float(np.mean(changes)),
    }


def _step(scene: Any, camera: Camera, size: tuple[int, int], settings: pica.Settings) -> dict[str, float]:
    """Of lamps; what shines without being one stays."""
    lamps = [node for node in scene.nodes() if node.light is not None]
    if not lamps:
        return {}
    renderer = pica.Renderer(scene, size=size, settings=settings)
    means = []
    for frame in range(240):
        if frame == 120:
            for node in lamps:
                node.light = _brighter(node.light)
        renderer.advance(camera, jittered=False, capture=("diffuse_indirect",))
        means.append(_light(renderer).mean())
    start, end = np.mean(means[110:120]), np.mean(means[220:])
    share = (np.array(means[120:]) - start) / (end - start)
    return {
        "frames_80": float(np.argmax(share >= 0.8) + 1),
        "frames_95": float(np.argmax(share >= 0.95) + 1),
        "overshoot": float(max(share.max() - 1, 0)),
    }


def _brighter(light: Any) -> Any:
    name = next(name for name in ("radiance", "illuminance", "intensity") if hasattr(light, name))
    return replace(light, **{name: _STEP * getattr(light, name)})


def _whole(
    name: str,
    size: tuple[int, int],
    settings: pica.Settings,
    light_map: pica.LightMap | None,
    frames: int,
    samples: int,
    out: Path | None,
) -> dict[str, float]:
    scene = getattr(pica.scenes, name)()
    picture = pica.Renderer(scene, size=size, settings=settings, light_map=light_map).render(frames).color
    found = {}
    depths = {"flip": None}
    if settings.global_illumination.mode in ("path_traced", "restir"):
        depths["flip_depth"] = settings.global_illumination.bounces + 2
    for key, depth in depths.items():
        truth = pica.PathTracer(scene, size=size, max_depth=depth, settings=settings).render(samples).color
        errors = quality.compare(truth, picture)
        found[key] = errors.flip
        if key == "flip" and out is not None:
            shown = {"hybrid": picture, "path traced": truth}
            panels = {title: quality.exposed(light, errors.exposure) for title, light in shown.items()}
            out.mkdir(parents=True, exist_ok=True)
            page = quality.sheet({**panels, f"FLIP {errors.flip:.4f}": errors.flip_map})
            write_png(out / f"{name}-{settings.global_illumination.mode}.png", page)
    return found


def _door(size: tuple[int, int], settings: pica.Settings, spacing: float | None, paths: int) -> float:
    scene = pica.scenes.rooms(door=0.0)
    light_map = (
        pica.bake(scene, spacing=spacing, samples=paths) if settings.global_illumination.mode == "light_map" else None
    )
    renderer = pica.Renderer(scene, size=size, settings=settings, light_map=light_map)
    lit = renderer.render(
        32, camera=Camera.look_at((-1.2, 1.5, 1.8), (-2.4, 1.0, -1.2), vertical_fov=np.radians(75))
    ).color.mean()
    return float(renderer.render(32).color.mean() / lit)


if __name__ == "__main__":
    main()
