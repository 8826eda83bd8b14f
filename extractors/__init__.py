"""The games, one file each. Adding a file adds the game."""

if __name__ != "ocjax.extractors":
    raise ImportError(
        "these are the game files of ocjax: import them as ocjax.extractors, or use ocjax.load(name)"
    )
