"""What programs are made of."""

from functools import partialmethod

import slangpy as spy

import pica
from pica.rhi.device import Device
from pica.rhi.material_types import STANDARD_ONLY
from pica.scene.procedural.primitives import plane
from tests.building import RAYS, lambert, placed, scene_of, settings, uniform

LIMIT = 256 * 1024


def test_programs_that_follow_material_types_are_small(monkeypatch, tmp_path):
    """A driver's time for a program, even a cached one, grows with its code, and frames wait for it."""
    monkeypatch.setenv("PICA_CACHE", str(tmp_path))
    reporting = partialmethod(spy.Device.__init__, enable_compilation_reports=True)
    monkeypatch.setattr(spy.Device, "__init__", reporting)
    device = Device()
    scene = scene_of(placed(plane(1, 1, lambert())), environment=uniform(1, 1, 1))
    renderer = pica.Renderer(scene, (16, 16), settings(RAYS), device)
    sizes = {}
    for user in device.for_types:
        program = device.kept(user.recipe, STANDARD_ONLY)[0]
        entries = program.get_compilation_report()["entry_point_reports"]
        sizes[str(user.recipe)] = sum(entry["cache_size"] for entry in entries)
    assert renderer.pending_shaders == 0 and len(sizes) >= 4
    assert min(sizes.values()) > 0 and max(sizes.values()) < LIMIT, sizes
