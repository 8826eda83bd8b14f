"""Entry point of a worker process: `python -P __main__.py SOCKET_FD MEMORY_FD PARENT_PID`.

Its standard input is the parent's `sys.path` as JSON, for the modules of hooks. The package `ocjax`
would import JAX, so this file imports its package by its location, as the top-level package
`_worker`. The parent folder is never on `sys.path`: its `envpool.py` would shadow envpool.
"""

import importlib.util
import json
import os
import sys
from pathlib import Path

# The standard library comes first. OpenCV 4.10 puts its own folder before it in the parent, and the
# folder has a package `typing`.
_library = Path(os.__file__).parent
_first = (_library, _library / "lib-dynload")
sys.path[:] = sorted(json.load(sys.stdin), key=lambda entry: Path(entry) not in _first)
_package = Path(__file__).parent
_spec = importlib.util.spec_from_file_location(
    "_worker", _package / "__init__.py", submodule_search_locations=[str(_package)]
)
assert _spec is not None  # the file exists
sys.modules["_worker"] = importlib.util.module_from_spec(_spec)
from _worker.program import main  # noqa: E402  # pyright: ignore[reportMissingImports]

main(*map(int, sys.argv[1:4]))
