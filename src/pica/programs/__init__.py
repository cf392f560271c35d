"""Shader programs: recipes, material and shape types, features, and the processes that compile them."""
