"""The names of `ocatari.core`, for imports as in OCAtari."""

from ocjax.ocatari import (
    AVAILABLE_GAMES,
    UPSCALE_FACTOR,
    OCAtari,
)
from ocjax.ocatari import __getattr__ as __getattr__  # explains absent names

__all__ = ["AVAILABLE_GAMES", "UPSCALE_FACTOR", "OCAtari"]
