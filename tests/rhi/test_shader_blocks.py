"""The parameter blocks that are read from a shader's text are those that its program has."""

from pathlib import Path

import pytest
import slangpy as spy

import pica
from pica.rhi.binding import parameters_of
from pica.rhi.recipes import linked
from pica.rhi.shader_blocks import blocks_of
from pica.rhi.slang_files import SlangFile

PACKAGE = Path(pica.__file__).parent
STEPS = (
    "effects/post/tone_map.slang",
    "effects/reflections/apply_correction.slang",
    "effects/shadows/footprint.slang",
    "frame/half_gbuffer.slang",
    "filtering/reprojection.slang",
)


@pytest.mark.parametrize("step", STEPS)
def test_a_step_has_the_blocks_of_its_imports(device, step):
    kinds = {each.name: each.type_layout.kind for each in parameters_of(linked(device, step, ["main"]))}
    blocks = {name for name, kind in kinds.items() if kind == spy.TypeReflection.Kind.parameter_block}
    assert blocks_of(step) == blocks


def test_a_file_beside_is_followed(tmp_path):
    (tmp_path / "beside.slang").write_text("import frame.gbuffer;\n")
    (tmp_path / "own.slang").write_text("import beside;\nParameterBlock<Own> own;\n// import gpu_scene.scene;\n")
    assert blocks_of(SlangFile.read(tmp_path / "own.slang")) == {"own", "gbuffer", "frame"}


def test_a_module_without_a_file_has_none_that_are_known():
    assert blocks_of("loaded_from_text") == frozenset()
