"""Entry point of a worker process: `python -P __main__.py SOCKET_FD MEMORY_FD`, with both file descriptors inherited.

Importing this package as `ocjax.envs._worker` would import JAX, whose start-up time and memory a worker does not need. The file therefore
imports the package by its location, as top-level `_worker`, and all modules of the package import each other relatively.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from _worker.program import main  # pyright: ignore[reportMissingImports]

sys.path.pop(0)
main(int(sys.argv[1]), int(sys.argv[2]))
