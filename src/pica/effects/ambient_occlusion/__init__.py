"""Ambient occlusion: visibility of the hemisphere above a surface, nearby."""
