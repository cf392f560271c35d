"""What every pass of a frame has: its constants, the G-buffer, the effect interface, signals between effects."""
