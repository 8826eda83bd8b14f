"""Placeholders for orientations and values that an extraction method does not know."""

__all__ = ["UNKNOWN", "UNKNOWN_VALUE"]

UNKNOWN = -1  # orientation
UNKNOWN_VALUE = -(2**31)  # value
