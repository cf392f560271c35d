"""One folder an effect: the Python class that records it, and its steps in Slang."""
