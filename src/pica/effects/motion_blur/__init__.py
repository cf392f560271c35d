"""Motion blur: what moves while the shutter is open."""
