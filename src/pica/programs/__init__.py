"""What programs are made of: recipes, material and shape types, and the processes that compile them."""
