"""Indirect light from a baked light map."""
