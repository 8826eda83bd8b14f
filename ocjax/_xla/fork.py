"""Refusal to compute in forked processes in which JAX may wait for ever.

JAX computes with threads. A process that is forked from one in which they run does not have them, and a computation may never end.
"""

import os

from jax._src import xla_bridge

_without_threads = False  # whether this process was forked from one in which JAX's threads run


def _mark() -> None:
    global _without_threads
    # Not `backends_are_initialized()`: another thread of the parent may have held its lock.
    _without_threads = bool(xla_bridge._backends)


def require_threads() -> None:
    """Check that JAX can compute in this process.

    Raises:
        RuntimeError: the process was forked from one that had already computed with JAX.
    """
    if _without_threads:
        raise RuntimeError(
            "this process was forked from one that had already computed with JAX, and JAX may wait for ever in it: start processes with "
            "'spawn', as with context='spawn' of gymnasium.vector.AsyncVectorEnv or multiprocessing.get_context('spawn'), or compute "
            "nothing with JAX before they are forked"
        )


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_mark)
