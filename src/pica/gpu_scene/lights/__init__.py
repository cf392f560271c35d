"""All light sources, as the tables that shaders sample."""
