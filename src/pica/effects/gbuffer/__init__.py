"""Primary visibility and material resolve (RTG 25, 25.1, step 3)."""
