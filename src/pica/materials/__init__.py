"""What surfaces are made of, in Slang: material types and how textures are read."""
