"""The light of many lights and of the surroundings: one noisy sample a pixel and frame, filtered."""
