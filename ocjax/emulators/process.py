"""Worker processes: starting them, communicating with them, ending them."""

import contextlib
import fcntl
import json
import logging
import os
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ocjax.emulators.worker import interface
from ocjax.emulators.worker.interface import WorkerConfig

_PROGRAM = Path(interface.__file__).with_name("__main__.py")
_LOG = logging.getLogger("ocjax")
_GRACE = 2.0  # seconds for all workers together to exit
_DYING = 5.0  # seconds for a worker to exit after its socket has closed
_MESSAGE_BYTES = 4000  # bytes of a worker's stderr that an error quotes
# Seconds of one wait for replies; a suspended computer counts as one wait towards the time limit.
_SLICE = 1.0
_REPLIES = 256  # bytes; more replies than can be pending


class WorkerError(RuntimeError):
    """A worker process failed, died or did not reply; the pool has been closed."""


class WorkerProcess:
    """One worker process, the socket to it, and its stderr.

    Args:
        memory_fd: file descriptor of the shared memory.
        finished: int64 `[N]` in the shared memory; see `CommandArrays`.
    """

    def __init__(self, memory_fd: int, config: WorkerConfig, finished: np.ndarray) -> None:
        first, stop = config.block
        self.name = f"the worker of environments {first}-{stop - 1}"
        self._first, self._finished = first, finished
        with contextlib.ExitStack() as stack:
            self.stderr = stack.enter_context(tempfile.TemporaryFile())
            self.link, theirs = socket.socketpair()
            stack.enter_context(self.link)
            with (
                theirs,
                tempfile.TemporaryFile() as path,
                _inherited(theirs.fileno()) as link_fd,
                _inherited(memory_fd) as shared_fd,
            ):
                path.write(json.dumps(_module_path()).encode())  # too long for an argument
                path.seek(0)
                self.process = subprocess.Popen(
                    # -P keeps the program's folder off the worker's `sys.path`.
                    [sys.executable, "-P", *map(str, (_PROGRAM, link_fd, shared_fd, os.getpid()))],
                    pass_fds=(link_fd, shared_fd),
                    stdin=path,
                    stdout=subprocess.DEVNULL if sys.stdout is None else None,
                    stderr=self.stderr,
                    process_group=0,  # Ctrl-C in the terminal reaches the parent only
                )
            stack.pop_all()

    def configure(self, config: WorkerConfig, time_limit: float | None) -> None:
        """Send the configuration."""
        self.link.settimeout(time_limit)
        self.send(config.to_json().encode() + b"\n")
        self.link.settimeout(None)

    def send(self, message: bytes) -> None:
        """Send a message."""
        try:
            self.link.sendall(message)
        except TimeoutError as error:
            raise self.silence(self.link.gettimeout() or 0.0) from error
        except OSError as error:
            raise self._death() from error

    def receive(self) -> None:
        """Read replies from the socket.

        They only wake the pool up; `has_finished` reads the results.
        """
        try:
            replies = self.link.recv(_REPLIES)
        except OSError as error:
            raise self._death() from error
        if not replies:
            raise self._death()

    def has_finished(self, number: int) -> bool:
        """True if the worker has executed the command with a number."""
        finished = self._finished.item(self._first)
        if finished == -number:
            raise WorkerError(f"{self.name} failed:\n{self.complaint()}")
        return finished == number

    def _death(self) -> WorkerError:
        """The error that describes how the process ended."""
        try:
            code = self.process.wait(timeout=_DYING)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        how = (
            f"was killed by {signal.Signals(-code).name}"
            if code < 0
            else f"ended with exit status {code}"
        )
        text = self.complaint()
        return WorkerError(f"{self.name} {how}" + (f":\n{text}" if text else ""))

    def silence(self, seconds: float) -> WorkerError:
        """The error for a process that has not replied."""
        return WorkerError(
            f"{self.name} (process {self.process.pid}) is busy, hangs or is stopped: it has not "
            f"replied for {seconds:g} s, so the pool has been closed. Make new environments; if "
            "their steps, resets or hooks may take this long, give them a larger worker_timeout, "
            "or None"
        )

    def complaint(self) -> str:
        """The end of the process's stderr; see `program.limit_stderr`."""
        # The process shares the file's position, so this code must not move it.
        descriptor = self.stderr.fileno()
        start = max(0, os.fstat(descriptor).st_size - _MESSAGE_BYTES)
        return os.pread(descriptor, _MESSAGE_BYTES, start).decode(errors="replace").strip()


class Workers:
    """The worker processes of a pool, which all execute the same command at a time.

    Ctrl-C may interrupt any call; `completed` then continues with the command. Workers record the
    numbers of executed commands in the shared memory, and ignore a repeated one.

    Args:
        time_limit: seconds without a reply or other progress until an error, or None for no limit.
    """

    def __init__(self, time_limit: float | None) -> None:
        self.busy = False  # whether a command has been given but not been waited for
        self._time_limit, self._owner = time_limit, os.getpid()
        self._processes: list[WorkerProcess] = []
        self._selector = selectors.DefaultSelector()
        self._message, self._number, self._sent, self.steps = b"", 0, True, 0
        self._has_shown = False  # whether a worker's messages have been shown

    def __len__(self) -> int:
        return len(self._processes)

    def __iter__(self) -> Iterator[WorkerProcess]:
        return iter(self._processes)

    @property
    def forked(self) -> bool:
        """True if this process is a forked child of the process that started the workers."""
        return bool(self._processes) and os.getpid() != self._owner

    def start(self, memory_fd: int, config: WorkerConfig, finished: np.ndarray) -> None:
        """Start another worker; see `WorkerProcess`."""
        try:
            worker = WorkerProcess(memory_fd, config, finished)
        except OSError as error:
            raise WorkerError(
                f"worker {len(self) + 1} could not be started: {error}. Use fewer workers "
                "(num_workers), or give this process more resources"
            ) from error
        self._processes.append(worker)
        self._selector.register(worker.link, selectors.EVENT_READ, worker)
        worker.configure(config, self._time_limit)

    def command(self, command: bytes) -> None:
        """Give a command to all workers."""
        number, steps = self._number + 1, self.steps + (command == interface.STEP)
        message = interface.MESSAGE.pack(command, number)
        # CPython handles signals only at calls and jumps, so Ctrl-C cannot separate these
        # assignments.
        self._message, self._number, self.steps, self._sent, self.busy = (
            message,
            number,
            steps,
            False,
            True,
        )
        self._send()

    def _send(self) -> None:
        for worker in self._processes:
            worker.send(self._message)
        self._sent = True

    def completed(
        self, progress: Callable[[], int], interval: float | None = None
    ) -> Iterator[int]:
        """Wait for the command: yield the index of each worker as soon as it has executed it.

        Args:
            progress: called after `interval` seconds without a reply; a new number restarts the
                time limit.
            interval: seconds, at most one and the time limit, the default.
        """
        if not self._sent:
            self._send()
        patience = min(s for s in (interval, self._time_limit, _SLICE) if s is not None)
        waiting, silent, last = dict(enumerate(self._processes)), 0.0, progress()
        while True:
            for i in [i for i, worker in waiting.items() if worker.has_finished(self._number)]:
                del waiting[i]
                silent = 0.0
                yield i
            if not waiting:
                break
            if self._time_limit is not None and silent >= self._time_limit:
                silence = next(iter(waiting.values())).silence(silent)
                for worker in waiting.values():
                    worker.process.kill()  # it would not exit by itself
                raise silence
            events = self._selector.select(patience)
            for key, _ in events:
                key.data.receive()
            silent = 0.0 if events else silent + patience
            if not events and last != (last := progress()):
                silent = 0.0
        self.busy = False
        self._show_messages()

    def _show_messages(self) -> None:
        """Log once the stderr of a worker, such as a warning of a hook."""
        if self._has_shown:
            return
        for worker in self._processes:
            if text := worker.complaint():
                self._has_shown = True
                _LOG.warning(
                    "%s wrote to its standard error; more of this will not be shown:\n%s",
                    worker.name,
                    text,
                )
                return

    def end(self) -> None:
        """End all workers.

        A worker exits when its socket closes and its step ends, or else it is killed.
        """
        if not self.forked:  # in a forked child the workers are the parent's
            for worker in self._processes:
                with contextlib.suppress(OSError):  # the worker has exited
                    # `close` is not enough: forked children of this process also hold the socket.
                    worker.link.shutdown(socket.SHUT_RDWR)
            deadline = time.monotonic() + _GRACE
            for worker in self._processes:
                try:
                    worker.process.wait(timeout=max(0.0, deadline - time.monotonic()))
                except subprocess.TimeoutExpired:
                    worker.process.kill()
                    worker.process.wait()
        for worker in self._processes:
            worker.link.close()
            worker.stderr.close()
        self._processes.clear()
        self._selector.close()


def _module_path() -> list[str]:
    """This process's `sys.path`, for workers to import the modules of hooks."""
    try:
        folder = [str(Path.cwd())]
    except FileNotFoundError:  # the working directory has been deleted
        folder = []
    return [
        place
        for entry in sys.path
        if isinstance(entry, str)
        for place in ([entry] if entry else folder)
    ]


@contextlib.contextmanager
def _inherited(fd: int) -> Iterator[int]:
    """A copy of a file descriptor above the standard streams, which the worker replaces."""
    copy = fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, 3)
    try:
        yield copy
    finally:
        os.close(copy)
