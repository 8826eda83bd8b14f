"""The `ale` backend: worker processes, each of which steps a block of emulators into shared memory.

`ALEInterface.act` holds Python's global interpreter lock, so threads do not scale and processes do. The shared memory is an unnamed file,
and each worker ends when its socket closes: however the pool or its process ends, nothing stays behind.
"""

import dataclasses
import itertools
import mmap
import os
import selectors
import sys
import tempfile
import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import ale_py
import cloudpickle
import numpy as np

from ocjax.envs import states as saved
from ocjax.envs._worker import interface
from ocjax.envs._worker.interface import AUTORESET_MODES, NEXT_STEP, SCREENS, WorkerConfig
from ocjax.envs._worker.program import EmulatorBlock
from ocjax.envs.pool import EmulatorPool, Report, action_set, check_rom, load_emulator
from ocjax.envs.process import WorkerError, WorkerProcess, end_workers
from ocjax.envs.settings import Settings
from ocjax.envs.states import States
from ocjax.game import Game

Hook = Callable[[np.ndarray], None]

_MIN_SHARD = 64  # environments; smaller shards cost more in calls than they save by overlapping extraction with emulation
_SLOW_START = 1.0  # seconds after which the start of the emulators is reported
_REPORT_EVERY = 0.25  # seconds


class AlePool(EmulatorPool):
    """Emulators of one game in worker processes.

    Args:
        game: the game, whose ROM is checked.
        num_envs: number of emulators.
        settings: what a step and an episode are; by default those of "v5".
        num_workers: number of processes; by default one per core that this process may use, at most `num_envs`. With 0 the emulators are
            stepped in this process.
        screens: the pixel arrays to record, of "screen", "gray" and "rgb" (see `EmulatorPool`). Without any, no pixel is touched.
        autoreset: what happens after the step that ends an episode: "next step" (the next step starts an episode, and its action is
            ignored), "same step" (the same step starts an episode, and `arrays.final` preserves the end of the last one), or "disabled"
            (the environment must be reset; the next step is an error).
        game_mode: game mode as ale-py numbers it, one for all emulators or one each; None for the game's default.
        game_difficulty: game difficulty, likewise.
        hook: called before every emulated frame with the RAM of one emulator, uint8 `[128]`. What it writes into the array is written to
            the console. Workers receive it by value, so it may refer to modules and constants, but not to variables that change.

    Raises:
        RomError: a ValueError; the ROM is missing, or is not the one that the game's decoder was written for.
        ValueError: an argument is out of range.
        WorkerError: a worker could not be started.
    """

    def __init__(
        self,
        game: Game,
        num_envs: int,
        settings: Settings | None = None,
        *,
        num_workers: int | None = None,
        screens: Sequence[str] = (),
        autoreset: str = NEXT_STEP,
        game_mode: int | Sequence[int | None] | None = None,
        game_difficulty: int | Sequence[int | None] | None = None,
        hook: Hook | None = None,
    ) -> None:
        _check(num_envs, num_workers, screens, autoreset)
        self.game, self.num_envs, self.settings = game, num_envs, settings or Settings()
        ale = load_emulator(game)
        self.actions = action_set(ale, self.settings)
        modes = self._one_each("mode", game_mode, ale.getAvailableModes())
        difficulties = self._one_each("difficulty", game_difficulty, ale.getAvailableDifficulties())
        config = self._config(tuple(screens), autoreset, modes, difficulties, hook)
        self._workers: list[WorkerProcess] = []
        self._selector = selectors.DefaultSelector()
        self._local: EmulatorBlock | None = None  # the emulators, where they are in this process
        self._finalizer = weakref.finalize(self, end_workers, self._workers, self._selector)
        self._step_pending = False
        self.shards = [slice(0, num_envs)]
        if num_workers == 0:
            memory = mmap.mmap(-1, interface.memory_size(config))
            self.arrays, self._commands = interface.shared_arrays(memory, config)
            self._local = EmulatorBlock(config, self.arrays, self._commands)
        else:
            self._start_workers(config, min(num_workers or _available_cores(), num_envs))

    def _config(
        self,
        screens: tuple[str, ...],
        autoreset: str,
        modes: tuple[int | None, ...],
        difficulties: tuple[int | None, ...],
        hook: Hook | None,
    ) -> WorkerConfig:
        """The configuration of one worker that steps all emulators."""
        s = self.settings
        return WorkerConfig(
            num_envs=self.num_envs,
            block=(0, self.num_envs),
            screen_size=self.game.screen,
            screens=screens,
            autoreset=autoreset,
            rom_path=str(check_rom(self.game)),
            actions=tuple(int(a.value) for a in self.actions),
            frame_skip=s.skip_range,
            repeat_action_probability=s.repeat_action_probability,
            max_episode_frames=s.max_episode_frames,
            noop_max=s.noop_max,
            start_actions=self._start_actions(),
            episodic_life=s.episodic_life,
            game_modes=modes,
            game_difficulties=difficulties,
            hook=None if hook is None else _pickle_by_value(hook).hex(),
        )

    def _start_actions(self) -> tuple[int, ...]:
        """The actions that each episode starts with: FIRE and the next one, in games whose second action is FIRE."""
        needs_fire = self.actions[1] == ale_py.Action.FIRE and len(self.actions) > 2
        return (1, 2) if self.settings.fire_reset and needs_fire else ()

    def _one_each(self, name: str, value: int | Sequence[int | None] | None, known: Sequence[int]) -> tuple[int | None, ...]:
        """The game mode or difficulty of each emulator."""
        values = [value] * self.num_envs if value is None or isinstance(value, int | np.integer) else list(value)
        if len(values) != self.num_envs:
            raise ValueError(f"a sequence of {name} values must have one per environment, {self.num_envs}, got {len(values)}")
        for v in values:
            if v is not None and v not in known:
                raise ValueError(f"{self.game.name} has no {name} {v}; it has {list(known)}")
        return tuple(None if v is None else int(v) for v in values)

    def _start_workers(self, config: WorkerConfig, num_workers: int) -> None:
        """Make the shared memory, divide the emulators among workers, and start these."""
        size = interface.memory_size(config)
        folder = "/dev/shm" if Path("/dev/shm").is_dir() else None
        with tempfile.TemporaryFile(dir=folder) as file:  # workers inherit the descriptor, so the file may be closed afterwards
            file.truncate(size)
            self.arrays, self._commands = interface.shared_arrays(mmap.mmap(file.fileno(), size), config)
            num_shards = _num_shards(self.num_envs, num_workers)
            self.shards = [slice(*pair) for pair in _even_blocks(self.num_envs, num_shards)]
            for i, block in enumerate(_even_blocks(self.num_envs, num_workers)):
                worker = WorkerProcess(file.fileno(), dataclasses.replace(config, block=block))
                self._workers.append(worker)
                self._selector.register(worker.link, selectors.EVENT_READ, (worker, i * num_shards // num_workers))

    def reset(self, seeds: Sequence[int | None] | None = None, mask: np.ndarray | None = None, report: Report | None = None) -> None:
        """Start new episodes; see `EmulatorPool.reset`.

        Seeds are used as in ale-py's Gymnasium environments: equal seeds give equal episodes. An emulator that gets a seed, or is reset
        for the first time, is made anew, which takes about 0.1 s of its worker's time.
        """
        commands = self._commands
        commands.seed[:] = -1 if seeds is None else [-1 if s is None else s for s in seeds]
        chosen = np.ones(self.num_envs, bool) if mask is None else mask
        commands.loaded[chosen & (commands.seed >= 0)] = False
        commands.chosen[:] = chosen
        self._send(interface.RESET)
        self._receive_replies(report)

    def clone_state(self) -> States:
        """Save the state of every emulator, its random state included. All emulators must have been reset."""
        self._send(interface.SAVE)
        self.wait()
        return saved.collect(self.game.md5, self.arrays, self._commands)

    def restore_state(self, states: States, mask: np.ndarray | None = None) -> None:
        """Restore saved states; see `EmulatorPool.restore_state`.

        From then on the same actions give the same frames. ALE's states lack the action that a sticky frame repeats; it is assumed to be
        the last action sent, which is wrong where that action was not taken over in any frame of its step: in 0.4 % of steps of 4 frames
        with repeat_action_probability 0.25.

        Raises:
            ValueError: the states are of another game or number, or were saved without frames that this pool records.
        """
        chosen = np.ones(self.num_envs, bool) if mask is None else mask
        saved.distribute(states, self.game.md5, self.arrays, self._commands, chosen)
        self._commands.chosen[:] = chosen
        self._send(interface.RESTORE)
        self.wait()

    def set_ram(self, ram: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Write the RAM of emulators, only the bytes that differ; see `EmulatorPool.set_ram`."""
        if not isinstance(ram, np.ndarray) or ram.dtype != np.uint8:
            raise TypeError(f"ram must be a uint8 array, got {getattr(ram, 'dtype', type(ram).__name__)}")
        if ram.shape not in ((128,), (self.num_envs, 128)):
            raise ValueError(f"ram must have shape [{self.num_envs}, 128] or [128], got {list(ram.shape)}")
        self._commands.new_ram[:] = ram
        self._commands.chosen[:] = True if mask is None else mask
        self._send(interface.WRITE)
        self.wait()

    def emulator(self, i: int) -> ale_py.ALEInterface:
        """The emulator of one environment, once it has been reset; only with `num_workers=0`.

        Raises:
            ValueError: the emulators are in worker processes.
        """
        if self._local is None:
            raise ValueError("the emulators are in worker processes: make them with num_workers=0")
        return self._local.emulators[i].ale

    def send(self, actions: np.ndarray) -> None:
        """Start a step without waiting for it; see `EmulatorPool.send`."""
        self._commands.action[:] = actions
        self._send(interface.STEP)

    def wait(self) -> None:
        """Wait for the step of all emulators.

        Raises:
            WorkerError: a worker failed or died, and the pool has been closed.
        """
        self._receive_replies()

    def as_completed(self) -> Iterator[int]:
        """Wait for the step: yield the index of each shard as soon as its emulators have finished.

        Raises:
            WorkerError: a worker failed or died, and the pool has been closed.
        """
        if self._local:
            yield 0
            return
        missing = [len(self._workers) // len(self.shards)] * len(self.shards)
        with self._receiving():
            while any(missing):
                for shard in self._next_replies():
                    missing[shard] -= 1
                    if not missing[shard]:
                        yield shard

    def _send(self, command: bytes) -> None:
        """Send a command to all workers, or execute it here."""
        if self.closed:
            raise WorkerError("the pool is closed")
        if self._step_pending:
            raise RuntimeError("a step is pending: call wait() first")
        try:
            if self._local:
                self._local.execute(command)
                return
            self._step_pending = True
            for worker in self._workers:
                worker.send(command)
        except BaseException:
            self.close()
            raise

    def _receive_replies(self, report: Report | None = None) -> None:
        """Receive the replies of all workers; while they are slow to come, report how many emulators have loaded their ROM."""
        missing, timeout = len(self._workers), None if report is None else _SLOW_START
        with self._receiving():
            while missing:
                replies = self._next_replies(timeout)
                missing -= len(replies)
                if report is not None and missing and not replies:
                    report(int(self._commands.loaded.sum()))
                    timeout = _REPORT_EVERY

    def _next_replies(self, timeout: float | None = None) -> list[int]:
        """Wait for at least one reply, at most `timeout` seconds; return the shards of the workers that replied."""
        shards = []
        for key, _ in self._selector.select(timeout):
            worker, shard = key.data
            worker.receive_reply()
            shards.append(shard)
        return shards

    @contextmanager
    def _receiving(self) -> Iterator[None]:
        """Close the pool if receiving replies is interrupted: the remaining replies would be taken for those to the next command."""
        try:
            yield
        except BaseException:
            self.close()
            raise
        self._step_pending = False

    @property
    def closed(self) -> bool:
        """Whether the pool has been closed."""
        return not self._finalizer.alive

    def close(self) -> None:
        """End the workers. Further calls have no effect."""
        self._local = None
        self._finalizer()


def _check(num_envs: int, num_workers: int | None, screens: Sequence[str], autoreset: str) -> None:
    if num_envs < 1:
        raise ValueError(f"num_envs must be at least 1, got {num_envs}")
    if num_workers is not None and num_workers < 0:
        raise ValueError(f"num_workers must not be negative, got {num_workers}")
    if autoreset not in AUTORESET_MODES:
        raise ValueError(f"autoreset must be one of {', '.join(map(repr, AUTORESET_MODES))}, got {autoreset!r}")
    if not set(screens) <= set(SCREENS):
        raise ValueError(f"screens must be of {', '.join(map(repr, SCREENS))}, got {screens}")


def _available_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _even_blocks(n: int, num_blocks: int) -> Iterator[tuple[int, int]]:
    """Divide n rows into consecutive blocks of nearly equal size: the first row of each, and one past the last."""
    return itertools.pairwise(k * n // num_blocks for k in range(num_blocks + 1))


def _num_shards(num_envs: int, num_workers: int) -> int:
    """The largest number of shards of equal size and whole workers that keeps a shard at `_MIN_SHARD` environments or more."""
    divisors = [k for k in range(1, num_workers + 1) if num_workers % k == 0 and num_envs % k == 0]
    return max((k for k in divisors if num_envs // k >= _MIN_SHARD), default=1)


def _pickle_by_value(hook: Hook) -> bytes:
    """Pickle a function so that a process without its module can load it."""
    module = sys.modules.get(hook.__module__)
    if module is None or hook.__module__ == "__main__":
        return cloudpickle.dumps(hook)
    cloudpickle.register_pickle_by_value(module)
    try:
        return cloudpickle.dumps(hook)
    finally:
        cloudpickle.unregister_pickle_by_value(module)
