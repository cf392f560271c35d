"""Ray traced shadows (seed 001, 25.2.1)."""
