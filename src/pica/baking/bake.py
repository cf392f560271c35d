"""Bakes a volumetric light map: indirect irradiance about the places of a scene."""

import time
from contextlib import suppress
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pica.baking.neighbours import Neighbours
from pica.baking.occupied import occupied_places
from pica.baking.probe_passes import ProbePasses
from pica.baking.seams import without_seams
from pica.errors import PicaError, SceneError
from pica.images.saving import check_writable
from pica.light_map.arrays_file import Lengths, Wanted, read_arrays, write_arrays
from pica.light_map.bricks import Bricks, bricks_around
from pica.light_map.fingerprint import content_of, layout_of
from pica.light_map.light_map import HARMONICS, MOST_BRICKS, SEEN_PER_BRICK, LightMap
from pica.rendering.arguments import Progress, check_made_with, check_progress
from pica.rhi.device import Device, open_device
from pica.scene.model import Scene
from pica.scene.values import BRIGHTEST, checked, optional, positive, whole
from pica.settings import Settings
from pica.tracing.fallbacks import check_traces, runnable

PROBES = 50_000
"""Approximate number of probes for the default spacing."""
_FINER = 2.0, 2**0.5, 2**0.25
"""Ratio of successive spacings that are tried."""
_MOST_SAMPLES = 1 << 16
_INSIDE = 0.25
"""Fraction of back-face hits from which on a probe counts as inside an object."""
_KEEP_EVERY = 20.0
"""Seconds."""
_TOP = 16384.0
"""The largest coefficient: 16-bit floats hold it, and values 2^28 times darker, to 11 bits."""
_PARTIAL = {
    "key": Wanted((3,), "<U96"),
    "light": Wanted((-1, HARMONICS, 4), "<f4"),
    "inside": Wanted((-1,), "<f4"),
    "seen": Wanted((-1, SEEN_PER_BRICK), "|u1"),
}


def bake(
    scene: Scene,
    *,
    spacing: float | None = None,
    samples: int = 1024,
    settings: Settings | None = None,
    device: Device | str | None = None,
    progress: Progress | None = None,
    partial: str | PathLike[str] | None = None,
) -> LightMap:
    """The light map of a scene in its current state, by `samples` light paths per probe of unlimited length.

    `spacing`: metres between probes near surfaces, 4 and 16 times that away from them; None: that of about 50,000
    probes. `partial`: a file for the state of an interrupted bake, which a later call resumes; it is
    removed at the end. `progress(done, total)` is called repeatedly. Raises as PathTracer does, and PicaError
    if `partial` cannot be written.
    """
    check_made_with("bake", scene, settings, device)
    spacing = checked("bake: spacing", optional(positive()), spacing)
    samples = checked("bake: samples", whole(1, _MOST_SAMPLES), samples)
    check_progress("bake", progress)
    gpu = open_device(device)
    check_traces(gpu, "baking")
    settings = runnable(gpu, settings or Settings())
    bricks = _bricks(scene, spacing)
    done = _Done(
        bricks, np.array([content_of(scene), layout_of(scene), f"{bricks.spacing!r} {samples} {settings.seed}"])
    )
    file = None if partial is None else Path(partial)
    if file is not None:
        check_writable(file)
        done.read(file)
    with gpu.lock:
        passes = ProbePasses(gpu.memory_scope(), scene, settings, bricks, samples)
        passes.view.make_programs()
    try:
        _run(passes, done, progress, file)
    finally:
        with gpu.lock:
            passes.view.close()
    light_map = done.light_map()
    if file is not None:
        file.unlink(missing_ok=True)
    return light_map


def _bricks(scene: Scene, spacing: float | None) -> Bricks:
    scene.check()
    low, high = scene.bounds()

    def at(spacing: float) -> Bricks:
        bricks = bricks_around(low, high, spacing, *occupied_places(scene, low, high, spacing))
        if len(bricks.places) > MOST_BRICKS:
            fault = f"{spacing:g} m between probes make {len(bricks.places):,} bricks"
            raise SceneError(f"bake: {fault}; a light map has {MOST_BRICKS:,} at most")
        return bricks

    if spacing is not None:
        return at(spacing)
    bricks = at(float(max(high - low)) / 8)
    for factor in _FINER:
        with suppress(SceneError):
            while len((finer := at(bricks.spacing / factor)).probes) <= PROBES:
                bricks = finer
    return bricks


def _run(passes: ProbePasses, done: "_Done", progress: Progress | None, file: Path | None) -> None:
    """Bake the rest. The result so far is saved from time to time, and on any interruption."""
    saved = time.monotonic()
    total = len(done.light) + len(done.seen)
    try:
        while done.probes < len(done.light) or done.bricks < len(done.seen):
            if done.probes < len(done.light):
                done.add_light(*passes.light(done.probes))
            else:
                done.add_seen(passes.visibility(done.bricks))
            if progress is not None:
                progress(done.probes + done.bricks, total)
            if file is not None and time.monotonic() - saved > _KEEP_EVERY:
                done.write(file)
                saved = time.monotonic()
    except BaseException:
        if file is not None:
            with suppress(PicaError):  # the interruption itself is raised
                done.write(file)
        raise


class _Done:
    """The result so far."""

    def __init__(self, bricks: Bricks, key: NDArray[np.str_]) -> None:
        """`key`: identifies the bake; it must match for a bake to resume."""
        self._brick_layout, self._key = bricks, key.astype("<U96")
        self.light = np.zeros((len(bricks.probes), HARMONICS, 4), np.float32)
        self.inside = np.zeros(len(bricks.probes), np.float32)
        self.seen = np.zeros((len(bricks.places), SEEN_PER_BRICK), np.uint8)
        self.probes = self.bricks = 0

    def add_light(self, light: NDArray[np.float32], inside: NDArray[np.float32]) -> None:
        come = slice(self.probes, self.probes + len(light))
        self.light[come], self.inside[come] = light, inside
        self.probes += len(light)

    def add_seen(self, visibility: NDArray[np.uint8]) -> None:
        self.seen[self.bricks : self.bricks + len(visibility)] = visibility
        self.bricks += len(visibility)

    def write(self, file: Path) -> None:
        probes = {"light": self.light[: self.probes], "inside": self.inside[: self.probes]}
        write_arrays(file, {"key": self._key, **probes, "seen": self.seen[: self.bricks]}, _PARTIAL)

    def read(self, file: Path) -> None:
        """Go on where the file ends, if it is one of the same bake."""
        try:
            arrays = read_arrays(file, _PARTIAL, self._check_lengths)
        except PicaError:
            return
        light, inside = arrays["light"], arrays["inside"]
        sane = np.abs(light).max(initial=0) <= BRIGHTEST and np.isfinite(inside).all()  # the first not for NaN either
        if sane and np.array_equal(arrays["key"], self._key):
            self.add_light(light, inside)
            self.add_seen(arrays["seen"])

    def _check_lengths(self, lengths: Lengths) -> None:
        """Raises ValueError for more than is to be baked."""
        if not (lengths["light"] == lengths["inside"] <= len(self.light) and lengths["seen"] <= len(self.seen)):
            raise ValueError("it is of another bake")

    def light_map(self) -> LightMap:
        bricks, (content, layout, _) = self._brick_layout, self._key
        in_the_open = self.inside < _INSIDE
        neighbours = Neighbours(bricks, self.seen)
        light, variance = self.light[..., :3], self.light[..., 3].sum(-1)
        light = neighbours.spread(neighbours.smooth(light, variance, in_the_open), in_the_open)
        light, in_the_open = without_seams(bricks, light, in_the_open, self.seen)
        scale = float(np.abs(light).max(initial=0)) / _TOP or 1.0
        return LightMap(
            bricks, scale, (light / scale).astype(np.float16), in_the_open, self.seen, str(content), str(layout)
        )
