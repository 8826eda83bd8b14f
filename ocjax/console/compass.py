"""Compass points for orientations: 0 to 15, clockwise from north."""

__all__ = ["EAST", "NORTH", "POINTS", "SOUTH", "WEST"]

POINTS = tuple("N NNE NE ENE E ESE SE SSE S SSW SW WSW W WNW NW NNW".split())
NORTH = POINTS.index("N")
EAST = POINTS.index("E")
SOUTH = POINTS.index("S")
WEST = POINTS.index("W")
