"""Channels of KHR_animation_pointer: keys of materials, lights, cameras and visibility become fields over time."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pica.scene.field_channel import FieldChannel, FieldTracks, has_field
from pica.scene.gltf.container import Document
from pica.scene.gltf.curves import Curve, derive
from pica.scene.gltf.element import Element
from pica.scene.gltf.materials import Materials, coefficients
from pica.scene.gltf.pointer_fields import (
    CAMERA,
    EMISSION,
    LIGHT,
    MATERIAL,
    TRANSFORM,
    Derived,
    as_it_is,
    medium,
    texture_transform,
)
from pica.scene.gltf.pointers import VISIBLE, Place, parsed
from pica.scene.gltf.texture_places import TEXTURES
from pica.scene.keyframes import Floats
from pica.scene.light import DirectionalLight, PointLight, SpotLight
from pica.scene.material import Material
from pica.scene.model import Node
from pica.scene.values import BRIGHTEST

_LIGHTS = "extensions/KHR_lights_punctual/lights"
_SEEN = ("visible_to_camera", "visible_to_reflections", "casts_shadows")
_UNLIT = ("base_color", "base_color_texture.transform", "alpha_cutoff")
"""The fields of unlit copies of materials."""
_SWITCH_BYTES = 1000
"""Bytes per node and visibility on which it depends; they bound the time too."""
Switches = dict[str, tuple[float, ...]]
"""Pointers at the visibility of nodes, and what the file has there."""
_CONE = {"spot/innerConeAngle": (0.0,), "spot/outerConeAngle": (math.pi / 4,)}


@dataclass(frozen=True, eq=False)
class Target:
    """Fields of one object that animations set, and the pointers on which they depend."""

    holder: Material | Node
    derived: Derived
    """Its keys are pointers, and their defaults the file's values."""


class FieldTargets:
    """What the pointers of a file's animations set in a scene. Raises SceneError."""

    def __init__(self, document: Document, nodes: dict[Element, Node], materials: Materials) -> None:
        self._document, self._nodes, self._materials = document, nodes, materials
        self._made: dict[tuple[Material | Node, tuple[str, ...]], Target] = {}
        self._targets: dict[str, list[Target]] = {}
        pointers = document.animated_pointers
        self._switches = self._find_switches({pointer for pointer in pointers if pointer.endswith(f"/{VISIBLE}")})
        for pointer in pointers:
            place = parsed(pointer)
            found = None if place is None else self._find(place)
            if found is not None:
                self._targets[pointer] = found
        for node, switches in self._switches.items():
            self._hide(node, switches)

    def get(self, pointer: str) -> list[Target] | None:
        """What a pointer sets in the scene; None if no scene has it."""
        return self._targets.get(pointer)

    def components(self, pointer: str) -> int:
        """The number of components of the key that a pointer, which sets something, points at."""
        return len(self._targets[pointer][0].derived.keys[pointer])

    def _find(self, place: Place) -> list[Target] | None:
        entries = self._lights if place.array == _LIGHTS else self._document.entries(place.array)
        if place.row >= len(entries):
            return None
        match place.array:
            case "materials":
                return self._of_material(entries[place.row], place)
            case "cameras":
                return self._of_cameras(entries[place.row], place)
            case "nodes":
                return [] if place.key == VISIBLE else None
            case _:
                return self._of_lights(place)

    def _target(self, holder: Material | Node, derived: Derived) -> Target:
        return self._made.setdefault((holder, derived.fields), Target(holder, derived))

    def _of_material(self, entry: Element, place: Place) -> list[Target] | None:
        derived = _material_fields(place.key)
        if derived is None:
            return None
        material = self._materials.made.get(entry)
        if material is None:
            return []
        placed = _placed(derived, entry, f"/materials/{place.row}")
        unlit = self._materials.unlit(material) if derived.fields[0] in _UNLIT else None
        return [
            self._target(holder, placed)
            for holder in (material, unlit)
            if holder is not None and all(has_field(holder, field) for field in derived.fields)
        ]

    def _of_cameras(self, entry: Element, place: Place) -> list[Target] | None:
        if place.key == "orthographic/ymag":
            derived = Derived(("camera.orthographic_height",), {place.key: (1.0,)}, _height, frozenset())
        elif place.key in CAMERA:
            derived = as_it_is(place.key, CAMERA[place.key])
        else:
            return None
        placed = _placed(derived, entry, f"/cameras/{place.row}")
        flat = place.key.startswith("orthographic")
        users = self._camera_nodes.get(place.row, ())
        return [self._target(node, placed) for node in users if flat == _is_flat(node)]

    def _of_lights(self, place: Place) -> list[Target] | None:
        if place.key not in {"intensity", *LIGHT, *_CONE}:
            return None
        targets = [self._of_light(node, place) for node in self._light_nodes.get(place.row, ())]
        return [target for target in targets if target is not None]

    def _of_light(self, node: Node, place: Place) -> Target | None:
        """A key of a node's light; None where lights of its type have no such field."""
        if place.key == "intensity":
            return self._strength(node, self._switches.get(node, {}))
        light, entry, base = node.light, self._lights[place.row], f"/{_LIGHTS}/{place.row}"
        if place.key in _CONE:
            fields = "light.inner_cone_angle", "light.outer_cone_angle"
            cone = Derived(fields, _CONE, _angles, frozenset(_CONE))
            return self._target(node, _placed(cone, entry, base)) if isinstance(light, SpotLight) else None
        if place.key == "range" and not isinstance(light, PointLight | SpotLight):
            return None
        return self._target(node, _placed(as_it_is(place.key, LIGHT[place.key]), entry, base))

    def _strength(self, node: Node, switches: Switches) -> Target:
        """The intensity of a node's light, which is 0 where the node is not visible."""
        light = node.light
        name = "illuminance" if isinstance(light, DirectionalLight) else "radiance"
        name = "intensity" if isinstance(light, PointLight | SpotLight) else name
        index = self._light_of.get(node)
        key = f"/{_LIGHTS}/{index}/intensity" if index is not None else ""
        keys = {key: (float(getattr(light, name)),)} | switches
        return self._target(node, Derived((f"light.{name}",), keys, _product, frozenset({key})))

    def _hide(self, node: Node, switches: Switches) -> None:
        """Have a node's mesh and light follow its visibility, and show them as the file does without an animation."""
        targets = [] if node.light is None else [self._strength(node, switches)]
        if node.mesh is not None:
            flags = [Derived((name,), switches, _product) for name in _SEEN if getattr(node, name)]
            targets += [self._target(node, flag) for flag in flags]
        for target in targets:
            for pointer in switches:
                self._targets[pointer].append(target)
        FieldTracks(_channels(targets, self._document, self._document.root, {})).apply(0.0)

    def _find_switches(self, pointers: set[str]) -> dict[Node, Switches]:
        """For each node that animations may hide, the pointers at its visibility and at that of nodes above it."""
        rows = {entry: row for row, entry in enumerate(self._document.entries("nodes"))} if pointers else {}
        found: dict[Node, Switches] = {}
        for entry, node in self._nodes.items() if pointers else ():
            switches = found.get(node.parent, {}) if node.parent is not None else {}
            pointer = f"/nodes/{rows[entry]}/{VISIBLE}"
            if pointer in pointers:
                self._document.take(entry, bytes=_SWITCH_BYTES * (len(switches) + 1))
                visible = entry.extension("KHR_node_visibility").flag("visible", default=True)
                switches = switches | {pointer: (float(visible),)}
            if switches:
                self._document.take(entry, bytes=_SWITCH_BYTES * len(switches))
                found[node] = switches
        return found

    @cached_property
    def _lights(self) -> list[Element]:
        return self._document.root.extension("KHR_lights_punctual").objects("lights")

    @cached_property
    def _light_of(self) -> dict[Node, int]:
        """Indices of lights of KHR_lights_punctual."""
        lit = ((node, entry) for entry, node in self._nodes.items() if node.light is not None)
        extensions = ((node, entry.extension("KHR_lights_punctual")) for node, entry in lit)
        return {node: extension.integer("light") for node, extension in extensions if "light" in extension}

    @cached_property
    def _light_nodes(self) -> dict[int, list[Node]]:
        users: dict[int, list[Node]] = {}
        for node, index in self._light_of.items():
            users.setdefault(index, []).append(node)
        return users

    @cached_property
    def _camera_nodes(self) -> dict[int, list[Node]]:
        users: dict[int, list[Node]] = {}
        for entry, node in self._nodes.items():
            if node.camera is not None:
                users.setdefault(entry.integer("camera"), []).append(node)
        return users


def field_channels(
    targets: FieldTargets, document: Document, entry: Element, curves: Mapping[str, Curve]
) -> list[FieldChannel]:  # fmt: skip
    """The channels of an animation whose pointers have these curves."""
    found = dict.fromkeys(target for pointer in curves for target in targets.get(pointer) or ())
    return _channels(found, document, entry, curves)


def _channels(
    targets: Iterable[Target], document: Document, entry: Element, curves: Mapping[str, Curve]
) -> list[FieldChannel]:
    return [
        FieldChannel(target.holder, field, *curve)
        for target in targets
        for field, curve in derive(target.derived, curves, document, entry).items()
    ]


def _material_fields(key: str) -> Derived | None:
    """The fields that depend on a key of materials."""
    if key in MATERIAL:
        return as_it_is(key, MATERIAL[key])
    info, _, rest = key.partition(f"/extensions/{TRANSFORM}/")
    if info in TEXTURES and rest in ("offset", "rotation", "scale"):
        return texture_transform(info)
    return next((derived for derived in (EMISSION, medium(coefficients)) if key in derived.keys), None)


def _placed(derived: Derived, entry: Element, base: str) -> Derived:
    """The fields, with pointers for keys and the values that they have in the entry."""
    keys = {f"{base}/{key}": _value(entry, key, default) for key, default in derived.keys.items()}
    return derived._replace(keys=keys, linear=frozenset(f"{base}/{key}" for key in derived.linear))


def _value(entry: Element, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
    *above, last = key.split("/")
    for name in above:
        entry = entry.object(name)
    return entry.numbers(last, len(default), default=default) if len(default) > 1 else (_number(entry, last, default),)


def _number(entry: Element, key: str, default: tuple[float, ...]) -> float:
    return entry.number(key) if key in entry else default[0]


def _is_flat(node: Node) -> bool:
    return node.camera is not None and node.camera.orthographic_height is not None


def _product(*factors: Floats) -> tuple[Floats, ...]:
    return (np.clip(np.prod(factors, axis=0), 0, BRIGHTEST),)


def _height(half: Floats) -> tuple[Floats, ...]:
    return (np.maximum(2 * np.abs(half), 1e-6),)


def _angles(inner: Floats, outer: Floats) -> tuple[Floats, ...]:
    """Angles of a cone, the inner one less than the outer one."""
    widest = np.clip(outer, 1e-3, math.pi / 2)
    return np.clip(inner, 0, widest - 1e-4), widest
