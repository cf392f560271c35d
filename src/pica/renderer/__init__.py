"""The hybrid renderer."""

from pica.renderer.frame import Signals
from pica.renderer.insertion import Insertion
from pica.renderer.own_passes import compute_pass, ray_pass
from pica.renderer.picking import Picked
from pica.renderer.renderer import Renderer

__all__ = ["Insertion", "Picked", "Renderer", "Signals", "compute_pass", "ray_pass"]
