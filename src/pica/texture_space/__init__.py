"""Texture space: objects unwrapped into maps, whose texels are points of their surfaces (RTG 25, figure 25-21)."""
