"""Scenes made in code; each call returns a new pica Scene with a camera."""

from pica.scenes.cornell import cornell
from pica.scenes.corridor import corridor
from pica.scenes.landscape_world import landscape
from pica.scenes.machine_world import machine_world
from pica.scenes.rooms import court, rooms
from pica.scenes.showroom import showroom
from pica.scenes.sphere_grid import sphere_grid
from pica.scenes.sphere_sweep import sphere_sweep

__all__ = [
    "cornell",
    "corridor",
    "court",
    "landscape",
    "machine_world",
    "rooms",
    "showroom",
    "sphere_grid",
    "sphere_sweep",
]
