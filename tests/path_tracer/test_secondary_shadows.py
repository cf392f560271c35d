"""Shadow rays from secondary hits that nothing passes: for comparisons with effects whose rays are such."""

import numpy as np
import pytest

from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import move, turn
from pica.tracing import tracers
from tests.building import BUFFERS, RAYS, lambert, orthographic, placed, scene_of, shining, trace

ON = {"rays.opaque_secondary_shadows": "true"}
NONE_PASS = {"shadows.transparent": "false"}
SIZE = (8, 8)
UNDER_THE_TILE: Camera = orthographic((0, 0.1, 0), (0, 1, 0), 0.4)
THE_FLOOR: Camera = orthographic((0.8, 0.9, 0), (0.8, 0, 0), 0.4)
"""Both beneath the pane."""


def room(pane_width: float):
    """A tile over a floor under the sun: its lower side has light from the floor alone. A pane over both, or over the
    half to the right."""
    amber = Material(base_color=(0.9, 0.5, 0.2, 1.0), metallic=0.0, transmission=1.0)
    return scene_of(
        placed(plane(12, 12, lambert(0.6))),
        placed(plane(0.5, 0.5, lambert(0.8, double_sided=True)), move(0, 1, 0)),
        placed(plane(pane_width, 12, amber), move(6 - pane_width / 2, 2, 0)),
        shining(DirectionalLight(illuminance=2.0), turn("x", -90)),
    )


@pytest.mark.parametrize("way", [RAYS, BUFFERS], ids=["pipeline", "buffers"])
def test_indirect_light_through_a_pane_is_lost_and_direct_light_is_not(device, way):
    def seen(camera, depth, more, pane_width=12):
        return trace(device, room(pane_width), 8, camera, SIZE, depth, way | more).color

    through, stopped = (seen(UNDER_THE_TILE, 3, more) for more in ({}, ON))
    ratio = through.mean((0, 1)) / through.mean()
    np.testing.assert_allclose(ratio, np.array([0.9, 0.5, 0.2]) * 3 / 1.6, rtol=1e-3)
    assert through.mean() > 0.05
    assert np.all(stopped == 0), "all of the floor's light comes through the pane"
    half, expected = (seen(UNDER_THE_TILE, 3, more, 6) for more in (ON, NONE_PASS))
    np.testing.assert_allclose(half, expected, rtol=1e-6)
    assert 0 < half.mean() < seen(UNDER_THE_TILE, 3, {}, 6).mean()
    direct = [seen(THE_FLOOR, 2, more) for more in ({}, ON)]
    np.testing.assert_array_equal(*direct)
    assert direct[0].min() > 0.01


def test_those_rays_only_ask_whether_anything_is_in_the_way(device, monkeypatch):
    queues = []
    run = tracers.PipelineTracer.__call__
    monkeypatch.setattr(
        tracers.PipelineTracer,
        "__call__",
        lambda self, recording, queue: queues.append(queue) or run(self, recording, queue),
    )
    shadow_rays = []
    for more in ({}, ON):
        queues.clear()
        trace(device, room(12), 1, UNDER_THE_TILE, SIZE, 3, BUFFERS | more)
        shadow_rays.append(sum(queue.shadows for queue in queues))
    # Every path's second surface is the floor, or what is beyond its edge.
    assert shadow_rays[0] == 0
    assert 0.8 * SIZE[0] * SIZE[1] < shadow_rays[1] <= SIZE[0] * SIZE[1]
