"""From scene radiance to the display: exposure and tone mapping."""
