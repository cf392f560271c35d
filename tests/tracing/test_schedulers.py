"""One ray effect, two schedulers: the same bits."""

import numpy as np
import pytest

import pica
from pica.errors import BindingError
from pica.tracing.ray_effect import ray_effect
from tests.building import CAMERA, SIZE, render, settings, still_life, trace

PIPELINE = {"rays.scheduler": "pipeline"}
BUFFERS = {"rays.scheduler": "buffers", "rays.tracer": "device"}


def assert_same(first: pica.Frame, second: pica.Frame, tolerance: float = 0) -> None:
    assert first.aov_names == second.aov_names
    np.testing.assert_allclose(first.color, second.color, rtol=tolerance)
    for name in first.aov_names:
        np.testing.assert_array_equal(first.aov(name), second.aov(name), err_msg=name)


@pytest.mark.parametrize("mode", ["soft", "hard"])
def test_hybrid_pictures_are_equal(device, mode):
    values = {"visibility.primary": "rays", "shadows.mode": mode}
    pipeline, buffers = (render(device, still_life(), 3, CAMERA, values=values | more) for more in (PIPELINE, BUFFERS))
    assert pipeline.color.mean() > 0.1
    assert_same(pipeline, buffers)
    assert "primary_rays kernels" in buffers.timings or "shadow_rays kernels" in buffers.timings


@pytest.mark.gpu_differs("pipelines and kernels round differently, by 4e-6 on an H200")
def test_pictures_with_paths_are_equal(device):
    """Pipelines gather the paths that go on a few times, buffers after each ray."""
    values = {"reflections.mode": "ray_traced", "global_illumination.mode": "path_traced"}
    pipeline, buffers = (render(device, still_life(), 3, CAMERA, values=values | more) for more in (PIPELINE, BUFFERS))
    assert pipeline.aov("diffuse_indirect").mean() > 0.01 and pipeline.aov("reflections").mean() > 0.01
    assert_same(pipeline, buffers, tolerance=0 if device.is_software else 1e-4)


def test_path_traced_pictures_are_equal(device):
    pipeline, buffers = (trace(device, still_life(), 3, CAMERA, values=more) for more in (PIPELINE, BUFFERS))
    assert pipeline.color.mean() > 0.1
    # A graphics card's compiler rounds the same lines otherwise in the two programs.
    assert_same(pipeline, buffers, tolerance=0 if device.is_software else 1e-4)


def test_buffers_follow_a_moving_scene(device):
    """The tracer behind the buffers sees the top level of the frame, not of the one before."""
    pictures = []
    for more in (PIPELINE, BUFFERS):
        scene = still_life()
        renderer = pica.Renderer(
            scene, size=SIZE, settings=settings({"visibility.primary": "rays"} | more), device=device
        )
        renderer.render(2, camera=CAMERA)
        ball = next(node for node in scene.nodes() if node.name == "ball")
        moved = ball.transform.copy()
        moved[0, 3] += 0.4
        ball.transform = moved
        pictures.append(renderer.render(2, camera=CAMERA))
    assert_same(*pictures)


def test_unknown_effect_is_an_error_that_names_the_module(device):
    with pytest.raises(BindingError, match=r"effects/shadows/shadow_rays\.slang"):
        ray_effect(device, "effects/shadows/shadow_rays.slang", "NoSuchEffect", "hit")
