"""How programs are compiled for and run on XLA's processor backend."""

import os

from ocjax._xla.process import RETAIN_MEMORY, retain_freed_memory

if os.environ.get(RETAIN_MEMORY) == "1":
    retain_freed_memory()
