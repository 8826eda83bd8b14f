"""The quick run's choice among many values of a parameter."""

import hashlib

import pytest


def slow_but(quick, values):
    """All values, as parameters of a test; values outside `quick` run only with `--all`.

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
    """All values; the quick run takes `count` of them, drawn by a hash of their names."""
    drawn = sorted(values, key=lambda value: hashlib.sha256(str(value).encode()).digest())
    return slow_but(drawn[:count], list(values))
