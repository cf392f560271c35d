"""Temporal and spatial filtering that effects share: reprojection, histories, accumulation, edge-avoiding filters."""
