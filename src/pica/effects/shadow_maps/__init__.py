"""Shadow maps: shadows of the strongest lights without rays."""
