"""What every effect shares: the frame's constants, the G-buffer, jitter and noise."""
