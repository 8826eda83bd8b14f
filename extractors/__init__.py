"""The games, a file or a folder each. Adding it adds the game."""

if __name__ != "ocjax.extractors":
    raise ImportError(
        "import the game files of ocjax as ocjax.extractors, or use ocjax.load(name): "
        "a second copy would have a registry of its own"
    )
