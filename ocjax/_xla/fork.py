"""Detect forked processes, where a computation with JAX may never end: extraction raises an error.

A process that is forked while JAX's threads run lacks them. This module also lets it exit.
"""

import atexit
import ctypes
import os

from jax._src import api, xla_bridge
from jax._src.interpreters import mlir

_without_threads = False  # whether this process was forked while JAX's threads ran


def _mark() -> None:
    global _without_threads
    # Not `backends_are_initialized()`: another thread of the parent may have held its lock.
    _without_threads = bool(xla_bridge._backends)
    if _without_threads:
        _keep_until_exit()


def _keep_until_exit() -> None:
    """Keep JAX's clients and thread pools alive when the process exits.

    Their destructors would wait for the threads, or crash.
    """
    atexit.unregister(api.clean_up)
    for kept in (*xla_bridge._backends.values(), mlir.global_thread_pool):
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))


def require_threads() -> None:
    """Check that JAX can compute in this process."""
    if _without_threads:
        raise RuntimeError(
            "this process was forked from one that had already computed with JAX, and JAX may "
            "wait for ever in it: start processes with 'spawn', as with context='spawn' of "
            "gymnasium.vector.AsyncVectorEnv or multiprocessing.get_context('spawn'), or compute "
            "nothing with JAX before they are forked"
        )


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_mark)
