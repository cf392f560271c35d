"""Data that effects exchange: light towards the camera, shadows, indirect light."""
