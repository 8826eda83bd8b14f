"""Independent tasks, in this process or spread over a Ray cluster (extra `ray`)."""

import logging
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ocjax._extras import extras


def completed(
    function: Callable[[Any], object], tasks: Sequence[Any], ray: str | None = None
) -> Iterator[Any]:
    """Execute a function for each task, and yield each task when it is done.

    If a machine of a cluster disappears, its tasks are executed again. Therefore, executing a task
    twice must have no further effect, and tasks must read and write files that all machines share.

    Args:
        ray: None to execute the tasks in this process, "local" for Ray on this machine, "auto" for
            the running cluster that this machine is part of, or the address of a cluster.
    """
    if ray is None:
        for task in tasks:
            function(task)
            yield task
    else:
        yield from _on_cluster(function, tasks, ray)


def _on_cluster(
    function: Callable[[Any], object], tasks: Sequence[Any], address: str
) -> Iterator[Any]:
    with extras():
        import ray  # pyright: ignore[reportMissingImports]
        from ray.exceptions import RayTaskError  # pyright: ignore[reportMissingImports]
    try:
        connection = ray.init(
            address, ignore_reinit_error=True, log_to_driver=False, logging_level=logging.ERROR
        )
    except (ConnectionError, RuntimeError) as error:
        raise ValueError(f"there is no Ray cluster at {address!r}: {error}") from error
    with connection:
        remote = ray.remote(lambda task: function(task)).options(num_cpus=1, max_retries=-1)
        left = {remote.remote(task): task for task in tasks}
        while left:
            done, _ = ray.wait(list(left), num_returns=1)
            try:
                ray.get(done)
            except RayTaskError as error:
                raise error.cause from None
            yield left.pop(done[0])
