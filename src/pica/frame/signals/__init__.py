"""What effects hand on to others: light towards the camera, shadows, indirect light."""
