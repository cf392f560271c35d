"""The retained copy of a scene on the GPU: uploads what changed, no more."""
