"""What programs are made of: recipes, material and shape types, features, and the processes that compile them."""
