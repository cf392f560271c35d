"""Primary visibility and material resolve (seed 001, 25.1, step 3)."""
