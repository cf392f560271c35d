"""One dispatch for several views: programs whose arguments are rows of a buffer, and frames that are merged."""
