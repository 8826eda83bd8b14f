"""Entry point of a worker process: `python -P __main__.py SOCKET_FD MEMORY_FD PARENT_PID MODULE_PATH`; it inherits both file descriptors.

MODULE_PATH is the parent's `sys.path` as JSON, so that hooks find their modules. Importing this package as `ocjax.envs._worker` would
import JAX, whose start-up time and memory a worker does not need. The file therefore imports the package by its location, as top-level
`_worker`, and all modules of the package import each other relatively. The folder around it never gets onto the path, where its
`envpool.py` would be found in place of envpool.
"""

import importlib.util
import json
import sys
from pathlib import Path

sys.path[:] = json.loads(sys.argv[4])
_package = Path(__file__).parent
_spec = importlib.util.spec_from_file_location("_worker", _package / "__init__.py", submodule_search_locations=[str(_package)])
assert _spec is not None  # the file exists
sys.modules["_worker"] = importlib.util.module_from_spec(_spec)
from _worker.program import main  # noqa: E402  # pyright: ignore[reportMissingImports]

main(*map(int, sys.argv[1:4]))
