"""Depth of field: what a lens shows of scenes that are not in its plane of focus."""
