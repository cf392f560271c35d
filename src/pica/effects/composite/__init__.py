"""The sum of all light towards the camera."""
