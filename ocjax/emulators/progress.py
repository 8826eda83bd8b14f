"""Progress bars for pools of emulators."""

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from rich.console import Console
from rich.progress import Progress

from ocjax.emulators.pool import StartReport


@contextmanager
def start_bar(num_envs: int) -> Iterator[StartReport | None]:
    """A callback for `EmulatorPool.reset` that shows the number of started emulators.

    It is None if stderr is not a terminal.
    """
    if sys.stderr is None or sys.stderr.closed or not sys.stderr.isatty():
        yield None
        return
    with ExitStack() as stack:
        progress = Progress(transient=True, console=Console(stderr=True))
        task = progress.add_task(f"starting {num_envs} emulators", total=num_envs)

        def report(started: int) -> None:
            if not progress.live.is_started:
                stack.enter_context(progress)
            progress.update(task, completed=started)

        yield report
