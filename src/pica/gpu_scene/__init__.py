"""The retained copy of a scene on the GPU, updated incrementally."""
