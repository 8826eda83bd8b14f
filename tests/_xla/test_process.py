"""Settings of the process: the compilation cache and the C library's memory."""

import os
import subprocess
import sys

import pytest

from ocjax._xla import process


def test_compilation_cache(tmp_path):
    program = (
        "import jax, ocjax; print(ocjax.use_compilation_cache(), "
        "jax.config.jax_compilation_cache_dir)"
    )
    for variables, folder in (
        ({"XDG_CACHE_HOME": str(tmp_path)}, f"{tmp_path}/ocjax/xla"),
        ({"JAX_COMPILATION_CACHE_DIR": "B"}, "B"),
    ):
        run = subprocess.run(
            [sys.executable, "-c", program],
            env=_without_cache(os.environ) | variables,
            capture_output=True,
            text=True,
        )
        assert run.stdout.split() == [folder, folder], run.stderr


def _without_cache(variables):
    return {
        k: v
        for k, v in variables.items()
        if k not in ("XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR")
    }


def test_retained_memory_is_asked_for(monkeypatch):
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "1000000")
    process.retain_freed_memory.cache_clear()
    assert process.retain_freed_memory() is False  # the user's own setting takes precedence
    process.retain_freed_memory.cache_clear()


def test_retained_memory_is_asked_for_by_the_environment():
    code = (
        "import ocjax; ocjax.load('Pong'); from ocjax._xla import process; "
        "print(process.retain_freed_memory.cache_info().currsize)"
    )
    for value, calls in (("1", "1"), ("0", "0")):
        environment = os.environ | {"OCJAX_RETAIN_MEMORY": value}
        run = subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        assert run.stdout.strip() == calls


def test_retained_memory_is_not_mapped_again():
    code = """
import resource
import ocjax
print(ocjax.retain_freed_memory())
def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        b"x" * 2**26  # 16,384 pages, more than glibc's largest threshold of 32 MiB
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
faults()
print(faults())
"""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("MALLOC_")}
    run = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    retained, faults = run.stdout.split()
    if retained == "False":
        pytest.skip("the C library is not glibc")
    assert int(faults) < 1000
