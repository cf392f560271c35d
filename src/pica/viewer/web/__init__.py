"""The viewer in a browser, by viser (an extra: pip install pica[view])."""
