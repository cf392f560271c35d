"""Ray traced shadows (seed 001, 25.2.1), and the shadow maps that they replace."""
