"""Colours of vision rules: palette indices."""

__all__ = ["EVEN", "Colors", "color_set"]

EVEN = 0xFE  # an odd palette index shows the same colour as the even one below it

Colors = int | tuple[int, ...]


def color_set(colors: Colors) -> tuple[int, ...]:
    """Convert one or several palette indices to a tuple."""
    out = (colors,) if isinstance(colors, int) else colors
    if not out or not all(isinstance(c, int) and 0 <= c < 256 for c in out):
        raise ValueError(f"colors must be one or several palette indices 0-255, got {colors!r}")
    return out
