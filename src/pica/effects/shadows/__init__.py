"""Ray traced shadows (RTG 25, 25.2.1)."""
