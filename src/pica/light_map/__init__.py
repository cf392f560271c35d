"""Volumetric light maps: indirect irradiance of places in a scene, as spherical harmonics in adaptive bricks."""
