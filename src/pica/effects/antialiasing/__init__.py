"""Antialiasing: several jittered frames make one picture."""
