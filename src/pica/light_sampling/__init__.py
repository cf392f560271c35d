"""One light for any surface point: light slots, reservoirs, and samples of every kind of light."""
