"""Changed Slang files: the viewer follows them, and goes on with what it has where they have a fault."""

import time

import numpy as np
import pytest

import pica
from pica.errors import MaterialTypeError, ShaderError
from pica.rhi import slang_sessions
from pica.rhi.slang_files import compiler_faults
from pica.scene import material_registry
from pica.viewer import shader_watch
from pica.viewer.shader_watch import ShaderWatch
from pica.viewer.viewer import Viewer
from tests.viewer.scenes import CAMERA, CANVAS, scene

STEP = "own/step.slang"
WRITES = """
RWStructuredBuffer<float> result;
[shader("compute")] [numthreads(1, 1, 1)]
void main() { result[0] = 1.0; }
"""
PLAIN = """
import materials.material_type;
import colors;
struct Plain : IMaterialType
{
    static void evaluate(MaterialInput input, inout Surface surface) { surface.brdf.baseColor = color(); }
}
"""
COLOR = "module colors; public float3 color() { return float3(0.8, 0.1, 0.1); }"


@pytest.fixture(autouse=True)
def always(monkeypatch):
    """Files are looked at in every call."""
    monkeypatch.setattr(shader_watch, "_EVERY", 0.0)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A folder that is watched in place of the package."""
    folder = tmp_path / "package"
    monkeypatch.setattr(shader_watch, "PACKAGE", folder)
    (folder / "own").mkdir(parents=True)
    (folder / STEP).write_text(WRITES)
    return folder


@pytest.fixture
def colors(package, tmp_path, monkeypatch):
    """A file that the file of a material type imports."""
    monkeypatch.setattr(material_registry, "_registered", {})
    folder = tmp_path / "user"
    folder.mkdir()
    (folder / "plain.slang").write_text(PLAIN)
    (folder / "colors.slang").write_text(COLOR)
    pica.register_material("plain", folder / "plain.slang")
    return folder / "colors.slang"


@pytest.fixture
def viewer(device, colors):
    """Shows a cube of that type."""
    shown = scene()
    [cube] = [node for node in shown.nodes() if node.name == "cube"]
    cube.mesh.sections[0].material = pica.Material(type="plain")
    made = Viewer(shown, settings=pica.Settings.preset("raster"), device=device, frames=1)
    yield made
    made.close()


def picture(viewer, view):
    """The complete one."""
    now = 0.0
    while True:
        shown = viewer.render(view, now := now + 1000.0)
        if viewer.is_complete(view):
            return shown.pixels


def test_the_picture_follows_a_file_and_a_fault_leaves_it_as_it_was(viewer, colors):
    view = viewer.view(CANVAS, CAMERA)
    view.resolution.seconds = 0.0  # in motion always smaller, so a whole picture begins without a history
    red = picture(viewer, view)
    renderer = viewer._renderer.newest
    assert not viewer.follow_shaders() and viewer._renderer.newest is renderer, "no file has changed"

    colors.write_text(COLOR.replace("0.8, 0.1, 0.1", "0.1, 0.1, 0.8"))
    assert viewer.follow_shaders() and not viewer.is_complete(view)
    blue = picture(viewer, view)
    assert np.abs(blue.astype(int) - red[..., ::-1]).mean() < 1 < np.abs(blue.astype(int) - red).mean()

    renderer = viewer._renderer.newest
    colors.write_text(f"\n{COLOR}".replace("float3(", "float4("))
    with pytest.raises(MaterialTypeError, match=rf"{colors}:2: .*float4"):
        viewer.follow_shaders()
    assert not viewer.follow_shaders(), "once a change"
    assert viewer.is_complete(view) and viewer._renderer.newest is renderer
    view.control.orbit(0.1, 0)
    picture(viewer, view)
    view.control.orbit(-0.1, 0)
    np.testing.assert_array_equal(picture(viewer, view), blue)

    colors.write_text(COLOR)
    assert viewer.follow_shaders()
    np.testing.assert_array_equal(picture(viewer, view), red)


def test_a_fault_before_the_first_picture_is_mended(viewer, colors):
    colors.write_text("nothing")
    assert viewer.follow_shaders()
    view = viewer.view(CANVAS, CAMERA)
    with pytest.raises(MaterialTypeError, match=f"{colors}:1: "):
        picture(viewer, view)
    colors.write_text(COLOR)
    assert viewer.follow_shaders()
    assert picture(viewer, view).std() > 5


def test_renewed_programs_are_those_of_the_files_and_the_old_ones_stay(device, package, monkeypatch):
    monkeypatch.setitem(slang_sessions.COMPILER, "include_paths", [package, slang_sessions.PACKAGE])

    def result_of(step):
        result = device.buffer("result", size=4, struct_size=4)
        with device.record() as recording:
            step(recording, (1, 1, 1), result=result)
        device.give_back(result)
        return float(result.to_numpy().view(np.float32)[0])

    before = device.renewed().compute(STEP)
    assert result_of(before) == 1
    (package / STEP).write_text(WRITES.replace("1.0", "2.0"))
    assert result_of(device.renewed().compute(STEP)) == 2 and result_of(before) == 1
    (package / STEP).write_text(WRITES.replace("1.0", "nothing"))
    fault = rf"^{package / STEP}:4: undefined identifier 'nothing'\.$"
    with pytest.raises(ShaderError, match=fault), compiler_faults():
        _ = device.renewed().compute(STEP).pipeline


def test_a_file_that_is_away_for_a_moment_is_still_watched(package):
    watch = ShaderWatch()
    (package / STEP).unlink()
    assert watch.take() and not watch.take()
    (package / STEP).write_text(WRITES)
    assert watch.take() and not watch.take()


def test_new_files_are_watched_from_the_next_change_on(package):
    watch = ShaderWatch()
    (package / "more.slang").write_text("")
    assert not watch.take()
    (package / STEP).write_text(f"import more;\n{WRITES}")
    assert watch.take()
    (package / "more.slang").write_text("int more;")
    assert watch.take()


def test_files_are_looked_at_twice_a_second(package, monkeypatch):
    monkeypatch.setattr(shader_watch, "_EVERY", 0.5)
    now = time.perf_counter()
    monkeypatch.setattr(time, "perf_counter", lambda: now)
    watch = ShaderWatch()
    (package / STEP).write_text("")
    assert not watch.take()
    now += 0.5
    assert watch.take()
