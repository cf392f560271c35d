"""Optional features of programs: each is a Slang constant, false unless a module
is linked that sets it.

A bundle of features is an entry among the material types in use, because both behave alike: additions to a running
renderer wait until programs with them are compiled beside the frames, and none is removed.
"""

from collections.abc import Set
from dataclasses import fields
from itertools import chain, combinations

import slangpy as spy

from pica.programs.material_types import Bundle, Feature, MaterialTypeSet
from pica.rhi.device import Device
from pica.scene.light import DiskLight, Light, RectangleLight, TubeLight
from pica.scene.material import AlphaMode, Material
from pica.scene.model import Mesh, Scene

_LIGHTS_MODULE = "gpu_scene.lights.lights"
LIGHTS = Feature("lights", _LIGHTS_MODULE, "LIGHTS_IN_USE")
"""Lights with a shape of their own: all but emissive triangles and the environment."""
FLAT_LIGHTS = Feature("flat_lights", _LIGHTS_MODULE, "FLAT_LIGHTS_IN_USE")
TUBES = Feature("tubes", _LIGHTS_MODULE, "TUBES_IN_USE")
ENVIRONMENT = Feature("environment", "gpu_scene.scene", "ENVIRONMENT_IN_USE")
TEXTURES = Feature("textures", "materials.material", "TEXTURES_IN_USE")
EMISSIVE_TEXTURES = Feature("emissive_textures", "materials.material_type", "EMISSIVE_TEXTURES_IN_USE")
"""Only these textures are also read for emitted light, when an emissive triangle is sampled."""
ALPHA = Feature("alpha", "materials.material_types", "ALPHA_IN_USE")
TRANSMISSION = Feature("transmission", "shaders.brdf_parameters", "TRANSMISSION_IN_USE")
DIFFUSE_TRANSMISSION = Feature("diffuse_transmission", "shaders.surface", "DIFFUSE_TRANSMISSION_IN_USE")
COATS = Feature("coats", "shaders.coats", "COATS_IN_USE")
LOBES = Feature("lobes", "shaders.brdf_parameters", "LOBES_IN_USE")
"""Support code of the following lobes, each of which requires it."""
FILMS = Feature("films", "shaders.thin_film", "FILMS_IN_USE")
ANISOTROPY = Feature("anisotropy", "shaders.anisotropy", "ANISOTROPY_IN_USE")
SHEEN = Feature("sheen", "shaders.sheen", "SHEEN_IN_USE")

SPLIT_SUM_ONLY = Feature("split_sum_only", "light_sampling.slot_samples", "SPLIT_SUM_ONLY")
"""Not of scenes, but of settings: set unless `lighting.area_shadows` is ratio."""

_LIT = LIGHTS, FLAT_LIGHTS
_TEXTURED = TEXTURES, EMISSIVE_TEXTURES, ALPHA
_OPAQUE = ENVIRONMENT, *_LIT, *_TEXTURED, TUBES
_MOST = *_OPAQUE, TRANSMISSION, DIFFUSE_TRANSMISSION
_DEAR = (COATS,), (LOBES, FILMS), (LOBES, ANISOTROPY), (LOBES, SHEEN)
"""Lobes that take long to compile, longer together, and longest with transmission."""
_BUNDLED = (
    (),
    (ENVIRONMENT, *_LIT),
    (ENVIRONMENT, *_TEXTURED),
    (ENVIRONMENT, *_LIT, TRANSMISSION, DIFFUSE_TRANSMISSION),
    (ENVIRONMENT, *_LIT, *_TEXTURED),
    _MOST,
    *(
        (*base, *chain(*some))
        for count in range(1, len(_DEAR) + 1)
        for some in combinations(_DEAR, count)
        for base in (_OPAQUE, _MOST)
    ),
)
BUNDLES = tuple(Bundle(tuple(dict.fromkeys(features))) for features in _BUNDLED)
"""Combinations of features, smaller ones first: few, so that scenes share programs."""

Features = frozenset[Feature]
_NONE: Features = frozenset()
_LOBES = ("iridescence", FILMS), ("anisotropy", ANISOTROPY), ("sheen", SHEEN)
_SLOTS = tuple(field.name for field in fields(Material) if field.name.endswith("_texture"))
_MODULE = """
module {name};
import {module};
export public static const bool {constant} = true;
"""


def features_of(material: Material) -> Features:
    """The features that a material requires."""
    values = vars(material)  # twice as fast as checked fields, for each section of each added node
    features = _NONE
    if any([values[slot] is not None for slot in _SLOTS]):
        features |= {TEXTURES}
    if values["emissive_texture"] is not None:
        features |= {EMISSIVE_TEXTURES}
    if values["alpha_mode"] is not AlphaMode.OPAQUE:
        features |= {ALPHA}
    if values["transmission"] > 0:
        features |= {TRANSMISSION}
    if values["diffuse_transmission"] > 0:
        features |= {DIFFUSE_TRANSMISSION}
    if values["coats"]:
        features |= {COATS}
    for lobe, feature in _LOBES:
        if values[lobe] is not None:
            features |= {LOBES, feature}
    return features


def features_of_light(light: Light | None) -> Features:
    """The features that a light requires."""
    match light:
        case None:
            return _NONE
        case RectangleLight() | DiskLight():
            return frozenset((LIGHTS, FLAT_LIGHTS))
        case TubeLight():
            return frozenset((LIGHTS, FLAT_LIGHTS, TUBES))  # a tube's band is flat
        case _:
            return frozenset((LIGHTS,))


def features_of_mesh(mesh: Mesh | None) -> Features:
    """Of all that it shows."""
    return frozenset().union(*(features_of(part.material) for part in ([] if mesh is None else mesh.parts)))


def features_of_environment(scene: Scene) -> Features:
    """Of its environment."""
    return _NONE if scene.environment is None else frozenset((ENVIRONMENT,))


def features_of_scene(scene: Scene) -> Features:
    """Of its lights and its environment."""
    return features_of_environment(scene).union(*(features_of_light(node.light) for node in scene.nodes()))


def supported_features(types: MaterialTypeSet) -> Features:
    """The features of programs for these types."""
    return frozenset(feature for entry in types if isinstance(entry, Bundle) for feature in entry.features)


def with_features(types: MaterialTypeSet, features: Set[Feature]) -> MaterialTypeSet:
    """The types with the smallest bundle that includes these features too."""
    supported = supported_features(types)
    if features <= supported:
        return types
    bundle = next(bundle for bundle in BUNDLES if supported.union(features).issubset(bundle.features))
    others = [bundle if isinstance(entry, Bundle) else entry for entry in types]
    return tuple(others if bundle in others else [*others, bundle])


def feature_modules(device: Device, types: MaterialTypeSet) -> list[spy.SlangModule]:
    """The module to link a program with for the features among these types."""
    return [_module(device, feature) for entry in types if isinstance(entry, Bundle) for feature in entry.features]


def _module(device: Device, feature: Feature) -> spy.SlangModule:
    name = f"feature_{feature.word}"
    return device.module(name, _MODULE.format(name=name, module=feature.module, constant=feature.constant))
