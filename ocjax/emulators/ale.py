"""The `ale` backend: worker processes that step blocks of emulators into shared memory.

`ALEInterface.act` holds Python's global interpreter lock, so processes scale and threads do not.
The shared memory is an unnamed file, and a worker exits when its socket closes or its parent exits,
so the pool always cleans up. A call validates its arguments before it writes to the shared memory.
Ctrl-C may interrupt a call; further calls are possible.
"""

import dataclasses
import itertools
import math
import mmap
import os
import time
import weakref
from collections.abc import Iterator, Sequence
from typing import Any

import ale_py
import numpy as np
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError

from ocjax.emulators import states as saved
from ocjax.emulators.checks import (
    NOT_RESET,
    action_array,
    integer,
    is_integer,
    mask_array,
    seed_list,
)
from ocjax.emulators.hooks import Hook, Hooks, pickled_hooks
from ocjax.emulators.memory import check_memory, shared_memory
from ocjax.emulators.pool import EmulatorPool, StartReport
from ocjax.emulators.process import WorkerError, Workers
from ocjax.emulators.settings import Settings
from ocjax.emulators.start import action_set, check_rom, load_emulator
from ocjax.emulators.states import States
from ocjax.emulators.worker import interface
from ocjax.emulators.worker.emulator import FULL
from ocjax.emulators.worker.interface import (
    AUTORESET_MODES,
    GRAY,
    NEXT_STEP,
    POOLED,
    SCREENS,
    WorkerConfig,
)
from ocjax.emulators.worker.program import EmulatorBlock
from ocjax.extraction.arrays import require_uint8
from ocjax.extraction.game import Game

WORKER_TIMEOUT = 60.0  # seconds

_MOST = 2**31 - 1
# Environments; in smaller shards, calls cost more than overlapped extraction saves.
_MIN_SHARD = 64
_SLOW_START = 1.0  # seconds after which the start of the emulators is reported
_REPORT_EVERY = 0.25  # seconds

Pickled = tuple[tuple[str, str], ...]  # names and texts of hooks, see `pickled_hooks`


class AlePool(EmulatorPool):
    """Emulators of one game in worker processes.

    Args:
        game: the game; its ROM is checked.
        num_envs: number of emulators.
        settings: the emulation settings; by default the preset "v5".
        num_workers: number of processes; by default one per available core, at most `num_envs`.
            With 0 the emulators are stepped in this process.
        screens: the pixel arrays to record, of "screen", "gray", "pooled" (with "gray") and "rgb";
            by default none. See `EmulatorPool`.
        autoreset: what happens after the step that ends an episode: "next step" (the next step
            starts an episode, and its action is ignored), "same step" (the same step starts an
            episode, and `arrays.final` preserves the end of the last one), or "disabled" (the next
            step is an error until a reset).
        game_mode, game_difficulty: ale-py's numbers, one for all emulators or one each; by default
            the game's own.
        hook: a function, or a sequence of functions, called before every emulated frame with the
            RAM of one emulator, uint8 `[128]`. Changes to the array are written to the console.
            Workers receive functions by value, so they may refer to modules and constants, but not
            to variables that change.
        starts: for each emulator, a function like a hook, or None. It is called once at the start
            of every game, after the console's reset and before the no-ops.
        worker_timeout: seconds that a worker may take for a step, or for the start of one emulator,
            before the pool raises an error and closes, or None for no limit.

    Raises:
        RomError: the ROM is missing or the wrong one; a ValueError.
        ValueError: an argument is out of range.
        TypeError: a hook is not a function or a name, a hook cannot be sent to a worker, or a mode
            or difficulty is not an integer.
        MemoryError: the emulators do not fit into memory.
        WorkerError: a worker failed to start.
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
        hook: Hooks = None,
        starts: Sequence[Hook | None] = (),
        worker_timeout: float | None = WORKER_TIMEOUT,
    ) -> None:
        self.num_envs, num_workers = _check(
            num_envs, num_workers, screens, autoreset, worker_timeout
        )
        self.game, self.settings = game, settings or Settings()
        ale = load_emulator(game)
        # The checks of restored states compare with this state.
        self._loaded_state = ale.cloneState(include_rng=True).serialize()
        self.actions = action_set(ale, self.settings)
        modes = self._one_each("mode", game_mode, ale.getAvailableModes())
        difficulties = self._one_each("difficulty", game_difficulty, ale.getAvailableDifficulties())
        config = self._config(
            _in_order(screens),
            autoreset,
            modes,
            difficulties,
            pickled_hooks(hook, game.name),
            self._pickled_starts(starts),
        )
        size = interface.memory_size(config)
        self._workers = Workers(worker_timeout)
        self._local: EmulatorBlock | None = None  # the emulators of this process
        self._finalizer = weakref.finalize(self, self._workers.end)
        # The number of steps executed in this process, and of steps waited for.
        self._local_steps = self._awaited_steps = 0
        # All emulators have been reset, and no interrupted call has left them in between.
        self._ready = False
        self.shards = [slice(0, self.num_envs)]
        try:
            if num_workers == 0:
                self.arrays, self._commands = interface.shared_arrays(mmap.mmap(-1, size), config)
                self._local = EmulatorBlock(config, self.arrays, self._commands)
            else:
                self._start_workers(
                    config, size, min(num_workers or _available_cores(), self.num_envs)
                )
        except BaseException:
            self.close()
            raise

    def _config(
        self,
        screens: tuple[str, ...],
        autoreset: str,
        modes: tuple[int | None, ...],
        difficulties: tuple[int | None, ...],
        hooks: Pickled,
        starts: tuple[Pickled, ...],
    ) -> WorkerConfig:
        """The configuration of one worker that steps all emulators."""
        s = self.settings
        return WorkerConfig(
            num_envs=self.num_envs,
            block=(0, self.num_envs),
            screen_size=self.game.screen,
            screens=screens,
            autoreset=autoreset,
            rom=self.game.rom,
            rom_path=str(check_rom(self.game)),
            actions=tuple(int(a.value) for a in self.actions),
            frame_skip=s.skip_range,
            repeat_action_probability=s.repeat_action_probability,
            max_episode_frames=s.max_episode_frames,
            max_episode_steps=s.max_episode_steps,
            noop_max=s.noop_max,
            start_actions=self.start_actions,
            episodic_life=s.episodic_life,
            game_modes=modes,
            game_difficulties=difficulties,
            hooks=hooks,
            starts=starts,
        )

    @property
    def start_actions(self) -> tuple[int, ...]:
        """The first actions of each episode: FIRE and the next, in games that need FIRE."""
        needs_fire = self.actions[1] == ale_py.Action.FIRE and len(self.actions) > 2
        return (1, 2) if self.settings.fire_reset and needs_fire else ()

    def _one_each(self, name: str, value: Any, known: Sequence[int]) -> tuple[int | None, ...]:
        """The game mode or difficulty of each emulator."""
        values = [value] * self.num_envs if np.ndim(value) == 0 else list(value)
        for v in values:
            if v is not None and not is_integer(v):
                raise TypeError(
                    f"game_{name} must be an integer, or a sequence with one integer or None per "
                    f"environment, got {value!r}"
                )
        if len(values) != self.num_envs:
            raise ValueError(
                f"a sequence of {name} values must have one per environment, {self.num_envs}, "
                f"got {len(values)}"
            )
        for v in values:
            if v is not None and v not in known:
                raise ValueError(f"{self.game.name} has no {name} {v}; it has {list(known)}")
        return tuple(None if v is None else int(v) for v in values)

    def _pickled_starts(self, starts: Sequence[Hook | None]) -> tuple[Pickled, ...]:
        """The start of each emulator's games, as `pickled_hooks` returns hooks."""
        if starts and len(starts) != self.num_envs:
            raise ValueError(
                f"starts must have one entry per environment, {self.num_envs}, got {len(starts)}"
            )
        return tuple(pickled_hooks(s, self.game.name) for s in starts or [None] * self.num_envs)

    def _start_workers(self, config: WorkerConfig, size: int, num_workers: int) -> None:
        # Workers inherit the descriptor, so the file may be closed afterwards.
        with shared_memory(size) as (file, memory):
            self.arrays, self._commands = interface.shared_arrays(memory, config)
            num_shards = _num_shards(self.num_envs, num_workers)
            self.shards = [slice(*pair) for pair in _even_blocks(self.num_envs, num_shards)]
            self._shard_of = [i * num_shards // num_workers for i in range(num_workers)]
            for block in _even_blocks(self.num_envs, num_workers):
                self._workers.start(
                    file, dataclasses.replace(config, block=block), self._commands.finished
                )

    def reset(
        self,
        seeds: Sequence[int | None] | None = None,
        mask: np.ndarray | None = None,
        report: StartReport | None = None,
    ) -> None:
        """Start new episodes; see `EmulatorPool.reset`.

        Equal seeds give the episodes of ale-py's Gymnasium environments. A seed, or the first
        reset, makes a new emulator, which takes about 0.1 s of its worker's time.
        """
        seed = (
            [-1] * self.num_envs
            if seeds is None
            else [-1 if s is None else s for s in seed_list(seeds, self.num_envs)]
        )
        chosen = self._chosen(mask)
        self._prepare()
        commands = self._commands
        commands.seed[:], commands.chosen[:] = seed, chosen
        commands.loaded[chosen & (commands.seed >= 0)] = False
        self._ready = False
        self._execute(interface.RESET, report)
        self._ready = True

    def clone_state(self) -> States:
        """Save the state of every emulator, including its random state.

        All must have been reset.
        """
        self._prepare()
        self._require_ready()
        self._execute(interface.SAVE)
        return saved.collect(self.game.md5, self.arrays, self._commands)

    def restore_state(self, states: States, mask: np.ndarray | None = None) -> None:
        """Restore saved states; see `EmulatorPool.restore_state`.

        The same actions then give the same frames, also with sticky actions.

        Raises:
            TypeError: `states` is not of type `States`.
            ValueError: the states are damaged, belong to another game, have the wrong number, or
                lack frames that this pool records. Nothing has changed, unless the message says
                that an emulator rejected its state: then reset the emulators.
        """
        chosen = self._chosen(mask)
        saved.check(
            states, self.game, self.arrays, self._commands, self.num_envs, self._loaded_state
        )
        self._prepare()
        self._ready = False
        saved.distribute(states, self.arrays, self._commands, chosen)
        self._commands.chosen[:], self._commands.rejected[:] = chosen, False
        self._execute(interface.RESTORE)
        if self._commands.rejected.any():
            numbers = np.flatnonzero(self._commands.rejected).tolist()
            raise ValueError(
                f"the emulators of environments {numbers} rejected their states: reset all "
                "environments before the next step"
            )
        self._ready = True

    def set_ram(self, ram: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Write the changed bytes of the RAM; see `EmulatorPool.set_ram`."""
        require_uint8("ram", ram)
        if ram.shape not in ((128,), (self.num_envs, 128)):
            raise ValueError(
                f"ram must have shape [{self.num_envs}, 128] or [128], got {list(ram.shape)}"
            )
        chosen = mask_array("mask", mask, self.num_envs)
        self._prepare()
        self._require_ready()
        self._commands.new_ram[:], self._commands.chosen[:] = ram, chosen
        self._execute(interface.WRITE)

    def emulator(self, i: int) -> ale_py.ALEInterface:
        """The emulator of one environment, once it has been reset; only with `num_workers=0`.

        Raises:
            ValueError: the emulators are in worker processes.
        """
        if self._local is None:
            raise ValueError(
                "the emulators are in worker processes, or the environments are closed: make "
                "the environments with num_workers=0"
            )
        if not self._ready:
            raise ValueError(NOT_RESET)
        return self._local.emulators[i].ale

    def send(self, actions: np.ndarray, *, strengths: np.ndarray | None = None) -> None:
        """See `EmulatorPool.send`."""
        actions = action_array(actions, self.num_envs, len(self.actions))
        self._prepare()
        self._require_ready()
        self._commands.action[:], self._commands.strength[:] = (
            actions,
            FULL if strengths is None else strengths,
        )
        self._start(interface.STEP)

    def as_completed(self) -> Iterator[int]:
        """See `EmulatorPool.as_completed`."""
        self.require_open()
        if self._local:
            yield 0
        elif not self.pending:
            raise NoAsyncCallError(
                "no step is pending: call send(), or step_async() of an environment, before "
                "waiting for a step",
                "step",
            )
        else:
            missing = [len(self._workers) // len(self.shards)] * len(self.shards)
            for worker in self._completed():
                shard = self._shard_of[worker]
                missing[shard] -= 1
                if not missing[shard]:
                    yield shard
        self._awaited_steps = self.steps

    @property
    def executed_action(self) -> np.ndarray:
        """See `EmulatorPool.executed_action`."""
        return self.action_index(self.arrays.executed)

    @property
    def steps(self) -> int:
        """The number of started steps."""
        return self._local_steps + self._workers.steps

    def _chosen(self, mask: np.ndarray | None) -> np.ndarray:
        chosen = mask_array("mask", mask, self.num_envs)
        if not self._ready and not chosen.all():
            raise ValueError(
                "the first reset, and one after an interrupted call, must be of all "
                "environments, without a mask"
            )
        return chosen

    def _require_ready(self) -> None:
        if not self._ready:
            raise ValueError(NOT_RESET)

    def _prepare(self) -> None:
        """Check that the pool can take a command now; its arguments are written afterwards."""
        self.require_open()
        if self.pending and not self._local:
            raise AlreadyPendingCallError(
                "a step is pending: call wait(), or step_wait() of an environment, which returns "
                "its results",
                "step",
            )
        if self._workers.busy:  # with the command of an interrupted call
            self._finish()

    def _start(self, command: bytes) -> None:
        """Start a command in the workers, or execute it here."""
        if self._local:
            self._execute_here(self._local, command)
            return
        try:
            self._workers.command(command)
        except WorkerError:
            self.close()
            raise

    def _execute_here(self, block: EmulatorBlock, command: bytes) -> None:
        """Execute a command in this process.

        After an interrupt, the next command must be a reset.
        """
        ready, self._ready = self._ready, False
        try:
            block.execute(command)
        except Exception:
            self.close()
            raise
        self._ready, self._local_steps = ready, self._local_steps + (command == interface.STEP)

    def _execute(self, command: bytes, report: StartReport | None = None) -> None:
        self._start(command)
        self._finish(report)

    def _finish(self, report: StartReport | None = None) -> None:
        """Wait for a command; a long one reports how many emulators have loaded their ROM."""
        for _ in self._completed(report):
            pass

    def _completed(self, report: StartReport | None = None) -> Iterator[int]:
        """Wait for a command: yield the index of each worker that has executed it."""
        start = time.monotonic()

        def progress() -> int:
            loaded = int(self._commands.loaded.sum())
            if report is not None and time.monotonic() - start >= _SLOW_START:
                report(loaded)
            return loaded

        try:
            yield from self._workers.completed(progress, None if report is None else _REPORT_EVERY)
        except WorkerError:
            self.close()
            raise

    def require_open(self) -> None:
        """See `EmulatorPool.require_open`."""
        if self.closed:
            raise WorkerError("the environments are closed: create new ones")
        if self._workers.forked:
            raise WorkerError(
                "the workers belong to the process that this one was forked from: make "
                "environments in the process that uses them"
            )

    @property
    def closed(self) -> bool:
        """True if the pool has been closed."""
        return not self._finalizer.alive

    def close(self) -> None:
        """See `EmulatorPool.close`."""
        self._local = None
        self._finalizer()


def _check(
    num_envs: Any,
    num_workers: Any,
    screens: Sequence[str],
    autoreset: str,
    worker_timeout: float | None,
) -> tuple[int, int | None]:
    """Check arguments; return `num_envs` and `num_workers`."""
    num_envs = integer("num_envs", num_envs, 1, _MOST)
    check_memory(num_envs)
    if num_workers is not None:
        num_workers = integer("num_workers", num_workers, 0, _MOST)
    if autoreset not in AUTORESET_MODES:
        raise ValueError(
            f"autoreset must be one of {', '.join(map(repr, AUTORESET_MODES))}, got {autoreset!r}"
        )
    if not set(screens) <= set(SCREENS):
        raise ValueError(f"screens must be of {', '.join(map(repr, SCREENS))}, got {screens}")
    if worker_timeout is not None and not (
        isinstance(worker_timeout, int | float) and 0 < worker_timeout < math.inf
    ):
        raise ValueError(
            "worker_timeout must be a number of seconds above 0, or None for no limit, got "
            f"{worker_timeout!r}"
        )
    return num_envs, num_workers


def _in_order(screens: Sequence[str]) -> tuple[str, ...]:
    """The pixel arrays in the order of filling."""
    needed = {*screens, GRAY} if POOLED in screens else screens
    return tuple(name for name in SCREENS if name in needed)


def _available_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _even_blocks(n: int, num_blocks: int) -> Iterator[tuple[int, int]]:
    """Divide n rows into blocks of nearly equal size: first row, and one past the last."""
    return itertools.pairwise(k * n // num_blocks for k in range(num_blocks + 1))


def _num_shards(num_envs: int, num_workers: int) -> int:
    """The largest number of shards with equal numbers of workers and of environments."""
    divisors = [k for k in range(1, num_workers + 1) if num_workers % k == 0 and num_envs % k == 0]
    return max((k for k in divisors if num_envs // k >= _MIN_SHARD), default=1)
