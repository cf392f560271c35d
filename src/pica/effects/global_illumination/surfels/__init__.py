"""Indirect light that surfels cache (RTG 25, 25.2.6)."""
