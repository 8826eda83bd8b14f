"""Settings of the whole process: where JAX keeps compiled programs, and whether the C library keeps freed memory."""

import ctypes
import functools
import os
import sys
from pathlib import Path

import jax
import platformdirs

MIN_CACHED_SECONDS = 0.2  # compilations that take longer are kept on disk
RETAIN_MEMORY = (
    "OCJAX_RETAIN_MEMORY"  # environment variable: 1 asks for `retain_freed_memory` on import
)

# Parameters of glibc's mallopt by the environment variables that set them. Freed memory is not
# returned to the system, not even that of large blocks, which glibc maps one by one, or of threads,
# each of which has a heap of its own.
MALLOC = {
    "MALLOC_TRIM_THRESHOLD_": (-1, 2**31 - 1),
    "MALLOC_MMAP_MAX_": (-4, 0),
    "MALLOC_ARENA_MAX": (-8, 1),
}


def use_compilation_cache() -> Path:
    """Keep compiled programs on disk, so that a game's first call is two to five times faster from
    the second process on.

    Call it before the first extraction. It sets JAX's persistent compilation cache for the whole
    process, and leaves alone a folder that `JAX_COMPILATION_CACHE_DIR` or the program has chosen.
    The `ocjax` command calls it. To empty the cache, delete the folder.

    Returns:
        The folder, unless another one was chosen: `ocjax/xla` in the user's cache, such as
        `~/.cache/ocjax/xla`.

    Raises:
        OSError: the user has no home folder.
    """
    chosen: str | None = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]
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
    """Ask the C library to keep freed memory for later allocations; it applies to the whole
    process.

    By default glibc returns large results to the system when they are dropped, and the next call's
    pages are mapped and cleared again. At 65,536 states, that takes Ms. Pac-Man's REM from 1.5 to
    2.9 microseconds of processor time a state; at 4,096 it takes 0.9. The `ocjax` command and the
    benchmarks call this function; other programs call it, or set the environment variable
    `OCJAX_RETAIN_MEMORY=1` before they import ocjax. `MALLOC_TRIM_THRESHOLD_`,
    `MALLOC_MMAP_THRESHOLD_`, `MALLOC_MMAP_MAX_` and `MALLOC_ARENA_MAX` take precedence.

    Returns:
        Whether it took effect: False without glibc or where one of those variables is set.
    """
    if sys.platform != "linux" or {"MALLOC_MMAP_THRESHOLD_", *MALLOC} & os.environ.keys():
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and all(mallopt(*setting) for setting in MALLOC.values())
