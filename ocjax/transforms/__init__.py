"""Functions of extracted objects."""
