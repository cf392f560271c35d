"""Taking the noise out of pictures that are done: Open Image Denoise."""
