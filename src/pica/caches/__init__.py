"""What is kept between runs so that starts are fast: where, and whether it is whole."""
