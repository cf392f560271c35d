"""Scenes made in code; each call returns a new pica Scene with a camera."""

from pica.scenes.cornell import cornell
from pica.scenes.landscape_world import landscape
from pica.scenes.machine_world import machine_world
from pica.scenes.sphere_grid import sphere_grid

__all__ = ["cornell", "landscape", "machine_world", "sphere_grid"]
