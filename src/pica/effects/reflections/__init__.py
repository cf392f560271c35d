"""What surfaces mirror: a quarter of a ray a pixel, rebuilt from neighbours and earlier frames."""
