"""Reflection rays over the depth buffer."""
