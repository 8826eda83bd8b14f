"""Which of many values of a parameter the quick run takes."""

import hashlib

import pytest


def slow_but(quick, values):
    """All values, as parameters of a test; those that are not among `quick` run only with `--all`.

    A tuple is the values of several.
    """
    missing = [value for value in quick if value not in values]
    assert not missing, f"{missing} are no values"
    return [
        value
        if value in quick
        else pytest.param(*value if isinstance(value, tuple) else (value,), marks=pytest.mark.slow)
        for value in values
    ]


def some(count, values):
    """All values, of which the quick run takes so many, drawn by a hash of their names."""
    drawn = sorted(values, key=lambda value: hashlib.sha256(str(value).encode()).digest())
    return slow_but(drawn[:count], list(values))
