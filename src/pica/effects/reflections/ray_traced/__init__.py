"""Reflection rays through the scene."""
