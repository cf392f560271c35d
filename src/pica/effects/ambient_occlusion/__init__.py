"""Ambient occlusion: which share of the hemisphere above a surface is open nearby."""
