"""Everything that shines, as the tables that shaders sample."""
