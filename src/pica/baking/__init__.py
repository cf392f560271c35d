"""Light maps baked by the path tracer's light transport."""
