"""Specular reflections: a quarter of a ray a pixel, reconstructed from neighbours and earlier frames."""
