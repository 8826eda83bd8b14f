"""Compilation for XLA's CPU backend, and settings of the process."""

import os

from ocjax._xla.process import RETAIN_MEMORY, retain_freed_memory

if os.environ.get(RETAIN_MEMORY) == "1":
    retain_freed_memory()
