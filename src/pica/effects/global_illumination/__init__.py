"""Diffuse global illumination: light that surfaces reflect diffusely of other surfaces."""
