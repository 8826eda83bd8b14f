"""The programs in benchmarks/, which are no package."""

import importlib.util

from tests.support.states import ROOT


def program(name):
    """The module of a program."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "benchmarks" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
