"""The NumPy layouts of gpu_scene/ are those of the shaders, field by field."""

import re

import numpy as np
import pytest

from pica.gpu_scene.geometry import NOT_DEFORMED, OF_VIEW, VERTEX
from pica.gpu_scene.lights.emissive_triangles import EMISSIVE_TRIANGLE
from pica.gpu_scene.lights.light_rows import LIGHT_DTYPE
from pica.gpu_scene.materials import MATERIAL, SLOT
from pica.gpu_scene.previous_frame import PLACE
from pica.gpu_scene.primitive_buffers import BOX
from pica.gpu_scene.table_rows import INSTANCE, NOT_EMISSIVE, RECORD
from pica.rhi.acceleration import INSTANCE as RT_INSTANCE
from pica.rhi.binding import parameters_of
from tests.building import scene_of
from tests.rays import fields_of, gpu_scene
from tests.tracing.kernels import read, run

OTHER_NAMES = {"to_world": "objectToWorld"}


@pytest.fixture(scope="module")
def elements(device):
    """The element type of every structured buffer of the scene."""
    program = device.handle.link_program([device.handle.load_module("gpu_scene/scene.slang")], [])
    block = next(parameter for parameter in parameters_of(program) if parameter.name == "scene")
    fields = block.type_layout.element_type_layout.fields
    return {field.name: field.type_layout.element_type_layout for field in fields if "Buffer" in field.type_layout.name}


def described(dtype: np.dtype) -> list[tuple[str, int, int]]:
    def name(field: str) -> str:
        return OTHER_NAMES.get(field) or re.sub("_(.)", lambda found: found[1].upper(), field)

    return [(name(field), dtype.fields[field][1], dtype.fields[field][0].itemsize) for field in dtype.names]


@pytest.mark.parametrize(
    ("buffer", "dtype"),
    [
        ("records", RECORD),
        ("instances", INSTANCE),
        ("previousPlaces", PLACE),
        ("vertices", VERTEX),
        ("materials", MATERIAL),
        ("boxes", BOX),
        ("lights", LIGHT_DTYPE),
        ("emissiveTriangles", EMISSIVE_TRIANGLE),
    ],
)
def test_structs_agree(elements, buffer, dtype):
    assert described(dtype) == fields_of(elements[buffer])
    assert dtype.itemsize == elements[buffer].stride


def test_texture_slots_agree(elements):
    slots = [field.type_layout for field in elements["materials"].fields if field.name.endswith("Texture")]
    assert len(slots) == 16
    for slot in slots:
        assert described(SLOT) == fields_of(slot)
        assert SLOT.itemsize == slot.stride


def test_plain_buffers_agree(elements):
    sizes = {name: elements[name].stride for name in ("positions", "indices", "shapeNumbers", "lightCumulative")}
    assert sizes == {"positions": 12, "indices": 4, "shapeNumbers": 4, "lightCumulative": 4}


def test_instance_of_the_driver_is_64_bytes():
    assert RT_INSTANCE.itemsize == 64 and RT_INSTANCE.fields["handle"][1] == 56


def test_flags_and_constants_agree(device):
    from pica.gpu_scene import materials

    names = (
        "NOT_EMISSIVE",
        "NOT_DEFORMED",
        "OF_VIEW",
        "MATERIAL_MASK",
        "MATERIAL_BLEND",
        "MATERIAL_DOUBLE_SIDED",
        "MATERIAL_UNLIT",
    )
    source = 'import gpu_scene.scene;\nRWStructuredBuffer<uint> values;\n[shader("compute")] [numthreads(1, 1, 1)]\n'
    source += "void main() { " + " ".join(f"values[{i}] = {name};" for i, name in enumerate(names)) + " }"
    values = device.structured("values", np.zeros(len(names), np.uint32))
    run(device, source, 1, values=values, scene=gpu_scene(device, scene_of()))
    ours = [
        NOT_EMISSIVE,
        NOT_DEFORMED,
        OF_VIEW,
        materials._MASK,
        materials._BLEND,
        materials._DOUBLE_SIDED,
        materials._UNLIT,
    ]
    assert read(values, np.uint32).tolist() == ours
