"""The shadow maps of some lights, redrawn when outdated."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.shadow_maps.cascades import Cascades, spheres
from pica.effects.shadow_maps.faces import face_count, light_faces
from pica.effects.shadow_maps.map_array import MapArray
from pica.effects.shadow_maps.map_drawing import MapDrawing, StaleMap
from pica.frame.context import FrameContext, camera_constants
from pica.gpu_scene.masks import shadow_mask
from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.model import Node
from pica.settings import ShadowMapsSettings

# shaders/camera.slang: Camera
VIEW = np.dtype(
    [
        ("position", "f4", 3),
        ("nearPlane", "f4"),
        ("forward", "f4", 3),
        ("farPlane", "f4"),
        ("right", "f4", 3),
        ("orthographic", "u4"),
        ("up", "f4", 3),
        ("pixelSize", "f4"),
        ("shift", "f4", 2),
    ]
)


@dataclass
class _MappedLight:
    """A light and its views, contiguous from `first` on."""

    node: Node
    first: int
    count: int
    cascades: Cascades | None

    @property
    def mask(self) -> int:
        """Mask of its shadow rays."""
        return shadow_mask(self.node.light.lighting_channels) if self.node.light is not None else 0


class MappedLights:
    """Maps of these lights, and their views.

    A map is drawn when one of its possible casters was added, removed, moved or deformed, and a cascade when the
    camera has used up its margin (cascades.py).
    """

    def __init__(self, device: Device, settings: ShadowMapsSettings, nodes: list[Node]) -> None:
        self.nodes = nodes
        self._device, self._settings = device, settings
        self._revision = -1
        self._box = spy.float3(), spy.float3()
        mapped: dict[Node, _MappedLight] = {}
        views = 0
        for node in nodes:
            if isinstance(node.light, DirectionalLight):
                mapped[node] = _MappedLight(node, views, settings.cascades, Cascades(settings))
                views += settings.cascades
        self._cascade_views = views
        for node in nodes:
            if node.light is not None and node not in mapped:
                mapped[node] = _MappedLight(node, views, face_count(node.light), None)
                views += mapped[node].count
        self._lights = [mapped[node] for node in nodes]
        self._cascades = MapArray(device, "cascades", settings.cascade_size, self._cascade_views)
        self._faces = MapArray(device, "shadow map faces", settings.face_size, views - self._cascade_views)
        self._rows = np.zeros(max(views, 1), VIEW)
        self._views = device.structured("shadow map views", self._rows)
        self._slots = device.structured("views of slots", np.zeros((max(len(nodes), 1), 2), np.uint32))
        self._draw = MapDrawing(device, views)

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of map_lookup.slang."""
        return {
            "views": self._views,
            "slotViews": self._slots,
            "cascadeMaps": self._cascades.texture,
            "faceMaps": self._faces.texture,
            "boxLow": self._box[0],
            "boxHigh": self._box[1],
            "cascadeViews": self._cascade_views,
            "cascadeSize": self._cascades.size,
            "faceSize": self._faces.size,
        }

    @property
    def draw_counts(self) -> spy.Buffer:
        """Of the maps drawn last, how many sections each was given: uint32 (maps, 2), opaque ones and others."""
        return self._draw.counts

    def give_back(self) -> None:
        """Book the maps as released."""
        self._device.give_back(self._cascades.texture, self._faces.texture, self._views, self._slots)
        self._draw.give_back()

    def update(self, frame: FrameContext, scene: SceneView) -> None:
        """Record the drawing of outdated maps."""
        stale: list[StaleMap] = []
        if scene.revision != self._revision:
            self._revision = scene.revision
            self._box = _float3(scene.bounds[0]), _float3(scene.bounds[1])
            for light in self._lights:
                if light.cascades is not None:
                    light.cascades.forget()
            stale = self._place_faces(scene)
        stale += self._place_cascades(frame, scene)
        if not stale:
            return
        ranges = np.array([(light.first, light.count) for light in self._lights], np.uint32)
        frame.encoder.upload_buffer_data(self._views, 0, self._rows.view(np.uint8))
        frame.encoder.upload_buffer_data(self._slots, 0, ranges)
        self._draw(frame, scene, self._views, stale)

    def _place_faces(self, scene: SceneView) -> list[StaleMap]:
        stale = []
        radius = float(np.linalg.norm(scene.bounds[1] - scene.bounds[0])) / 2
        for light in self._lights:
            if light.cascades is None and light.node.light is not None:
                faces = light_faces(light.node.light, light.node.world, radius, self._faces.size)
                for view, face in enumerate(faces, light.first):
                    self._set(view, face, self._faces.size)
                    stale.append(StaleMap(view, self._faces, view - self._cascade_views, light.mask))
        return stale

    def _place_cascades(self, frame: FrameContext, scene: SceneView) -> list[StaleMap]:
        stale = []
        aspect = frame.size[0] / frame.size[1]
        for light in self._lights:
            if light.cascades is None:
                continue
            targets = spheres(frame.camera, aspect, scene.bounds, self._settings)
            light.count = len(targets)
            for cascade, view in light.cascades.update(targets, seen_from(light.node), scene.bounds):
                place = light.first + cascade
                self._set(place, view, self._cascades.size)
                stale.append(StaleMap(place, self._cascades, place, light.mask))
        return stale

    def _set(self, view: int, camera: Camera, size: int) -> None:
        for name, value in camera_constants(camera, (size, size)).items():
            self._rows[view][name] = value if isinstance(value, (int, float)) else list(value)


def _float3(corner: NDArray[np.float64]) -> spy.float3:
    return spy.float3(float(corner[0]), float(corner[1]), float(corner[2]))


def seen_from(node: Node) -> Camera:
    """A camera along a directional light."""
    return Camera.look_at(node.world[:3, 2], np.zeros(3))
