"""Compares one effect's buffer with its ground truth (Effect.reference), frame by frame of a sequence."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SettingsError
from pica.frame.effect import Effect, Reference
from pica.quality.picture_errors import exposed, exposure_for
from pica.quality.sequences import Sequence, sequence
from pica.quality.sheet import sheet
from pica.renderer import Renderer
from pica.scene.camera import Camera

Layers = dict[str, NDArray[np.float32]]
"""(height, width), or of light (height, width, 3), by name; NaN where undefined."""


class MeasuredEffect:
    """Reads an effect's result of the newest frame, and makes its reference from the same G-buffer."""

    def __init__(self, renderer: Renderer, name: str) -> None:
        """`name`: of an effect that has a reference. Raises SettingsError when the renderer has none of that name."""
        self._renderer = renderer
        effects = {effect.name: effect for effect in renderer.effects if type(effect).reference is not Effect.reference}
        if name not in effects:
            names = ", ".join(effects) or "none"
            raise SettingsError(f"compare --effect {name}: it is off or only seen in whole pictures; there are {names}")
        self._effect = effects[name]

    @property
    def is_light(self) -> bool:
        """Whether it is light, in nits."""
        return self._reference().is_light

    def result(self) -> Layers:
        """The effect's result in the newest frame."""
        captured = self._renderer.captured
        return {name: captured[layer.offer]() for name, layer in self._reference().layers.items()}

    def offers(self) -> frozenset[str]:
        """The captures that `result` needs; called once the frame's structure is known."""
        reference = self._effect.reference()
        return frozenset(layer.offer for layer in reference.layers.values()) if reference else frozenset()

    def reference(self, samples: int) -> Layers:
        """The ground truth from `samples` rays a pixel; NaN where undefined."""
        return self._reference()(self._renderer.render_size, samples, self._renderer.effect_inputs)

    def _reference(self) -> Reference:
        reference = self._effect.reference()
        assert reference is not None  # after a frame
        if not reference.layers:
            fault = "has nothing to compare here, as no light of the scene has a layer of its own"
            raise SettingsError(f"compare --effect {self._effect.name}: {fault}; compare whole pictures instead")
        return reference


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
    """The effect's result in the last frame, and its reference."""

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
    motion: str | Sequence,
    frames: int,
    samples: int,
    camera: Camera | None = None,
    jittered: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> EffectErrors:
    """Render `frames` frames of a sequence and compare one effect in each.

    `motion`: the sequence, or the name of one (`sequences.SEQUENCES`), which then begins with `camera`.
    `jittered`: False samples pixel centres. With jitter each frame samples other positions, so a history is right
    about the pixel and differs at the position: the difference is antialiasing. References take `samples` rays a pixel
    and light. Light is compared as displayed, at the first picture's exposure. Raises SettingsError if the renderer
    does not have the effect.
    """
    measured = MeasuredEffect(renderer, effect)
    if isinstance(motion, str):
        camera = camera or renderer.scene.default_camera(renderer.size[0] / renderer.size[1])
        motion = sequence(motion, renderer.scene, camera)
    errors, before, exposure = EffectErrors(), None, 0.0
    for frame in range(frames):
        color = renderer.advance(motion(frame), jittered=jittered, capture=measured.offers)["color"]
        # No frame is skipped: flicker counts every one.
        result, expected = measured.result(), measured.reference(samples)
        if measured.is_light:
            exposure = exposure or exposure_for(np.asarray(color.to_numpy())[..., :3])
            result, expected = _exposed(result, exposure), _exposed(expected, exposure)
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


def _exposed(light: Layers, exposure: float) -> Layers:
    there = {name: np.isfinite(layer) for name, layer in light.items()}
    return {name: np.where(there[name], exposed(layer, exposure), np.nan) for name, layer in light.items()}


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
    """The last frame for viewing, a row a layer: the effect, its reference, the error five times as strong."""
    result, expected = errors.newest
    rows = []
    for name, reference in expected.items():
        there = np.isfinite(reference)
        layers = {
            f"{name}, {errors.layers[name][-1]:.1f} dB": np.clip(np.where(there, result[name], 0), 0, 1),
            "reference": np.where(there, reference, 0),
        }
        pictures = {title: np.dstack([picture] * 3)[..., :3] for title, picture in layers.items()}
        error = np.where(there, np.abs(result[name] - reference), 0)
        error = error if error.ndim == 2 else error.mean(-1)
        rows.append(sheet({**pictures, "error x 5": np.clip(5 * error, 0, 1)}))
    return np.concatenate(rows)
