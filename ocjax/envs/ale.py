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
import time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Self

import ale_py
import cloudpickle
import numpy as np
from ale_py import roms
from rich.console import Console
from rich.progress import Progress

from ocjax.envs import _worker
from ocjax.envs.protocol import Protocol
from ocjax.game import Game

Hook = Callable[[np.ndarray], None]

# Of an environment's rows in the shared memory, what a saved state holds.
_STATE = (*_worker.KEPT, "reward", "terminated", "truncated", "started", "state", "state_bytes")
_PART = 64  # environments that it pays to look at while others are still being stepped
_SLOW = 1.0  # seconds after which the start of the emulators shows how far it is


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


@dataclass(frozen=True)
class States:
    """Saved states of emulators, from `AlePool.clone_state`; may be indexed, pickled, and restored into any pool of the game."""

    md5: str  # of the ROM
    rows: Mapping[str, np.ndarray]  # each [n, ...]: the emulator, and what was observed of it

    def __len__(self) -> int:
        return len(self.rows["state"])

    def __getitem__(self, index: Any) -> Self:
        """The states at an index, slice or mask; a single one is a batch of one."""
        if isinstance(index, int | np.integer):
            index = [index]
        return type(self)(self.md5, {k: v[index] for k, v in self.rows.items()})


class AlePool:
    """Emulators of one game in worker processes.

    The arrays `ram` (uint8 `[N, 128]`), `reward` (float64, as the game gives it), `terminated`, `truncated` (bool), `started` (bool: an
    episode began in this step), `lives` (int32), `frame_number` (int64, emulated frames of the game), `episode_return` (float64) and
    `episode_length` (int64, agent steps), both of the game, all `[N]`, are views of the shared memory, valid until the next call. So are
    those of `screens`: `screen` (uint8 `[N, 2, H, 160]`: palette indices of the last two emulated frames, the latest second), `gray` (the
    same in shades of grey) and `rgb` (uint8 `[N, 1, H, 160, 3]`: the last frame). With same-step autoreset `final_ram` and so on hold what
    was there when an episode last ended.

    Args:
        game: what to run; its ROM is checked.
        num_envs: number of emulators.
        protocol: what a step and an episode are.
        num_workers: number of processes; by default one a core that this process may use, at most `num_envs`. 0: none, they are stepped
            in this process.
        screens: which of the arrays of pixels are wanted; without, no pixel is touched.
        autoreset: what happens to an environment whose episode ended: "next step" (it restarts in the step after, whose action is
            ignored), "same step", or "disabled" (nothing; stepping it is an error).
        game_mode, game_difficulty: as ale-py numbers them, one for all or one an emulator; None for the game's default.
        hook: called before every emulated frame with the RAM, uint8 `[128]`, of one emulator; what it writes into it is written to the
            console. It goes to the workers by value, so it may refer to modules and constants, not to what changes.

    Raises:
        RomError, ValueError: a wrong ROM or argument.
        WorkerError: a worker could not be started.
    """

    def __init__(
        self,
        game: Game,
        num_envs: int,
        protocol: Protocol | None = None,
        *,
        num_workers: int | None = None,
        screens: Sequence[str] = (),
        autoreset: str = _worker.NEXT_STEP,
        game_mode: int | Sequence[int | None] | None = None,
        game_difficulty: int | Sequence[int | None] | None = None,
        hook: Hook | None = None,
    ) -> None:
        if num_envs < 1:
            raise ValueError(f"num_envs must be at least 1, got {num_envs}")
        if num_workers is not None and num_workers < 0:
            raise ValueError(f"num_workers must not be negative, got {num_workers}")
        if autoreset not in (_worker.NEXT_STEP, _worker.SAME_STEP, _worker.DISABLED):
            raise ValueError(f"autoreset must be 'next step', 'same step' or 'disabled', got {autoreset!r}")
        if not set(screens) <= set(_worker.SCREENS):
            raise ValueError(f"screens must be of {', '.join(_worker.SCREENS)}, got {screens}")
        self.game, self.num_envs, self.autoreset = game, num_envs, autoreset
        self.protocol = p = protocol or Protocol()
        path = check_rom(game)
        ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
        ale = ale_py.ALEInterface()
        ale.loadROM(path)
        self.actions = tuple(ale.getLegalActionSet() if p.full_action_space else ale.getMinimalActionSet())
        fire = p.fire_reset and self.actions[1] == ale_py.Action.FIRE and len(self.actions) > 2
        self._config = {
            "num_envs": num_envs, "share": (0, num_envs), "size": game.screen, "screens": list(screens), "autoreset": autoreset,
            "rom_path": str(path), "actions": [int(a.value) for a in self.actions], "frame_skip": p.skip_range,
            "repeat_action_probability": p.repeat_action_probability, "max_episode_frames": p.max_episode_frames, "noop_max": p.noop_max,
            "fire": [1, 2] if fire else [], "episodic_life": p.episodic_life, "hook": None if hook is None else _by_value(hook).hex(),
            "game_mode": self._each("mode", game_mode, ale.getAvailableModes()),
            "game_difficulty": self._each("difficulty", game_difficulty, ale.getAvailableDifficulties()),
        }  # fmt: skip
        _, n_bytes = _worker.layout(self._config)
        self._workers: list[_Worker] = []
        self._selector = selectors.DefaultSelector()
        self._local: _worker.Share | None = None
        self._finalizer = weakref.finalize(self, _close, self._workers, self._selector)
        self._waiting = False
        self.parts = [slice(0, num_envs)]
        if num_workers == 0:
            self._arrays = _worker.view(mmap.mmap(-1, n_bytes), self._config)
            self._local = _worker.Share(self._config, self._arrays)
            return
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        file: IO[bytes] = tempfile.TemporaryFile(dir="/dev/shm" if Path("/dev/shm").is_dir() else None)  # noqa: SIM115  # closed below
        with file:
            file.truncate(n_bytes)
            self._arrays = _worker.view(mmap.mmap(file.fileno(), n_bytes), self._config)
            n = min(num_workers or cores, num_envs)
            count = _num_parts(num_envs, n)
            self.parts = [slice(i * num_envs // count, (i + 1) * num_envs // count) for i in range(count)]
            for i, share in enumerate(itertools.pairwise(k * num_envs // n for k in range(n + 1))):
                worker = _Worker(file.fileno(), {**self._config, "share": share})
                self._workers.append(worker)
                self._selector.register(worker.link, selectors.EVENT_READ, (worker, i * count // n))

    def _each(self, name: str, value: int | Sequence[int | None] | None, known: Sequence[int]) -> list[int | None]:
        """A mode or difficulty for each emulator."""
        several = [value] * self.num_envs if value is None or isinstance(value, int | np.integer) else list(value)
        if len(several) != self.num_envs:
            raise ValueError(f"of several {name} values there must be one an environment, {self.num_envs}, got {len(several)}")
        for v in several:
            if v is not None and v not in known:
                raise ValueError(f"{self.game.name} has no {name} {v}; it has {list(known)}")
        return [None if v is None else int(v) for v in several]

    def __getattr__(self, name: str) -> np.ndarray:
        arrays = self.__dict__.get("_arrays", {})
        if name in arrays:
            return arrays[name]
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")

    def __contains__(self, name: str) -> bool:
        """Whether there is an array of this name."""
        return name in self._arrays

    def reset(self, seeds: Sequence[int | None] | None = None, mask: np.ndarray | None = None) -> None:
        """Restart emulators. The first time takes 0.1 s an emulator and worker; a terminal shows how far it is.

        Args:
            seeds: one an emulator, not negative; None goes on with the random numbers that it has. As gymnasium's own environments use
                them: equal seeds give equal episodes.
            mask: bool `[N]`, which to restart; all by default.
        """
        self._arrays["seed"][:] = -1 if seeds is None else [-1 if s is None else s for s in seeds]
        chosen = np.ones(self.num_envs, bool) if mask is None else mask
        self._arrays["loaded"][chosen & (self._arrays["seed"] >= 0)] = False
        self._do(_worker.RESET, chosen)

    def clone_state(self) -> States:
        """The present state of every emulator, its random numbers included. All must have been reset."""
        self._do(_worker.SAVE, None)
        rows = {k: self._arrays[k].copy() for k in _STATE if k in self._arrays}
        rows["state"] = rows["state"][:, : rows["state_bytes"].max()].copy()
        return States(self.game.md5, rows)

    def restore_state(self, states: States, mask: np.ndarray | None = None) -> None:
        """Put emulators into saved states. What the arrays show is what they showed when the states were saved, the frames included.

        The same actions then have the same consequences, frame by frame. One thing the emulator does not save is the action that a sticky
        frame repeats: it is taken to be the last one sent (wrong where that had not been taken over in any of the step's frames:
        0.4 % of steps of 4 frames).

        Args:
            states: one an emulator, or a single one for all.
            mask: bool `[N]`, which to restore; all by default.

        Raises:
            ValueError: states of another game or number, or saved without the frames that this pool shows.
        """
        if states.md5 != self.game.md5:
            raise ValueError(f"the states are of the ROM with md5 {states.md5}, {self.game.name} has {self.game.md5}")
        if len(states) not in (1, self.num_envs):
            raise ValueError(f"there must be 1 or {self.num_envs} states, got {len(states)}")
        wanted = [k for k in _STATE if k in self._arrays]
        missing = set(wanted) - set(states.rows)
        if missing:
            raise ValueError(f"the states were saved without {', '.join(sorted(missing))}, which this pool shows")
        chosen = np.ones(self.num_envs, bool) if mask is None else mask
        for name in wanted:
            rows = np.broadcast_to(states.rows[name], (self.num_envs, *states.rows[name].shape[1:]))[chosen]
            target = self._arrays[name]
            if name == "state":
                target = target[:, : rows.shape[1]]
            target[chosen] = rows
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

    def emulator(self, i: int) -> ale_py.ALEInterface:
        """An emulator itself, where they are in this process (`num_workers=0`) and have been reset.

        Raises:
            ValueError: they are in other processes.
        """
        if self._local is None:
            raise ValueError("the emulators are in worker processes: make them with num_workers=0")
        return self._local.emulators[i].ale

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
        with self._taking_up():
            if self._arrays["loaded"].all():
                self._collect(len(self._workers))
            else:
                self._collect_shown()

    def finished(self) -> Iterator[int]:
        """Wait for the step to end: numbers of `parts`, each as soon as its emulators have ended it.

        Raises:
            WorkerError: a worker failed or died; the pool is closed then.
        """
        if self._local:
            yield 0
            return
        left = [len(self._workers) // len(self.parts)] * len(self.parts)
        with self._taking_up():
            while any(left):
                for part in self._answered():
                    left[part] -= 1
                    if not left[part]:
                        yield part

    @contextmanager
    def _taking_up(self) -> Iterator[None]:
        """Whoever fails to take up all answers, be it by an interrupt, cannot go on: the pool is closed."""
        try:
            yield
        except BaseException:
            self.close()
            raise
        self._waiting = False

    def _answered(self, timeout: float | None = None) -> list[int]:
        """Wait for answers: of which parts the workers are that gave one."""
        parts = []
        for key, _ in self._selector.select(timeout):
            worker, part = key.data
            worker.answer()
            parts.append(part)
        return parts

    def _collect(self, left: int, timeout: float | None = None) -> int:
        """Take so many answers, or those that come in time; how many are left."""
        end = None if timeout is None else time.monotonic() + timeout
        while left and (end is None or time.monotonic() < end):
            left -= len(self._answered(timeout))
        return left

    def _collect_shown(self) -> None:
        """Take all answers; show how many emulators are there, where their start takes long."""
        left = self._collect(len(self._workers), _SLOW)
        if left:
            with Progress(transient=True, disable=not sys.stderr.isatty(), console=Console(stderr=True)) as progress:
                task = progress.add_task(f"starting {self.num_envs} emulators", total=self.num_envs)
                while left:
                    progress.update(task, completed=int(self._arrays["loaded"].sum()))
                    left = self._collect(left, _SLOW / 4)

    def _ask(self, command: bytes) -> None:
        if not self._finalizer.alive:
            raise WorkerError("the pool is closed")
        if self._waiting:
            raise RuntimeError("a step is under way: call wait() first")
        try:
            if self._local:
                self._local.commands[command]()
                return
            self._waiting = True
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
        self._local = None
        self._finalizer()


def _num_parts(num_envs: int, num_workers: int) -> int:
    """Of how many parts of equal size, each of whole workers, a step's results are taken up: as many as keep a part large enough."""
    whole = [k for k in range(1, num_workers + 1) if num_workers % k == 0 and num_envs % k == 0]
    return max([k for k in whole if num_envs // k >= _PART], default=1)


def _by_value(hook: Hook) -> bytes:
    """A function as bytes that another process can read without having its module."""
    module = sys.modules.get(hook.__module__)
    if module is None or hook.__module__ == "__main__":
        return cloudpickle.dumps(hook)
    cloudpickle.register_pickle_by_value(module)
    try:
        return cloudpickle.dumps(hook)
    finally:
        cloudpickle.unregister_pickle_by_value(module)


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
