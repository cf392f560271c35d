"""Picture files, films, and rendered frames."""
