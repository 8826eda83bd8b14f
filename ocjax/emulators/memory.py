"""Memory of pools: checks and allocation."""

import errno
import mmap
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

EMULATOR_BYTES = 700_000  # memory of an emulator with its ROM, in ale-py 0.12
_SHARED = Path("/dev/shm")
# Errors of a full file system.
_FULL = (
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
    errno.ENOMEM,
)
_GIGABYTE = 1e9


def check_memory(num_envs: int) -> None:
    """Check that this machine can hold `num_envs` emulators."""
    needed, total = (
        num_envs * EMULATOR_BYTES,
        os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"),
    )
    if needed > total:
        raise MemoryError(
            f"num_envs {num_envs:,} needs about {needed / _GIGABYTE:,.1f} GB of memory, and this "
            f"machine has {total / _GIGABYTE:,.1f} GB: "
            f"use at most {total // EMULATOR_BYTES:,}"
        )


@contextmanager
def shared_memory(size: int) -> Iterator[tuple[int, mmap.mmap]]:
    """Shared memory in an unnamed file.

    Yields the descriptor, which is closed afterwards, and the memory.
    """
    folder = _SHARED if _SHARED.is_dir() else Path(tempfile.gettempdir())
    with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
        try:
            _allocate(file.fileno(), size)
        except OSError as error:
            if error.errno not in _FULL:
                raise
            file.truncate(0)
            free = os.statvfs(folder).f_bavail * os.statvfs(folder).f_frsize
            raise MemoryError(
                f"the environments need {size / _GIGABYTE:.4f} GB in {folder}, where "
                f"{free / _GIGABYTE:.4f} GB are free: make fewer "
                "environments, or enlarge it (in a container with --shm-size)"
            ) from error
        yield file.fileno(), mmap.mmap(file.fileno(), size)


def _allocate(file: int, size: int) -> None:
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file, 0, size)
        return
    for start in range(0, size, mmap.ALLOCATIONGRANULARITY):  # macOS
        os.pwrite(file, bytes(min(mmap.ALLOCATIONGRANULARITY, size - start)), start)
