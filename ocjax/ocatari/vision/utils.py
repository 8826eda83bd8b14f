"""The names of `ocatari.vision.utils`, for imports as in OCAtari."""

from ocjax.ocatari import __getattr__ as __getattr__  # explains absent names
from ocjax.ocatari import (
    make_darker,
    mark_bb,
    to_rgba,
)

__all__ = ["make_darker", "mark_bb", "to_rgba"]
