"""The hybrid renderer."""

from pica.renderer.renderer import Renderer

__all__ = ["Renderer"]
