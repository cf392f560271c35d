"""The NumPy layouts of gpu_scene/ are those of the shaders, field by field."""

import re

import numpy as np
import pytest

from pica.gpu_scene.geometry_store import NOT_DEFORMED, OF_VIEW, VERTEX
from pica.gpu_scene.lights.emissive_triangles import EMISSIVE_TRIANGLE
from pica.gpu_scene.lights.light_rows import LIGHT_DTYPE
from pica.gpu_scene.materials import COAT, MATERIAL, SLOT
from pica.gpu_scene.previous_frame import PLACE
from pica.gpu_scene.primitive_buffers import BOX
from pica.gpu_scene.table_rows import INSTANCE, NOT_EMISSIVE, RECORD
from pica.rhi.rt_geometry import INSTANCE as RT_INSTANCE
from tests.building import scene_of
from tests.rays import fields_of, gpu_scene
from tests.tracing.kernels import read, run

OTHER_NAMES = {"to_world": "objectToWorld"}


@pytest.fixture(scope="module")
def program(device):
    """One with the scene's block; its types' layouts by name."""
    return device.handle.link_program([device.handle.load_module("gpu_scene/scene.slang")], [])


@pytest.fixture(scope="module")
def structs(program):
    """The layout of a struct of the shaders, by its name."""
    return lambda name: program.layout.get_type_layout(program.layout.find_type_by_name(name))


def described(dtype: np.dtype) -> list[tuple[str, int, int]]:
    def name(field: str) -> str:
        return OTHER_NAMES.get(field) or re.sub("_(.)", lambda found: found[1].upper(), field)

    return [(name(field), dtype.fields[field][1], dtype.fields[field][0].itemsize) for field in dtype.names]


@pytest.mark.parametrize(
    ("struct", "dtype"),
    [
        ("SectionRecord", RECORD),
        ("Instance", INSTANCE),
        ("Place", PLACE),
        ("Vertex", VERTEX),
        ("CoatRow", COAT),
        ("TextureRow", SLOT),
        ("Box", BOX),
        ("Light", LIGHT_DTYPE),
        ("EmissiveTriangle", EMISSIVE_TRIANGLE),
    ],
)
def test_structs_agree(structs, struct, dtype):
    assert described(dtype) == fields_of(structs(struct))
    assert dtype.itemsize == structs(struct).stride


@pytest.mark.parametrize("dtype", [RECORD, INSTANCE, PLACE, VERTEX, LIGHT_DTYPE, MATERIAL])
def test_rows_that_are_read_by_16_bytes(dtype):
    assert dtype.itemsize % 16 == 0


def test_a_row_of_a_material_begins_as_the_struct(structs):
    fields = fields_of(structs("Material"))
    assert described(MATERIAL)[: len(fields)] == fields


READ_MATERIAL = """
import gpu_scene.table_rows;
MaterialRows materials;
RWStructuredBuffer<uint> values;
[shader("compute")] [numthreads(1, 1, 1)]
void main()
{
    Material material = materials[1];
    values[0] = material.flags;
    values[1] = materials.texture(material.sheenRoughnessTexture).uvSet;
    values[2] = material.sheenRoughnessTexture.isUsed ? 1 : 0;
    values[3] = material.sheenColorTexture.isUsed ? 1 : 0;
    values[4] = asuint(materials.coat(1, 2).ior);
    values[5] = materials.parameters(1).numbers[15];
}
"""


def test_shaders_find_what_a_row_of_a_material_holds(device):
    rows = np.zeros(2, MATERIAL)
    row = rows[1]
    row["row"], row["flags"], row["textured"] = 1, 3, 1 << 17
    row["sheen_roughness_texture"]["uv_set"], row["coats"][2]["ior"], row["parameters"][15] = 5, 1.25, 7
    values = device.structured("values", np.zeros(6, np.uint32))
    run(device, READ_MATERIAL, 1, values=values, materials=device.structured("materials", rows))
    assert read(values, np.uint32).tolist() == [3, 5, 1, 0, np.float32(1.25).view(np.uint32), 7]


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
