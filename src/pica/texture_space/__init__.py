"""Texture space: objects unwrapped into maps, each texel of which is a point of their surface (RTG 25, figure 25-21)."""
