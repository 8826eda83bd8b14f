"""Settings of the process: the folder of compiled programs, and glibc's use of freed memory."""

import ctypes
import functools
import os
import sys
from pathlib import Path

import jax
import platformdirs

MIN_CACHED_SECONDS = 0.2  # compilations that take longer are kept on disk
# Environment variable: 1 calls `retain_freed_memory` on import.
RETAIN_MEMORY = "OCJAX_RETAIN_MEMORY"

# Parameters of glibc's mallopt, by their environment variables: no freed memory is returned to the
# system, including large blocks and the memory of threads, which glibc otherwise maps separately.
MALLOC = {
    "MALLOC_TRIM_THRESHOLD_": (-1, 2**31 - 1),
    "MALLOC_MMAP_MAX_": (-4, 0),
    "MALLOC_ARENA_MAX": (-8, 1),
}


def use_compilation_cache() -> Path:
    """Keep compiled programs on disk: in later processes, first calls are two to five times faster.

    Call this function before the first extraction. It sets JAX's persistent compilation cache for
    the whole process, unless `JAX_COMPILATION_CACHE_DIR` or the program has chosen a folder. The
    `ocjax` command calls it. To empty the cache, delete the folder.

    Returns:
        The folder: the chosen one, or else `ocjax/xla` in the user's cache.

    Raises:
        OSError: the user has no home folder.
    """
    chosen: str | None = jax.config.jax_compilation_cache_dir  # pyright: ignore
    if chosen is not None:
        return Path(chosen)
    folder = _user_cache() / "xla"
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", MIN_CACHED_SECONDS)
    return folder


def _user_cache() -> Path:
    try:
        folder = platformdirs.user_cache_path("ocjax", appauthor=False)
    except RuntimeError:  # of recent versions of platformdirs
        folder = Path("~")
    if not folder.is_absolute():
        raise FileNotFoundError(
            "the user has no home folder for compiled programs: set HOME, XDG_CACHE_HOME or "
            "JAX_COMPILATION_CACHE_DIR"
        )
    return folder


@functools.cache
def retain_freed_memory() -> bool:
    """Ask the C library to keep freed memory for later allocations of the process.

    By default glibc returns large results to the system when they are dropped, and maps and clears
    pages again for the next call. At 65,536 states, this takes Ms. Pac-Man's REM from 1.5 to 2.9
    microseconds of processor time per state. It always happens if an array of the result exceeds 32
    MiB; for smaller results it depends on earlier allocations. The program `benchmarks/memory.py`
    measures page faults and times.

    The `ocjax` command and the benchmarks call this function. Other programs call it, or set the
    environment variable `OCJAX_RETAIN_MEMORY=1` before they import ocjax. `MALLOC_TRIM_THRESHOLD_`,
    `MALLOC_MMAP_THRESHOLD_`, `MALLOC_MMAP_MAX_` and `MALLOC_ARENA_MAX` take precedence.

    Returns:
        True if it took effect; False without glibc or if one of those variables is set.
    """
    if sys.platform != "linux" or {"MALLOC_MMAP_THRESHOLD_", *MALLOC} & os.environ.keys():
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and all(mallopt(*setting) for setting in MALLOC.values())
