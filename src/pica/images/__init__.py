"""Picture files, films and what a render gives."""
