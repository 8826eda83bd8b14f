"""Colours as vision rules name them: palette indices."""

__all__ = ["EVEN", "Colors", "color_set"]

EVEN = 0xFE  # an odd palette index shows as the even one below it

Colors = int | tuple[int, ...]


def color_set(colors: Colors) -> tuple[int, ...]:
    """One or several palette indices as a tuple.

    Raises:
        ValueError: there is none, or one is not an integer from 0 to 255.
    """
    out = (colors,) if isinstance(colors, int) else colors
    if not out or not all(isinstance(c, int) and 0 <= c < 256 for c in out):
        raise ValueError(f"colors must be one or several palette indices 0-255, got {colors!r}")
    return out
