"""What stands for something that an extraction method cannot tell."""

__all__ = ["UNKNOWN", "UNKNOWN_VALUE"]

UNKNOWN = -1  # the orientation of an object that has one
UNKNOWN_VALUE = -(2**31)  # the value of an object that has one
