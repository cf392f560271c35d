"""Devices without ray tracing: lavapipe with the feature hidden from pica."""

import warnings

import numpy as np
import pytest
import slangpy as spy

import pica
from pica.errors import DeviceError
from pica.renderer import Renderer
from pica.rhi.adapters import HIDE_RAY_TRACING
from pica.rhi.device import Device
from pica.scene.model import Mesh, Node
from pica.scene.primitives import spheres
from pica.scene.spline import Spline, bend
from pica.scenes.basic_meshes import box
from pica.tracing import embree, fallbacks
from tests.building import CAMERA, EMBREE, SIZE, lambert, render, settings, still_life, trace

needs_embree = pytest.mark.skipif(embree.missing() is not None, reason="Embree cannot trace")


@pytest.fixture(scope="module")
def raster_only():
    """A device that cannot trace rays."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(HIDE_RAY_TRACING, "1")
        yield Device()


@pytest.fixture
def without_embree(monkeypatch):
    monkeypatch.setattr(embree, "missing", lambda: f"llvmlite is missing; {embree.INSTALL}")


@pytest.fixture
def told(raster_only):
    """The warnings of a test, as if it had the device for itself."""
    raster_only.shared(fallbacks.WarningLog).messages.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield lambda: [str(warning.message).split(": ", 1)[1] for warning in caught]


def test_what_falls_back_stage_by_stage(raster_only, without_embree, told):
    assert raster_only.tier == 0 and raster_only.info.missing == []
    every = {
        "visibility.primary": "rays",
        "ambient_occlusion.mode": "ray_traced",
        "reflections.mode": "ray_traced",
        "translucency.mode": "texture_space",
        "transparency.mode": "ray_traced",
        "global_illumination.mode": "path_traced",
    }
    raster = pica.Settings.preset("raster").with_values({"antialiasing.mode": "accumulate"})
    assert fallbacks.runnable(raster_only, settings(every)) == raster
    assert told() == [f"{setting} is {value}" for setting, value in fallbacks.WITHOUT_RAYS.items()]
    fallbacks.runnable(raster_only, settings(every))
    assert len(told()) == len(every) + 2, "once a device"


@pytest.mark.parametrize("values", [{"shadows.mode": "off"}, {"shadows.method": "maps"}])
def test_what_traces_nothing_stays(raster_only, without_embree, told, values):
    """An environment that is sampled without shadows, or beside shadow maps, needs no rays."""
    values = {"translucency.mode": "off", "transparency.mode": "off", **values}
    assert fallbacks.runnable(raster_only, settings(values)) == settings(values)
    assert told() == []


def two_frames(settings, device):
    """Of a scene with all kinds of structures, with a mesh that deforms in between."""
    curve = np.array([(-1, 0.2, 1), (0, 0.4, 1.2), (1, 0.2, 1)], float)
    scene, spline = still_life(), Spline(curve)
    bend(Mesh([box((0.3, 0.2, 0.6), lambert())]), spline, copies=3)
    scene.add(spline.node)
    scene.add(Node(mesh=Mesh([], primitives=[spheres([(-0.3, 0.2, 0.8)], 0.2, lambert(0.2, 0.6, 0.3))])))
    renderer = Renderer(scene, size=SIZE, settings=settings, device=device)
    renderer.render(1, camera=CAMERA)
    spline.set(curve + np.array([0, 0.2, 0]))
    return renderer, renderer.render(1, camera=CAMERA)


def test_a_frame_without_rays_is_that_of_the_raster_preset(device, raster_only, without_embree, told, monkeypatch):
    """And nothing of ray tracing is made, whatever the scene has."""
    with monkeypatch.context() as patch:
        for name in ("BuildDesc", "InstanceDesc", "QueryDesc"):
            patch.delattr(spy, f"AccelerationStructure{name}")
        renderer, picture = two_frames(None, raster_only)
    assert told() == [
        "shadows.method is maps",
        "lighting.environment is prefiltered",
        "reflections.mode is screen_space",
        "translucency.mode is off",
        "transparency.mode is screen_space",
        "global_illumination.mode is light_map",
        "no indirect light",
    ]
    assert renderer.settings.shadows.method == "maps"
    _, expected = two_frames(pica.Settings.preset("raster").with_values({"ambient_occlusion.mode": "off"}), device)
    assert expected.color.mean() > 0.1
    np.testing.assert_array_equal(picture.color, expected.color)


def test_the_path_tracer_is_an_error_of_one_line(raster_only, without_embree, told):
    with pytest.raises(DeviceError, match=r"path tracing: device '.*' has no ray tracing.*pip install") as raised:
        pica.PathTracer(still_life(), size=SIZE, device=raster_only)
    assert "\n" not in str(raised.value) and told() == []


@needs_embree
def test_embree_traces_for_it(device, raster_only, told):
    asked = {"rays.scheduler": "pipeline", "rays.tracer": "device", "visibility.primary": "rays"}
    found = render(raster_only, still_life(), 2, CAMERA, values=asked)
    assert told() == ["rays.scheduler is buffers", "rays.tracer is embree"]
    assert "embree" in found.timings
    expected = render(device, still_life(), 2, CAMERA, values=EMBREE)
    np.testing.assert_array_equal(found.color, expected.color)
    traced = [trace(which, still_life(), 1, CAMERA, values=EMBREE).color for which in (raster_only, device)]
    np.testing.assert_array_equal(*traced)
    assert traced[0].mean() > 0.1
