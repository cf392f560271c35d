"""Hit groups: the any-hit, closest-hit and intersection shaders of a material type, or of a shape with one on it.

Their entry points are the same few lines for every type, so they are written here once.
"""

from dataclasses import dataclass
from typing import Literal

import slangpy as spy

from pica.programs.material_types import MaterialType, MaterialTypes, ShapeOn
from pica.programs.shape_types import ShapeTypes
from pica.rhi.device import Device
from pica.scene.material_registry import MaterialSource

HitDetail = Literal["hit", "surface"]
"""The detail of hits that an effect needs: position alone, or the evaluated surface too (ray_effect.slang)."""
_SLANG_BOOL = {True: "true", False: "false"}
_PASSING = {"hit": "payload.hit.primitive", "surface": "payload.primitive"}
"""Where payloads carry Ray.passing on their way in."""
_ANY_HIT = """
import tracing.ray_effect;
import {alias};
[shader("anyhit")]
void any_{name}(inout {payload} payload, BuiltInTriangleIntersectionAttributes attributes)
{{
    if (ignoresTriangle<{struct}>(attributes.barycentrics, payload.seed, {passing}))
        IgnoreHit();
}}
"""
_CLOSEST_HIT = """
[shader("closesthit")]
void closest_{name}(inout PackedSurface payload, BuiltInTriangleIntersectionAttributes attributes)
{{
    payload = closestSurface<{struct}, {simplified}>(attributes.barycentrics, payload.cone);
}}
"""
_SHAPE_HIT = """
import tracing.shape_hits;
import {shape_alias};
import {material_alias};
[shader("intersection")]
void intersect_{name}() {{ reportCrossings<{shape}>(); }}
[shader("anyhit")]
void any_{name}(inout {payload} payload, ShapeAttributes attributes)
{{
    if (ignoresShape<{material}, {shape}>(payload.seed, {passing}))
        IgnoreHit();
}}
"""
_SHAPE_CLOSEST_HIT = """
[shader("closesthit")]
void closest_{name}(inout PackedSurface payload, ShapeAttributes attributes)
{{
    payload = closestShape<{material}, {shape}, {simplified}>(payload.cone);
}}
"""


@dataclass(frozen=True)
class HitGroup:
    """A hit group, and the modules that a program must be linked with for it."""

    group: spy.HitGroupDesc
    modules: list[spy.SlangModule]
    entries: list[spy.SlangEntryPoint]


def hit_group(device: Device, entry: MaterialSource | ShapeOn, detail: HitDetail, simplified: bool) -> HitGroup:
    """The hit group of an entry of a MaterialTypeSet."""
    types = device.shared(MaterialTypes)
    if isinstance(entry, ShapeOn):
        return _of_shape(device, entry, types[entry.material], detail, simplified)
    return _of_triangles(device, types[entry], detail, simplified)


def _of_triangles(device: Device, material: MaterialType, detail: HitDetail, simplified: bool) -> HitGroup:
    source, payload, name = _ANY_HIT, "HitPayload", f"{detail}_{material.alias}"
    if detail == "surface":
        source, payload = _ANY_HIT + _CLOSEST_HIT, "PackedSurface"
        name += "_simplified" if simplified else ""
    text = source.format(
        alias=material.alias,
        name=material.name,
        struct=material.struct,
        payload=payload,
        passing=_PASSING[detail],
        simplified=_SLANG_BOOL[simplified],
    )
    module = device.module(name, text)
    any_hit, closest = f"any_{material.name}", f"closest_{material.name}"
    own = [any_hit, closest] if detail == "surface" else [any_hit]
    group = spy.HitGroupDesc(
        hit_group_name=material.name,
        closest_hit_entry_point=closest if detail == "surface" else "hitClosest",
        any_hit_entry_point=any_hit,
    )
    return HitGroup(group, [module], [module.entry_point(entry) for entry in own])


def _of_shape(device: Device, pair: ShapeOn, material: MaterialType, detail: HitDetail, simplified: bool) -> HitGroup:
    shape = device.shared(ShapeTypes)[pair.shape]
    name = f"{shape.name}_on_{material.name}"
    text = (_SHAPE_HIT if detail == "hit" else _SHAPE_HIT + _SHAPE_CLOSEST_HIT).format(
        name=name,
        shape_alias=shape.alias,
        material_alias=material.alias,
        shape=shape.struct,
        material=material.struct,
        passing=_PASSING[detail],
        payload="HitPayload" if detail == "hit" else "PackedSurface",
        simplified=_SLANG_BOOL[simplified],
    )
    kind = f"{detail}_simplified" if simplified else detail
    module = device.module(f"{kind}_{shape.alias}_{material.alias}", text)
    shared = device.module("tracing/shape_hits.slang")
    closest = "hitClosestShape" if detail == "hit" else f"closest_{name}"
    entries = [module.entry_point(f"{step}_{name}") for step in ("intersect", "any")]
    entries.append((shared if detail == "hit" else module).entry_point(closest))
    group = spy.HitGroupDesc(
        hit_group_name=pair.name,
        closest_hit_entry_point=closest,
        any_hit_entry_point=f"any_{name}",
        intersection_entry_point=f"intersect_{name}",
    )
    return HitGroup(group, [module, shared], entries)
