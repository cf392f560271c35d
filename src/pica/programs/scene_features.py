"""What programs leave out where a scene does not have it: each feature is a constant of Slang's, false unless a module
is linked that says otherwise.

Features stand among the material types in use, since the same holds for both: what is added to a running renderer waits
until programs that know it are compiled beside the frames, and nothing goes.
"""

from dataclasses import fields

import slangpy as spy

from pica.programs.material_types import Feature, MaterialTypeSet
from pica.rhi.device import Device
from pica.scene.material import Material

TEXTURES = Feature("textures", "materials.material", "TEXTURES_IN_USE")
EMISSIVE_TEXTURES = Feature("emissive_textures", "materials.material_type", "EMISSIVE_TEXTURES_IN_USE")
"""These alone are read for light too, where an emissive triangle is sampled."""
BUNDLES: tuple[MaterialTypeSet, ...] = (), (TEXTURES,), (TEXTURES, EMISSIVE_TEXTURES)
"""What may come together, each holding those before."""

_SLOTS = tuple(field.name for field in fields(Material) if field.name.endswith("_texture"))
_MODULE = """
module {name};
import {module};
export public static const bool {constant} = true;
"""


def features_of(material: Material) -> MaterialTypeSet:
    """What programs must know to show it: one of BUNDLES."""
    if material.emissive_texture is not None:
        return BUNDLES[2]
    values = vars(material)  # half of the time that eight checked fields take, for each section of each node that comes
    return BUNDLES[any([values[slot] is not None for slot in _SLOTS])]


def feature_modules(device: Device, types: MaterialTypeSet) -> list[spy.SlangModule]:
    """What to link with a program so that it knows the features among these types."""
    return [_module(device, entry) for entry in types if isinstance(entry, Feature)]


def _module(device: Device, feature: Feature) -> spy.SlangModule:
    name = f"feature_{feature.word}"
    return device.module(name, _MODULE.format(name=name, module=feature.module, constant=feature.constant))
