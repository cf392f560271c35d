"""Primitives that are not triangles, in Slang: the interface of shapes and those that are built in."""
