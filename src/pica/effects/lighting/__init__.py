"""Direct light from everything that shines."""
