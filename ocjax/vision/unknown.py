"""What stands for something that an extraction method cannot tell."""

UNKNOWN = -1  # the orientation of an object that has one
UNKNOWN_VALUE = -(2**31)  # the value of an object that has one
