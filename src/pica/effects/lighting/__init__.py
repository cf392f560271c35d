"""Direct light of all light sources."""
