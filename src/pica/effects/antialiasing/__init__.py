"""Antialiasing: several jittered frames make one picture, of the output's size."""
