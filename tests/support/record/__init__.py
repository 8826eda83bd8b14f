"""The recordings of `tests/data`: `python -m tests.support.record GAME` writes them."""
