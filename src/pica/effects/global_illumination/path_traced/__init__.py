"""Indirect light by paths from the pixels, and ReSTIR GI."""
