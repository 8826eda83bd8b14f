"""The latest checkpoint of a training, in Orbax's format."""

import os
import shutil
from pathlib import Path
from typing import Any

import jax
import numpy as np
import orbax.checkpoint as ocp

UNFINISHED = "*.orbax-checkpoint-tmp*"  # Orbax's name of an unfinished checkpoint
RESERVE = "space.orbax-checkpoint-tmp"
OVERHEAD = 2**20  # maximal bytes of a checkpoint besides its arrays: about fifty small files


class Checkpoints:
    """Checkpoints in a folder. A new one is complete before the previous one is deleted.

    Args:
        folder: created if necessary. Remains of interrupted writes are deleted.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(exist_ok=True)
        self._delete_unfinished()
        options = ocp.CheckpointManagerOptions(max_to_keep=1, enable_async_checkpointing=False)
        self._manager = ocp.CheckpointManager(folder, options=options)

    @property
    def latest(self) -> int | None:
        """The number of the latest checkpoint, or None without a checkpoint."""
        return self._manager.latest_step()

    def save(self, number: int, state: Any, environments: Any, progress: Any) -> None:
        """Write a checkpoint."""
        items = {
            "state": ocp.args.StandardSave(state),  # pyright: ignore[reportCallIssue]
            "environments": ocp.args.StandardSave(environments),  # pyright: ignore[reportCallIssue]
            "progress": ocp.args.JsonSave(progress),  # pyright: ignore[reportCallIssue]
        }
        try:
            self._try_space(
                sum(np.asarray(leaf).nbytes for leaf in jax.tree.leaves((state, environments)))
                + OVERHEAD
            )
            self._manager.save(number, args=ocp.args.Composite(**items))
        except Exception as error:  # Orbax and TensorStore raise many types
            raise OSError(f"{type(error).__name__}: {error}".splitlines()[0]) from error
        finally:
            self._delete_unfinished()

    def _try_space(self, size: int) -> None:
        """Check that the disk has `size` free bytes.

        Orbax's threads would log pages of errors long after raising the first one.
        """
        path = self._folder / RESERVE
        try:
            with path.open("wb") as file:
                file.write(os.urandom(size))
                file.flush()
                os.fsync(file.fileno())
        finally:
            path.unlink(missing_ok=True)

    def restore(self, number: int, state: Any) -> Any:
        """Read a checkpoint: a mapping with the arguments of `save`.

        Args:
            state: a pytree of arrays with the same structure, shapes and dtypes.
        """
        items = {
            "state": ocp.args.StandardRestore(state),  # pyright: ignore[reportCallIssue]
            "environments": ocp.args.StandardRestore(),  # pyright: ignore[reportCallIssue]
            "progress": ocp.args.JsonRestore(),  # pyright: ignore[reportCallIssue]
        }
        return self._manager.restore(number, args=ocp.args.Composite(**items))

    def close(self) -> None:
        """Release Orbax's resources."""
        self._manager.close()

    def _delete_unfinished(self) -> None:
        for path in self._folder.glob(UNFINISHED):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)  # threads of Orbax may still write to it
            else:
                path.unlink()
