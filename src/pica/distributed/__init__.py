"""Data sets, and frames on many processes and machines."""
