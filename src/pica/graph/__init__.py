"""The frame graph: passes and what they read and write, declared once and replayed each frame."""
