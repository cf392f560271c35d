"""What may go wrong with passes of a program's own is one line, and the renderer goes on without them."""

import gc
import re
import weakref
from functools import partial

import numpy as np
import pytest
import slangpy as spy

import pica
from pica.errors import BindingError, GraphError, PicaError, ShaderError
from pica.graph import update, write
from pica.renderer.frame import STAGES, declare
from pica.rhi.slang_files import SlangFile

FILL = """import frame.constants;
RWTexture2D<float4> target;
float3 color;

[shader("compute")]
[numthreads(8, 8, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    if (frame.contains(thread.xy))
        target[thread.xy] = float4(color, 1);
}
"""


@pytest.fixture(scope="module")
def scene():
    return pica.scenes.cornell()


@pytest.fixture(scope="module")
def renderer(device, scene):
    with pica.Renderer(scene, size=(32, 18), device=device, settings=pica.Settings.preset("raster")) as made:
        yield made


@pytest.fixture
def slang(tmp_path):
    """Writes a Slang file."""

    def written(text, name="fill.slang"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return written


@pytest.fixture
def insert(renderer):
    """Renderer.insert, for one test."""
    made = []

    def inserted(declare, after="composite", **more):
        made.append(renderer.insert(declare, after, **more))
        return made[-1]

    yield inserted
    for each in made:
        each.remove()


def filling(renderer, slang, color=(1.0, 2.0, 3.0), **more):
    step, shown = pica.compute_pass(renderer.device, slang(FILL)), color and spy.float3(*color)

    def fill(graph, signals):
        given = {"frame": graph.frame, "target": update(signals.radiance), "color": shown}
        given = {name: value for name, value in (given | more).items() if value is not None}
        graph.add(step, graph.grid, **given)

    return fill


def test_every_stage_can_be_followed(renderer, insert):
    heard, there = [], {}

    def listen(stage, graph, signals):
        heard.append(stage)
        there[stage] = [name for name in ("gbuffer", "radiance", "picture", "display") if hasattr(signals, name)]

    for stage in reversed(STAGES):
        insert(partial(listen, stage), stage, name=f"after {stage}")
    renderer.render(1)
    assert tuple(heard) == STAGES
    assert there["gbuffer"] == there["ambient_occlusion"] == ["gbuffer"]
    assert there["lighting"] == there["reflections"] == ["gbuffer"] and there["composite"] == ["gbuffer", "radiance"]
    assert there["transparency"] == there["composite"]
    assert there["antialiasing"] == ["gbuffer", "radiance", "picture"] and there["post"][-1] == "display"
    renderer.render(2)
    assert tuple(heard) == STAGES, "a frame like the one before is not declared again"
    assert all(f'"{stage}"' in pica.Renderer.insert.__doc__ for stage in STAGES) and declare.__doc__


def test_those_of_one_stage_come_in_the_order_in_which_they_were_inserted(renderer, insert, slang):
    insert(filling(renderer, slang, (1.0, 1.0, 1.0)), "composite", name="white")
    insert(filling(renderer, slang, (0.0, 0.0, 5.0)), "composite", name="blue")
    found = renderer.render(1, cut=True).color
    np.testing.assert_allclose(found, np.broadcast_to(np.float32([0, 0, 5]), found.shape), atol=1e-5)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"after": "light"}, "insert: after: 'light'.*lighting.*post"),
        ({"after": None}, "insert: after: None"),
        ({"declare": "outline"}, "insert: 'outline' cannot be called"),
        ({"name": "shadows"}, "there is an effect 'shadows' already; give another name="),
        ({"name": "a/b"}, "insert: name: 'a/b'"),
        ({"name": 3}, "insert: name: 3"),
    ],
)
def test_what_cannot_be_inserted(renderer, given, says):
    with pytest.raises(PicaError, match=says) as fault:
        renderer.insert(**({"declare": lambda graph, signals: None, "after": "lighting"} | given))
    assert "\n" not in str(fault.value)


def test_one_name_is_one_effect_s(renderer, insert):
    insert(lambda graph, signals: None, name="mist")
    with pytest.raises(PicaError, match="'mist' already"):
        insert(lambda graph, signals: None, name="mist")


def test_faults_of_a_file_are_one_line_with_the_line(renderer, slang):
    path = slang(FILL.replace("float4(color, 1)", "float4(colour, 1)"))
    with pytest.raises(ShaderError, match=f"^{re.escape(str(path))}:10: undefined identifier 'colour'") as fault:
        pica.compute_pass(renderer.device, path)
    assert "\n" not in str(fault.value)
    slang(FILL)  # mended, under the same name
    assert pica.compute_pass(renderer.device, path).pipeline


def test_faults_of_an_imported_file_name_that(renderer, slang):
    beside = slang("module helper_of_fill;\npublic float twice(float x) { return y; }\n", "helper_of_fill.slang")
    with pytest.raises(ShaderError, match=f"{re.escape(str(beside))}:2: .*'y'"):
        pica.compute_pass(renderer.device, slang("import helper_of_fill;\n" + FILL))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (
            lambda renderer, path: pica.compute_pass(renderer.device, path, "other"),
            "fill.slang: no entry point",
        ),
        (lambda renderer, path: pica.compute_pass(renderer.device, path.parent), "Is a directory"),
        (lambda renderer, path: pica.compute_pass(renderer.device, path.with_name("no.slang")), "no.slang: No such"),
        (lambda renderer, path: pica.compute_pass(renderer.device, 3), "3 is not the path of a Slang file"),
        (lambda renderer, path: pica.compute_pass(renderer, path), "compute_pass: device"),
        (lambda renderer, path: pica.ray_pass(renderer, path, "Rays", "all"), "ray_pass: detail: 'all'"),
        (lambda renderer, path: pica.ray_pass(renderer, path, "Rays"), "fill.slang: no struct 'Rays'"),
    ],
)
def test_what_no_pass_can_be_made_of(renderer, slang, make, says):
    with pytest.raises(PicaError, match=says) as fault:
        make(renderer, slang(FILL))
    assert "\n" not in str(fault.value)


def test_a_struct_that_is_no_ray_effect(renderer, slang):
    path = slang("import tracing.ray_effect;\nstruct Rays { uint count; };\n")
    with pytest.raises(PicaError, match="Rays"):
        pica.ray_pass(renderer, path, "Rays")


def stray(graph, signals):
    signals.picture = graph.texture("small", spy.Format.rgba32_float, (2, 2))


def no_texture(graph, signals):
    signals.radiance = "red"


def other_format(graph, signals):
    signals.display = graph.texture("display", spy.Format.rgba32_float, graph.output_size)


def other_part(graph, signals):
    signals.parts.append(graph.texture("part", spy.Format.rgba32_float))


def many_parts(graph, signals):
    for number in range(9):
        part = graph.texture(f"part {number}", spy.Format.rg32_uint)
        graph.clear(part)
        signals.parts.append(part)


def never_written(graph, signals):
    texture = graph.texture("empty", spy.Format.r32_float)
    graph.record("look", lambda frame, texture: None, texture=texture)


def twice(graph, signals):
    for _ in range(2):
        graph.record("write", lambda frame, target: None, target=write(signals.radiance))


@pytest.mark.parametrize(
    ("declare", "after", "says"),
    [
        (stray, "antialiasing", "stray: signals.picture is 2x2, not 32x18 texels"),
        (no_texture, "composite", "no_texture: signals.radiance is 'red', not a texture"),
        (other_format, "post", "signals.display is rgba32_float, not rgba8_unorm"),
        (never_written, "lighting", "'look' of never_written .*test_insert.py:.* reads .*, which no pass writes"),
        (twice, "composite", "'write' of twice .* writes composite 'radiance'.* use update"),
        (other_part, "reflections", "other_part: signals.parts has .*, not a texture of 32x18 texels of rg32_uint or"),
        (many_parts, "reflections", "composite: 10 parts of rg32_uint; it sums at most 8"),
    ],
)
def test_what_does_not_fit_the_graph_is_said_in_each_frame_until_it_is_out(renderer, insert, declare, after, says):
    before = renderer.render(1, cut=True).color
    inserted = insert(declare, after)
    for _ in range(2):
        with pytest.raises(GraphError, match=says) as fault:
            renderer.render(1)
        assert "\n" not in str(fault.value)
    inserted.remove()
    np.testing.assert_array_equal(renderer.render(1, cut=True).color, before)


def test_a_texture_is_of_one_declaration(renderer, insert):
    kept = []

    def remembers(graph, signals):
        kept.append(graph.texture("kept", spy.Format.r32_float))
        graph.record("fill", lambda frame, target: None, target=write(kept[-1]))
        graph.record("look", lambda frame, texture: None, texture=kept[0])

    inserted = insert(remembers)
    renderer.render(1)
    inserted.renew()
    with pytest.raises(GraphError, match=r"look.* remembers 'kept' .* of another graph"):
        renderer.render(1)


@pytest.mark.parametrize(
    ("given", "says"),
    [({"shade": 1.0}, "fill: no parameter 'shade'; it has color"), ({"color": None}, "fill: not bound: color")],
)
def test_parameters_that_a_pass_lacks(renderer, insert, slang, given, says):
    inserted = insert(filling(renderer, slang, **given))
    for _ in range(5):
        with pytest.raises(BindingError, match=says):
            renderer.render(1)
    inserted.remove()
    frame = renderer.render(1, cut=True)
    assert np.isfinite(frame.color).all() and frame.timings, "frames that were given up took no timers along"


def test_its_own_exception_goes_through(renderer, insert):
    def broken(graph, signals):
        raise KeyError("mine")

    insert(broken)
    with pytest.raises(KeyError, match="mine"):
        renderer.render(1)


def test_an_unknown_aov_is_an_error_beside_inserted_passes_too(renderer, insert):
    insert(lambda graph, signals: graph.offer("glare", (signals.radiance,), lambda values: values[..., 0]), name="x")
    assert renderer.render(1, aovs=["glare"]).aov_names == ("glare",)
    with pytest.raises(PicaError, match=r"no AOV 'stare'; there are .*glare"):
        renderer.render(1, aovs=["glare", "stare"])


def test_a_renderer_that_is_dropped_goes_with_its_passes(device, scene, slang):
    with pica.Renderer(scene, size=(16, 9), device=device, settings=pica.Settings.preset("raster")) as renderer:
        inserted = renderer.insert(filling(renderer, slang), "composite")
        renderer.render(1)
    inserted.remove()
    inserted.renew()  # the renderer is closed: nothing happens
    renderer = pica.Renderer(scene, size=(16, 9), device=device, settings=pica.Settings.preset("raster"))
    renderer.insert(lambda graph, signals: None, "lighting", name="nothing much")
    gone = weakref.ref(renderer)
    gc.disable()
    try:
        del renderer
        assert gone() is None, "no cycle holds it"
    finally:
        gc.enable()


def test_a_file_that_changes_is_another_module(tmp_path):
    path = tmp_path / "two-words.slang"
    names = set()
    for text in ("// 1", "// 2"):
        path.write_text(text)
        names.add(SlangFile.read(path).module)
    assert len(names) == 2 and all(name.isidentifier() for name in names)
