"""A whole effect whose files lie outside of the package, of which no file knows of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import slangpy as spy

import pica
from pica.graph import update, write

FOLDER = Path(__file__).parent / "glow"
SIZE = 48, 27


@dataclass
class GlowSettings:
    strength: float = 2.0
    """Nits of a white surface that nothing covers."""
    reach: float = 0.3


class Glow:
    """Surfaces shine where nothing is near: a ray a pixel, its mean over frames, a filter, and light."""

    name = "glow"

    def __init__(self, renderer, settings):
        self.settings, self.declared = settings, 0
        self._trace = pica.ray_pass(renderer, FOLDER / "glow_rays.slang", "GlowRays")
        self._accumulate = pica.compute_pass(renderer.device, FOLDER / "glow_history.slang")
        self._filter = pica.compute_pass(renderer.device, str(FOLDER / "glow_filter.slang"), "filter")
        self._light = pica.compute_pass(renderer.device, FOLDER / "glow_light.slang", materials=True)

    def __call__(self, graph, signals):
        self.declared += 1
        shared = {"frame": graph.frame, "gbuffer": signals.gbuffer}
        raw, smooth = (graph.texture(name, spy.Format.r32_float) for name in ("raw", "smooth"))
        light = graph.texture("light", spy.Format.rgba32_float)
        mean = graph.history("glow", {"mean": spy.Format.rg32_float})
        graph.add(self._trace, graph.size, scene=signals.scene, raw=write(raw), reach=self.settings.reach, **shared)
        graph.add(
            self._accumulate,
            graph.grid,
            reprojection=signals.reprojection,
            raw=raw,
            known=mean.known,
            **mean.swap(),
            **shared,
        )
        graph.add(self._filter, graph.grid, mean=mean["mean"], smooth=write(smooth), **shared)
        graph.add(
            self._light,
            graph.grid,
            scene=signals.scene,
            smooth=smooth,
            light=write(light),
            radiance=update(signals.radiance),
            strength=self.settings.strength,
            **shared,
        )
        graph.offer("glow", (light,), lambda values: values[..., :3])
        graph.offer("glow_frames", (mean["mean"],), lambda values: values[..., 1])
        graph.offer("debug.glow.raw", (raw,), lambda values: values)
        graph.offer("debug.glow.mean", (mean["mean"],), lambda values: values[..., 0])


@pytest.fixture(scope="module")
def scene():
    return pica.scenes.cornell()


@pytest.fixture(scope="module")
def renderer(device, scene):
    with pica.Renderer(scene, size=SIZE, device=device) as made:
        yield made


@pytest.fixture
def glow(renderer):
    """The effect, put into the frame for one test."""
    made = Glow(renderer, GlowSettings())
    made.insertion = renderer.insert(made, after="composite")
    yield made
    made.insertion.remove()
    renderer.debug = False


def frames_of(frame):
    """How many frames the history holds; jitter shows edges now of one surface, now of another."""
    counts = frame.aov("glow_frames")
    assert (counts == counts.max()).mean() > 0.75
    return counts.max()


def test_its_light_is_added_to_the_picture(renderer, glow):
    with_glow = renderer.render(1, cut=True)
    glow.insertion.remove()
    without = renderer.render(1, cut=True)
    light = with_glow.aov("glow")
    assert light.max() > 1 and (light > 0).mean() > 0.3
    np.testing.assert_allclose(with_glow.color, without.color + light, rtol=1e-3, atol=1e-3)
    assert with_glow.display.mean() != without.display.mean()
    assert "glow" not in without.aov_names


def test_what_is_taken_out_leaves_nothing(renderer, device, scene, glow):
    renderer.render(2)
    glow.insertion.remove()
    glow.insertion.remove()  # once more is no error
    found = renderer.render(3, cut=True)
    with pica.Renderer(scene, size=SIZE, device=device) as fresh:
        expected = fresh.render(3)
    np.testing.assert_array_equal(found.color, expected.color)
    assert found.aov_names == expected.aov_names


def test_its_history_is_the_mean_of_its_frames(renderer, glow):
    renderer.debug = True
    renderer.reset()
    samples = [renderer.render(1, aovs=["debug.glow.raw"]).aov("debug.glow.raw") for _ in range(5)]
    frame = renderer.render(1)
    samples.append(frame.aov("debug.glow.raw"))
    assert set(np.unique(samples)) == {0, 1}
    assert frames_of(frame) == 6
    seen = (frame.aov("glow_frames") == 6) & np.isfinite(frame.aov("depth"))
    still = frame.aov("debug.glow.mean")[seen]
    # At edges the surface was beside the pixel, in some frame.
    assert (np.abs(still - np.mean(samples, axis=0)[seen]) < 1e-5).mean() > 0.75
    assert still.std() < 0.7 * samples[0][seen].std()


def test_it_is_told_of_other_sizes_and_settings(renderer, glow):
    assert frames_of(renderer.render(3, cut=True)) == 3
    before = glow.declared
    renderer.configure(renderer.settings.with_values({"post.exposure": 1.0, "reflections.mode": "off"}))
    frame = renderer.render(1)
    assert frames_of(frame) == 4, "other effects' settings leave its history alone"
    assert glow.declared > before and "reflections" not in frame.aov_names
    renderer.resize((40, 20))
    frame = renderer.render(2)
    assert frame.aov("glow").shape == (20, 40, 3) and frames_of(frame) == 2
    renderer.resize(SIZE)
    renderer.configure(pica.Settings())
    assert frames_of(renderer.render(1)) == 1


def test_its_rays_follow_the_renderer_s(renderer, glow):
    found = []
    for scheduler in ("buffers", "pipeline"):
        renderer.configure(pica.Settings().with_values({"rays.scheduler": scheduler}))
        frame = renderer.render(1, cut=True)
        found.append(frame.aov("glow"))
        assert ("glow_rays kernels" in frame.timings) == (scheduler == "buffers") != ("glow_rays" in frame.timings)
    renderer.configure(pica.Settings())
    assert found[0].max() > 0
    np.testing.assert_allclose(*found, rtol=1e-3, atol=1e-3)


def test_other_settings_of_its_own(renderer, glow):
    before = renderer.render(4, cut=True)
    glow.settings.strength = 4.0
    glow.insertion.renew()
    after = renderer.render(1)
    assert frames_of(after) == 5, "its history stays"
    ratio = after.aov("glow").sum() / before.aov("glow").sum()
    assert ratio == pytest.approx(2, rel=0.1)
    added = (after.color - before.color).sum() / before.aov("glow").sum()
    assert added == pytest.approx(1, rel=0.35), "the picture begins anew: it does not hold what was before"


def test_the_graph_shows_it(renderer, glow, tmp_path):
    renderer.render(2)
    graph = renderer.graph
    own = [each for each in graph.passes if each.effect == "glow"]
    assert [each.name for each in own] == ["glow_rays", "glow_history", "glow_filter", "glow_light"]
    assert all(each.milliseconds > 0 and "test_effect_from_outside.py:" in each.where for each in own)
    order = [each.name for each in graph.passes]
    assert order.index("reflection_filter") < order.index("glow_rays") < order.index("temporal_resolve")
    history, light = own[1], own[3]
    assert "glow/glow mean" in history.previous and "glow/raw" in history.reads
    assert history.writes == ("glow/glow mean",) and "composite/radiance" in light.writes
    (mean,) = (each for each in graph.resources if each.key == "glow/glow mean")
    assert (mean.format, mean.size, mean.lifetime) == ("rg32_float", SIZE, "history")
    assert graph.memory["glow"] == mean.bytes >= 2 * SIZE[0] * SIZE[1] * 8
    assert graph.milliseconds["glow"] == pytest.approx(sum(each.milliseconds for each in own))
    graph.save(tmp_path / "graph.svg")
    assert "glow_history" in (tmp_path / "graph.svg").read_text()
    glow.insertion.remove()
    renderer.render(1)
    assert "glow" not in renderer.graph.milliseconds and "glow" not in renderer.graph.memory


def test_pictures_of_several_stages_can_be_replaced(renderer):
    """A signal that is replaced is what comes after."""

    def blank(graph, signals):
        picture = graph.texture("blank", spy.Format.rgba32_float, graph.output_size)
        graph.record(
            "fill",
            lambda frame, target: frame.encoder.clear_texture_float(target, clear_value=[3, 2, 1, 0]),
            target=write(picture),
        )
        signals.picture = picture

    inserted = renderer.insert(blank, after="antialiasing")
    frame = renderer.render(1)
    inserted.remove()
    np.testing.assert_array_equal(frame.color, np.broadcast_to(np.float32([3, 2, 1]), frame.color.shape))
    assert (frame.display == frame.display[0, 0]).all() and frame.display[0, 0, 0] > frame.display[0, 0, 2]


def test_light_of_its_own_is_part_of_the_sum(renderer):
    """Packed as all parts are, before they are summed up."""
    one = (127 - (127 - 25)) << 15  # as packFloat21 has it
    low, high = (one | one << 21) & 0xFFFFFFFF, one >> 11 | one << 10

    def shine(graph, signals):
        part = graph.texture("light", spy.Format.rg32_uint)
        graph.record(
            "fill",
            lambda frame, target: frame.encoder.clear_texture_uint(target, clear_value=[low, high, 0, 0]),
            target=write(part),
        )
        signals.parts.append(part)

    inserted = renderer.insert(shine, after="global_illumination")
    brighter = renderer.render(1, cut=True, aovs=["combined", "instance"])
    inserted.remove()
    frame = renderer.render(1, cut=True, aovs=["combined"])
    seen = brighter.aov("instance") > 0
    np.testing.assert_allclose((brighter.aov("combined") - frame.aov("combined"))[seen], 1, atol=1e-5)
