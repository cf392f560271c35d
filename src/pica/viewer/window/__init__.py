"""The viewer in a window of this machine, by SlangPy's window and Dear ImGui."""
