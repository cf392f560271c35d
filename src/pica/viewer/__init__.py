"""What one looks at and how, without a user interface."""
