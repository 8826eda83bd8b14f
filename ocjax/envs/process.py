"""Worker processes, as their pool sees them."""

import selectors
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

from ocjax.envs._worker import interface
from ocjax.envs._worker.interface import WorkerConfig

_PROGRAM = Path(interface.__file__).with_name("__main__.py")
_GRACE = 2.0  # seconds that a worker has to end by itself
_MESSAGE_BYTES = 2000  # of a dead worker's stderr that an error quotes


class WorkerError(RuntimeError):
    """A worker process failed or died; the message says which one and why. The pool has been closed."""


class WorkerProcess:
    """One worker process, the socket to it, and its stderr.

    Args:
        memory_fd: file descriptor of the shared memory.
        config: the worker's configuration.

    Raises:
        WorkerError: the process died at once.
    """

    def __init__(self, memory_fd: int, config: WorkerConfig) -> None:
        first, stop = config.block
        self.name = f"the worker of environments {first}-{stop - 1}"
        self.link, theirs = socket.socketpair()
        self.stderr = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the process
        with theirs:
            self.process = subprocess.Popen(
                # -P keeps the program's folder off the worker's module path.
                [sys.executable, "-P", str(_PROGRAM), str(theirs.fileno()), str(memory_fd)],
                pass_fds=(theirs.fileno(), memory_fd),
                stdin=subprocess.DEVNULL,
                stderr=self.stderr,
                process_group=0,  # Ctrl-C in the terminal reaches the parent only
            )
        self.send(config.to_json().encode() + b"\n")

    def send(self, message: bytes) -> None:
        """Send a command.

        Raises:
            WorkerError: the process died.
        """
        try:
            self.link.sendall(message)
        except OSError as error:
            raise self._death() from error

    def receive_reply(self) -> None:
        """Receive the reply to a command.

        Raises:
            WorkerError: the process died, or the command failed.
        """
        if self._receive(1) == interface.ERROR:
            text = self._receive(int.from_bytes(self._receive(4), "big")).decode()
            raise WorkerError(f"{self.name} failed:\n{text}")

    def _receive(self, n: int) -> bytes:
        data = b""
        while len(data) < n:
            try:
                piece = self.link.recv(n - len(data))
            except OSError as error:
                raise self._death() from error
            if not piece:
                raise self._death()
            data += piece
        return data

    def _death(self) -> WorkerError:
        """The error that says how the process ended."""
        try:
            code = self.process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        self.stderr.seek(0)
        text = self.stderr.read()[-_MESSAGE_BYTES:].decode(errors="replace").strip()
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit status {code}"
        return WorkerError(f"{self.name} {how}" + (f":\n{text}" if text else ""))

    def join(self) -> None:
        """Wait for the process to end after its socket was closed; kill it if it does not."""
        try:
            self.process.wait(timeout=_GRACE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.stderr.close()


def end_workers(workers: list[WorkerProcess], selector: selectors.BaseSelector) -> None:
    """End all workers: each one ends when its socket closes, at the latest after its present step."""
    for worker in workers:
        worker.link.close()
    for worker in workers:
        worker.join()
    workers.clear()
    selector.close()
