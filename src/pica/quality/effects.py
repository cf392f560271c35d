"""One effect's buffer against what it should be, frame by frame of a sequence.

A new effect adds itself to EFFECTS: how its buffer is read, and a reference made from the same G-buffer.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.ambient_occlusion.views import open_share
from pica.effects.shadows.shadows import visibility_layers
from pica.errors import SettingsError
from pica.path_tracer.references import CountedShare
from pica.quality.sequences import sequence
from pica.quality.sheet import sheet
from pica.renderer import Renderer
from pica.scene.camera import Camera

Layers = dict[str, NDArray[np.float32]]
"""(height, width) by name; NaN where there is nothing to compare."""


class MeasuredEffect(ABC):
    """Reads an effect's buffer of the newest frame, and makes its reference."""

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer

    @abstractmethod
    def result(self, buffers: dict[str, spy.Texture]) -> Layers:
        """What the effect gave in the frame whose buffers these are."""

    @abstractmethod
    def reference(self, samples: int) -> Layers:
        """The same from `samples` rays a pixel."""


class MeasuredShadows(MeasuredEffect):
    """The visibility of each single light."""

    def __init__(self, renderer: Renderer) -> None:
        super().__init__(renderer)
        if renderer.shadows is None:
            raise SettingsError("compare --effect shadows: setting shadows.mode is off, so there is nothing to compare")
        self._visibility = CountedShare(
            renderer.device, renderer.size, "light_visibility", "LightVisibility", "surface", renderer.tracer
        )

    def _slots(self) -> dict[str, int]:
        return {f"{name or 'light'} {slot}": slot for slot, name in enumerate(self.renderer.single_lights)}

    def result(self, buffers: dict[str, spy.Texture]) -> Layers:
        """One layer a light."""
        slots = self._slots()
        layers = visibility_layers(buffers["shadows"].to_numpy(), len(slots))
        found = {name: layers[..., slot] for name, slot in slots.items()}
        shadows = self.renderer.shadows
        filtered = shadows.debug_views().get("filtered") if shadows else None
        if filtered is not None:
            for name in list(found)[: filtered.array_length]:
                found[name] = np.asarray(filtered.to_numpy(layer=slots[name]), np.float32)[..., :3].mean(-1)
        return found

    def reference(self, samples: int) -> Layers:
        """One layer a light; NaN where no sample of the light can bring light."""
        return {
            name: self._visibility(samples, slot=slot, **self.renderer.seen) for name, slot in self._slots().items()
        }


class MeasuredOcclusion(MeasuredEffect):
    """The open share of the surroundings."""

    def __init__(self, renderer: Renderer) -> None:
        super().__init__(renderer)
        if renderer.ambient_occlusion is None:
            raise SettingsError(
                "compare --effect ambient_occlusion: setting ambient_occlusion.mode is off, so nothing can be compared"
            )
        self._open = CountedShare(
            renderer.device, renderer.size, "ambient_visibility", "AmbientVisibility", "hit", renderer.tracer
        )

    def result(self, buffers: dict[str, spy.Texture]) -> Layers:
        """One layer."""
        return {"open": open_share(buffers["ambient_occlusion"])}

    def reference(self, samples: int) -> Layers:
        """One layer; NaN where there is no surface."""
        settings = self.renderer.settings.ambient_occlusion
        seen = {name: self.renderer.seen[name] for name in ("frame", "gbuffer", "scene")}
        lengths = {"minDistance": settings.min_distance, "maxDistance": settings.max_distance}
        return {"open": self._open(samples, **seen, **lengths)}


EFFECTS: dict[str, Callable[[Renderer], MeasuredEffect]] = {
    "shadows": MeasuredShadows,
    "ambient_occlusion": MeasuredOcclusion,
}


@dataclass
class EffectErrors:
    """How far an effect was from its reference."""

    psnr: list[float] = field(default_factory=list)
    """dB by frame, over the pixels that have a reference; the signal's peak is 1."""
    layers: dict[str, list[float]] = field(default_factory=dict)
    """The same by layer."""
    change: list[float] = field(default_factory=list)
    """Mean absolute difference to the frame before, from the second frame on."""
    newest: tuple[Layers, Layers] = field(default=({}, {}), repr=False)
    """What the effect gave in the last frame, and its reference."""

    def numbers(self) -> dict[str, Any]:
        """For JSON: means over the frames, and each frame."""
        return {
            "psnr": float(np.mean(self.psnr)),
            "flicker": float(np.mean(self.change)) if self.change else 0.0,
            "layers": {name: float(np.mean(values)) for name, values in self.layers.items()},
            "psnr_by_frame": self.psnr,
            "change_by_frame": self.change,
        }


def compare_effect(
    renderer: Renderer,
    effect: str,
    motion: str,
    frames: int,
    samples: int,
    camera: Camera | None = None,
    jittered: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> EffectErrors:
    """Render `frames` frames of a sequence (`sequences.SEQUENCES`) and compare one effect (`EFFECTS`) in each.

    `jittered`: False looks through the pixels' centres. With jitter each frame shows other places, so that a history
    is right about the pixel and wrong about the place: the difference is antialiasing. References take `samples` rays a
    pixel and light. Raises SettingsError when the renderer does not have the effect.
    """
    measured = EFFECTS[effect](renderer)
    camera = camera or renderer.scene.default_camera(renderer.size[0] / renderer.size[1])
    play = sequence(motion, renderer.scene, camera)
    errors, before = EffectErrors(), None
    for frame in range(frames):
        buffers = renderer.advance(play(frame), jittered)
        # No frame is skipped: flicker counts every one.
        result, expected = measured.result(buffers), measured.reference(samples)
        squares = {name: _squared_error(result[name], expected[name]) for name in expected}
        errors.psnr.append(_decibels(np.concatenate(list(squares.values()))))
        for name, square in squares.items():
            errors.layers.setdefault(name, []).append(_decibels(square))
        if before is not None:
            errors.change.append(_mean_change(before[0], result, expected))
        before = errors.newest = result, expected
        if progress is not None:
            progress(frame + 1, frames)
    return errors


def _squared_error(result: NDArray[np.float32], expected: NDArray[np.float32]) -> NDArray[np.float64]:
    there = np.isfinite(expected)
    return (result[there].astype(np.float64) - expected[there]) ** 2


def _decibels(squares: NDArray[np.float64]) -> float:
    """Peak signal to noise ratio; 120 where nothing differs, or nothing is there."""
    return float(-10 * np.log10(max(squares.mean() if squares.size else 0.0, 1e-12)))


def _mean_change(before: Layers, now: Layers, expected: Layers) -> float:
    changes = [np.abs(now[name] - before[name])[np.isfinite(expected[name])] for name in expected if name in before]
    joined = np.concatenate(changes) if changes else np.zeros(0)
    return float(joined.mean()) if joined.size else 0.0


def error_sheet(errors: EffectErrors) -> NDArray[np.uint8]:
    """The last frame to look at, a row a layer: the effect, its reference, the error five times as strong."""
    result, expected = errors.newest
    rows = []
    for name, reference in expected.items():
        there = np.isfinite(reference)
        grey = {
            f"{name}, {errors.layers[name][-1]:.1f} dB": np.clip(np.where(there, result[name], 0), 0, 1),
            "reference": np.where(there, reference, 0),
        }
        pictures = {title: np.repeat(picture[..., None], 3, axis=-1) for title, picture in grey.items()}
        error = np.where(there, np.abs(result[name] - reference), 0)
        rows.append(sheet({**pictures, "error x 5": np.clip(5 * error, 0, 1)}))
    return np.concatenate(rows)
