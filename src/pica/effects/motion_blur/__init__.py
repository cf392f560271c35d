"""Motion blur of a camera with a shutter."""
