"""The `ale` backend: worker processes, each stepping its share of the emulators into shared memory.

`ALEInterface.act` holds the interpreter's lock, so threads do not scale and processes do. The memory is an unnamed file and each
worker hangs on a socket: when the pool or its process goes away, in whatever manner, both go with it.
"""

import hashlib
import itertools
import json
import mmap
import os
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

import ale_py
import numpy as np
from ale_py import roms

from ocjax.envs import _worker
from ocjax.spec import Game


class WorkerError(RuntimeError):
    """A worker process failed or died; the message says which and why. The pool is closed."""


class RomError(ValueError):
    """A ROM other than the one that a game's decoder was written for."""


def check_rom(game: Game) -> Path:
    """The path of a game's ROM.

    Raises:
        RomError: a ValueError; the ROM that ale-py has is another one than the decoder was written for.
    """
    path = roms.get_rom_path(game.rom)
    if path is None:
        raise RomError(f"ale-py has no ROM {game.rom!r}, needed for {game.name}")
    found = hashlib.md5(Path(path).read_bytes()).hexdigest()
    if found != game.md5:
        raise RomError(f"the decoder of {game.name} was written for the ROM with md5 {game.md5}, {path} has {found}")
    return Path(path)


class AlePool:
    """Emulators of one game in worker processes.

    The arrays `ram` (uint8 `[N, 128]`), `reward` (float64), `terminated`, `truncated` (bool), `lives` (int32) and `frame_number` (int64,
    emulated frames of the episode) `[N]` are views of the shared memory, valid until the next call; so is, with `screens=True`,
    `screen` (uint8 `[N, 2, H, 160]`: palette indices of the last two emulated frames, the latest second).

    Args:
        game: what to run; its ROM is checked.
        num_envs: number of emulators.
        num_workers: number of processes; by default one a core that this process may use, at most `num_envs`.
        screens: whether frames are wanted; without, no pixel is touched.
        frame_skip: emulated frames a step, at least 1.
        repeat_action_probability: sticky actions, per emulated frame.
        max_episode_frames: emulated frames after which an episode is truncated.
        full_action_space: all 18 actions instead of the game's own.
        game_mode, game_difficulty: as ale-py numbers them; None for the game's default.

    Raises:
        RomError, ValueError: a wrong ROM or argument.
        WorkerError: a worker could not be started.
    """

    def __init__(
        self,
        game: Game,
        num_envs: int,
        *,
        num_workers: int | None = None,
        screens: bool = False,
        frame_skip: int = 4,
        repeat_action_probability: float = 0.25,
        max_episode_frames: int = 108_000,
        full_action_space: bool = False,
        game_mode: int | None = None,
        game_difficulty: int | None = None,
    ) -> None:
        if num_envs < 1 or frame_skip < 1 or max_episode_frames < 1:
            raise ValueError(
                f"num_envs, frame_skip and max_episode_frames must be at least 1, got {num_envs}, {frame_skip}, {max_episode_frames}"
            )
        if not 0 <= repeat_action_probability < 1:
            raise ValueError(f"repeat_action_probability must be in [0, 1), got {repeat_action_probability}")
        if num_workers is not None and num_workers < 1:
            raise ValueError(f"num_workers must be at least 1, got {num_workers}")
        path = check_rom(game)
        ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
        ale = ale_py.ALEInterface()
        ale.loadROM(path)
        for name, value, known in (
            ("mode", game_mode, ale.getAvailableModes()),
            ("difficulty", game_difficulty, ale.getAvailableDifficulties()),
        ):
            if value is not None and value not in known:
                raise ValueError(f"{game.name} has no {name} {value}; it has {list(known)}")
        self.game, self.num_envs = game, num_envs
        self.actions = tuple(ale.getLegalActionSet() if full_action_space else ale.getMinimalActionSet())
        self.frame_skip = frame_skip

        size = game.screen if screens else None
        _, n_bytes = _worker.layout(num_envs, size)
        file: IO[bytes] = tempfile.TemporaryFile(dir="/dev/shm" if Path("/dev/shm").is_dir() else None)  # noqa: SIM115  # closed below
        file.truncate(n_bytes)
        memory = mmap.mmap(file.fileno(), n_bytes)
        self._arrays = _worker.view(memory, num_envs, size)

        n = min(num_workers or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1, num_envs)
        edges = np.linspace(0, num_envs, n + 1).astype(int).tolist()
        self._workers: list[_Worker] = []
        self._selector = selectors.DefaultSelector()
        config = {
            "num_envs": num_envs, "screen": size, "rom_path": str(path), "actions": [int(a.value) for a in self.actions],
            "frame_skip": frame_skip, "repeat_action_probability": repeat_action_probability, "max_episode_frames": max_episode_frames,
            "mode": game_mode, "difficulty": game_difficulty,
        }  # fmt: skip
        self._finalizer = weakref.finalize(self, _close, self._workers, self._selector)
        for share in itertools.pairwise(edges):
            worker = _Worker(file.fileno(), {**config, "share": share})
            self._workers.append(worker)
            self._selector.register(worker.link, selectors.EVENT_READ, worker)
        file.close()
        self._waiting = False

    def __getattr__(self, name: str) -> np.ndarray:
        arrays = self.__dict__.get("_arrays", {})
        if name in ("ram", "reward", "terminated", "truncated", "lives", "frame_number", "screen") and name in arrays:
            return arrays[name]
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")

    def reset(self, seeds: Sequence[int | None] | None = None, mask: np.ndarray | None = None) -> None:
        """Restart emulators.

        Args:
            seeds: one an emulator, not negative; None goes on with the random numbers that it has. As ale-py's own environments use
                them: equal seeds give equal episodes.
            mask: bool `[N]`, which to restart; all by default.
        """
        self._arrays["seed"][:] = -1 if seeds is None else [-1 if s is None else s for s in seeds]
        self._do(_worker.RESET, mask)

    def save(self) -> None:
        """Keep the state of every emulator, for `restore`; it replaces the one kept before. All must have been reset."""
        self._do(_worker.SAVE, None)

    def restore(self, mask: np.ndarray | None = None) -> None:
        """Go back to what `save` kept. The frames in `screen` are those before, until the next step.

        Args:
            mask: bool `[N]`, which to restore; all by default.
        """
        self._do(_worker.RESTORE, mask)

    def set_ram(self, ram: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Write the RAM of emulators; `self.ram` shows it, the frames will with the next step.

        Args:
            ram: uint8 `[N, 128]`, or `[128]` for all; only the bytes that differ are written.
            mask: bool `[N]`, which to write; all by default.

        Raises:
            TypeError, ValueError: a wrong dtype or shape.
        """
        if not isinstance(ram, np.ndarray) or ram.dtype != np.uint8:
            raise TypeError(f"ram must be a uint8 array, got {getattr(ram, 'dtype', type(ram).__name__)}")
        if ram.shape not in ((128,), (self.num_envs, 128)):
            raise ValueError(f"ram must have shape [{self.num_envs}, 128] or [128], got {list(ram.shape)}")
        self._arrays["written"][:] = ram
        self._do(_worker.WRITE, mask)

    def _do(self, command: bytes, mask: np.ndarray | None) -> None:
        self._arrays["chosen"][:] = True if mask is None else mask
        self._ask(command)
        self.wait()

    def send(self, actions: np.ndarray) -> None:
        """Start a step: `actions` int `[N]`, indices into `self.actions`. An emulator whose episode ended restarts instead."""
        self._arrays["action"][:] = actions
        self._ask(_worker.STEP)

    def wait(self) -> None:
        """Wait for the step to end.

        Raises:
            WorkerError: a worker failed or died; the pool is closed then.
        """
        open_ = len(self._workers)
        try:
            while open_:
                for key, _ in self._selector.select():
                    key.data.answer()
                    open_ -= 1
        except BaseException:  # an interrupt too: half an answer cannot be taken up again
            self.close()
            raise
        self._waiting = False

    def _ask(self, command: bytes) -> None:
        if not self._finalizer.alive:
            raise WorkerError("the pool is closed")
        if self._waiting:
            raise RuntimeError("a step is under way: call wait() first")
        self._waiting = True
        try:
            for worker in self._workers:
                worker.ask(command)
        except BaseException:
            self.close()
            raise

    @property
    def closed(self) -> bool:
        """Whether the workers are gone."""
        return not self._finalizer.alive

    def close(self) -> None:
        """End the workers; may be called twice."""
        self._finalizer()


class _Worker:
    """One worker process, as seen from outside."""

    def __init__(self, memory_fd: int, config: dict[str, Any]) -> None:
        self.first, self.last = config["share"][0], config["share"][1] - 1
        self.link, theirs = socket.socketpair()
        self.stderr = tempfile.TemporaryFile()  # noqa: SIM115  # lives as long as the worker
        with theirs:
            self.process = subprocess.Popen(
                [sys.executable, _worker.__file__, str(theirs.fileno()), str(memory_fd)],
                pass_fds=(theirs.fileno(), memory_fd),
                stdin=subprocess.DEVNULL,
                stderr=self.stderr,
                process_group=0,  # a Ctrl-C in the terminal goes to the parent alone
            )
        self.ask(json.dumps(config).encode() + b"\n")

    def ask(self, message: bytes) -> None:
        try:
            self.link.sendall(message)
        except OSError as error:
            raise self.death() from error

    def answer(self) -> None:
        kind = self._receive(1)
        if kind == _worker.ERROR:
            text = self._receive(int.from_bytes(self._receive(4), "big")).decode()
            raise WorkerError(f"the worker of environments {self.first}-{self.last} failed:\n{text}")

    def _receive(self, n: int) -> bytes:
        data = b""
        while len(data) < n:
            try:
                part = self.link.recv(n - len(data))
            except OSError as error:
                raise self.death() from error
            if not part:
                raise self.death()
            data += part
        return data

    def death(self) -> WorkerError:
        try:
            code = self.process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        self.stderr.seek(0)
        text = self.stderr.read()[-2000:].decode(errors="replace").strip()
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit status {code}"
        return WorkerError(f"the worker of environments {self.first}-{self.last} {how}" + (f":\n{text}" if text else ""))


def _close(workers: list[_Worker], selector: selectors.BaseSelector) -> None:
    for worker in workers:
        worker.link.close()  # the worker ends when it sees this, at the latest after its step
    for worker in workers:
        try:
            worker.process.wait(timeout=2)
        except subprocess.TimeoutExpired:
            worker.process.kill()
            worker.process.wait()
        worker.stderr.close()
    workers.clear()
    selector.close()
