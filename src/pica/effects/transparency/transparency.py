"""Transmissive and blended surfaces: what is seen through them and in them (RTG 19, 19.3.4)."""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.transparency.screen_glass import LAYERS, ScreenGlass
from pica.frame.effect import Effect, rgb
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.frame.signals.shadows import ShadowTextures
from pica.gpu_scene.material_traits import ROUGH
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, History, Texture, update, write
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.scene.material import Material
from pica.settings import TransparencySettings
from pica.texture_space.map_paths import MapPaths
from pica.texture_space.texture_maps import MappedKind
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect

_FOLDER = "effects/transparency"
_TEXEL = 64
"""Bytes: GlassTexel of glass_map_rays.slang."""
_MAPPED = {"off": 0, "rough": 1, "all": 2}
"""rough_glass.slang: MAPPED_NONE and so on."""


class Seen(NamedTuple):
    """What the stage hands on."""

    radiance: Texture
    """(width, height, rgba32_float) nits; alpha as transparency_rays.slang has it."""

    glass: History | None
    """"glassMotion": (width, height, rgba32_uint), as there; None without transmissive surfaces."""


def _kind(texture_space: str) -> MappedKind:
    def is_mapped(material: Material) -> bool:
        return material.transmission > 0 and (texture_space == "all" or material.roughness >= ROUGH)

    return MappedKind(has_light=lambda material: material.transmission > 0, is_mapped=is_mapped, look=_look)


def _look(material: Material) -> tuple[object, ...]:
    bends = material.ior, material.dispersion, material.roughness, material.thin_walled
    return *bends, material.absorption, id(material.metallic_roughness_texture)


def _count(glass: NDArray[np.uint32]) -> int:
    """How many pixels send rays."""
    return int(np.count_nonzero(glass[..., 0]))


class Transparency(Effect):
    """Paths from the camera through transmissive surfaces, and rays through layers of blended ones: the G-buffer leaves
    both out. Layers in front of a transmissive surface are drawn over it; those behind it are met by chance.
    Without rays: ScreenGlass."""

    name = "transparency"
    aov_names = ("transmission",)

    def __init__(
        self, device: Device, settings: TransparencySettings, tracer: Tracer | None, cache: str | None, filters: bool
    ) -> None:
        """`cache`: the module of the cache of indirect light, if calls pass one. `filters`: DebugSettings.filters."""
        self._device, self._tracer, self._cache = device, tracer, cache
        self._settings, self._filters = settings, filters

    @staticmethod
    def glass_layers(settings: TransparencySettings) -> int:
        """Layers of transmissive surfaces that the G-buffer has to rasterize; 0: it only says where there are any."""
        return LAYERS if settings.mode == "screen_space" else 0

    # Made for the first scene that needs them: others need not compile them.
    @cached_property
    def _screen(self) -> ScreenGlass:
        return ScreenGlass(self._device)

    @cached_property
    def _trace(self) -> RayEffect:
        return self._effect("transparency_rays", "TransparencyRays", "surface")

    @cached_property
    def _paths(self) -> MapPaths:
        return MapPaths(self._device, _kind(self._settings.texture_space), self._settings.map_size, 0)

    @cached_property
    def _trace_maps(self) -> RayEffect:
        return self._effect("glass_map_rays", "GlassMapRays", "surface")

    @cached_property
    def _filter_rough(self) -> ComputePass:
        return self._device.compute(f"{_FOLDER}/rough_glass_filter.slang")

    @cached_property
    def _trace_layers(self) -> RayEffect:
        return self._effect("layer_rays", "LayerRays", "hit")

    @cached_property
    def _apply_layers(self) -> ComputePass:
        return self._device.compute(f"{_FOLDER}/layer_apply.slang")

    def __call__(
        self,
        graph: FrameGraph,
        scene: SceneView,
        gbuffer: GBuffer,
        samples: LightSamples,
        indirect: IndirectResult | None,
        shadows: ShadowTextures | None,
        radiance: Texture,
        exposure: Buffer,
    ) -> Seen:
        """`radiance`, complete light towards the camera of what the G-buffer has, with the rest (width, height,
        rgba32_float, nits; alpha as transparency_rays.slang has it).

        `exposure`: as Post.exposure."""
        with graph.scope(self.name):
            if gbuffer.glass is None:
                graph.offer("transmission", (radiance,), lambda light: np.zeros_like(rgb(light)))
                return Seen(radiance, None)
            lit = samples.at_hits(regularized=self._filters)
            inputs = {
                **lit,
                **(indirect.cache.values if indirect and indirect.cache else {}),
                "glass": gbuffer.glass,
                "radiance": radiance,
            }
            seen, glass, by_rays = radiance, None, self._settings.mode == "ray_traced"
            layers = self._layers(graph) if scene.shows_layers else None
            in_front, maps = None, shadows.maps if shadows else None
            if layers is not None and not by_rays:
                in_front = self._screen.in_front(graph, gbuffer, radiance, layers, lit, maps)
            if scene.shows_glass:
                glass = graph.history("glass", {"glassMotion": spy.Format.rgba32_uint})
                if by_rays:
                    seen = self._through_glass(graph, scene, glass, radiance, exposure, inputs)
                else:
                    seen = self._screen.through(graph, gbuffer, glass, radiance, in_front, lit, maps)
            if layers is not None and by_rays:
                written = {name: write(texture) for name, texture in layers.items()}
                graph.add(self._trace_layers, graph.size, **inputs, **written, layers=self._settings.layers)
            if layers is not None:
                seen = self._over(graph, seen, layers)
            graph.offer("transmission", (seen, radiance), lambda after, before: rgb(after) - rgb(before))
            for name in ["transparency_rays"] * (scene.shows_glass and by_rays) + ["layer_rays"] * (
                scene.shows_layers and by_rays
            ):
                graph.offer(f"rays.{name}", (gbuffer.glass,), _count, on_request=True)
        return Seen(seen, glass)

    def reset(self) -> None:
        """Forget the maps' light."""
        if "_paths" in self.__dict__:
            self._paths.reset()

    def _through_glass(
        self,
        graph: FrameGraph,
        scene: SceneView,
        glass: History,
        radiance: Texture,
        exposure: Buffer,
        inputs: dict[str, Any],
    ) -> Texture:
        paths, mode = self._paths, self._settings.texture_space
        separates = scene.shows_rough_glass or mode == "all"
        wanted = mode != "off" and separates
        texels = paths.light(graph, wanted)
        last_moving = graph.buffer("last moving", 2 * 4 * paths.maps.room, struct_size=4)
        graph.clear(last_moving, when=lambda frame: frame.first)
        inputs = {**inputs, "surfaces": self._settings.surfaces, "mapped": _MAPPED[mode] if wanted else 0}
        if wanted:
            paths.follow(graph, scene, True)
            more = {"exposure": exposure, "unchanged": paths.unchanged, "lastMoving": update(last_moving)}
            on_screen = {name: value for name, value in inputs.items() if name != "glass"}
            paths.trace(graph, texels, self._trace_maps, "glass_map_rays", _TEXEL, **on_screen, **more)
            graph.offer("debug.transparency.maps", (texels.texels,), lambda values: values[..., :3], on_request=True)
        else:
            graph.provide(textureMaps=paths.maps)
        seen = graph.texture("seen", spy.Format.rgba32_float)
        size = graph.size if separates else (1, 1)
        light = {name: graph.texture(name, spy.Format.rgba32_float, size) for name in ("passed", "reflected")}
        first = {
            "passedShare": graph.texture("passedShare", spy.Format.rg32_uint, size),
            "firstGlass": graph.texture("firstGlass", spy.Format.rgba32_uint, size),
        }
        graph.add(
            self._trace,
            graph.size,
            **inputs,
            **{name: write(texture) for name, texture in (first | light).items()},
            texels=texels.texels,
            lastSeen=update(texels.last_seen),
            lastMoving=last_moving,
            number=texels.number,
            separates=int(separates),
            seen=write(seen),
            known=glass.known,
            **glass.swap(),
        )
        if not separates:
            return seen
        whole = graph.texture("seen with rough glass", spy.Format.rgba32_float)
        graph.add(
            self._filter_rough,
            graph.grid,
            **first,
            **light,
            beside=seen,
            seen=write(whole),
            filtered=int(self._filters),
        )
        return whole

    def _layers(self, graph: FrameGraph) -> dict[str, Texture]:
        """The outputs of layer_sum.slang."""
        return {
            name: graph.texture(name, spy.Format.rg32_float if name == "layerBefore" else spy.Format.rgba32_float)
            for name in ("layerLight", "layerAlbedo", "layerReflection", "layerBefore")
        }

    def _over(self, graph: FrameGraph, beneath: Texture, layers: dict[str, Texture]) -> Texture:
        """Layers of blended surfaces over a picture."""
        seen = graph.texture("seen with layers", spy.Format.rgba32_float)
        history = graph.history("layers", {"light": spy.Format.rgba32_float})
        light, state = history.textures["light"], history.state
        graph.add(
            self._apply_layers,
            graph.grid,
            **layers,
            beneath=beneath,
            previousHistory=light.previous,
            history=write(light),
            known=lambda frame: int(state.precedes(frame)),
            filtered=int(self._filters),
            seen=write(seen),
        )
        return seen

    def _effect(self, file: str, effect: str, detail: Any) -> RayEffect:
        module = f"{_FOLDER}/{file}.slang"
        return ray_effect(self._device, module, effect, detail, self._tracer, with_module=self._cache)
