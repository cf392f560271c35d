"""Caches between runs for fast starts: their places, and checks of their integrity."""
