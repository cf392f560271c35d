"""Vertices that compute passes write: skins, morph targets, splines, particles."""
