"""Scenes made in code; each call returns a new pica Scene with a camera."""

from pica.scene.procedural.cornell import cornell
from pica.scene.procedural.landscape_world import landscape
from pica.scene.procedural.machine_world import machine_world
from pica.scene.procedural.sphere_grid import sphere_grid

__all__ = ["cornell", "landscape", "machine_world", "sphere_grid"]
