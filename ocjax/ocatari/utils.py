"""The names of `ocatari.utils`, for imports as in OCAtari."""

from ocjax.ocatari import (
    RandomAgent,
    load_agent,
    make_deterministic,
)
from ocjax.ocatari import __getattr__ as __getattr__  # explains absent names

__all__ = ["RandomAgent", "load_agent", "make_deterministic"]
