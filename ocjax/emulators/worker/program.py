"""The loop of a worker process, and the block of environments that it steps."""

import contextlib
import mmap
import os
import pickle
import select
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable
from typing import IO, Any

import ale_py
import numpy as np

from . import interface
from .emulator import Emulator, Hook, Phase
from .interface import CommandArrays, EmulatorArrays, WorkerConfig

_STDERR = 2
# Maximal bytes of stderr, and the number of the last bytes that are kept beyond that.
_MOST_STDERR, _KEPT_STDERR = (65_536, 4_000)
_PARENT_CHECK = 1.0  # seconds between two checks that the parent still runs


class EmulatorBlock:
    """The environments of one worker: rows `config.block` of the arrays."""

    def __init__(
        self, config: WorkerConfig, shown: EmulatorArrays, commands: CommandArrays
    ) -> None:
        self.shown, self.commands = shown, commands
        self.autoreset, self.episodic_life = config.autoreset, config.episodic_life
        hooks = _load_hooks(config.hooks)
        self.rows = slice(*config.block)
        self.emulators = [
            Emulator(i, config, shown, commands, hooks, _load_hooks(config.starts[i]))
            for i in range(*config.block)
        ]
        self._methods = {
            interface.RESET: self.reset,
            interface.STEP: self.step,
            interface.SAVE: self.save,
            interface.RESTORE: self.restore,
            interface.WRITE: self.write_ram,
        }

    def execute(self, command: bytes) -> None:
        """Execute a command."""
        self._methods[command]()

    def chosen(self) -> list[Emulator]:
        """The environments that the command applies to."""
        return [e for e in self.emulators if self.commands.chosen[e.i]]

    def reset(self) -> None:
        """Start the next episodes of the chosen environments. A seed makes a new emulator."""
        for e in self.chosen():
            seed = int(self.commands.seed[e.i])
            if seed >= 0 or e.phase is Phase.UNLOADED:
                e.load(seed)
            e.reset()

    def step(self) -> None:
        """Step all environments.

        An environment with an ended episode starts the next one instead, unless autoreset is
        disabled.
        """
        ended = [e.phase is not Phase.RUNNING for e in self.emulators]
        if self.autoreset == interface.DISABLED and any(ended):
            numbers = [e.i for e, over in zip(self.emulators, ended, strict=True) if over]
            raise RuntimeError(
                f"the episodes of environments {numbers} have ended: reset these environments "
                "before the next step"
            )
        # Emulate all environments before reading any results: each emulation evicts all other data
        # from the processor's caches.
        sent = zip(
            self.commands.action[self.rows].tolist(),
            self.commands.strength[self.rows].tolist(),
            strict=True,
        )
        rewards = [
            0.0 if over else e.play(*action)
            for e, action, over in zip(self.emulators, sent, ended, strict=True)
        ]
        game_over, life_over = self.show(rewards, np.array(ended))
        for k in np.flatnonzero(game_over | life_over | ended).tolist():
            self.emulators[k].reset() if ended[k] else self.emulators[k].end(
                game_over=bool(game_over[k])
            )

    def show(self, rewards: list[float], ended: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Write a step's results to the arrays.

        Args:
            ended: bool, episodes that ended before the step, which they ignore.

        Returns:
            Two bool arrays: the games that ended, and the episodes that ended with a life.
        """
        shown, rows = self.shown, self.rows
        ales = [e.ale for e in self.emulators]
        game_over = np.array([ale.game_over() for ale in ales])
        lives = np.array([ale.lives() for ale in ales])
        life_over = (lives > 0) & (lives < shown.lives[rows]) & self.episodic_life
        shown.reward[rows] = rewards
        shown.terminated[rows] = life_over
        shown.truncated[rows] = shown.started[rows] = shown.game_over[rows] = False
        shown.lives[rows] = lives
        shown.executed[rows] = [e.executed.action for e in self.emulators]
        shown.frame_number[rows] = [ale.getEpisodeFrameNumber() for ale in ales]
        shown.episode_return[rows] += rewards
        shown.episode_length[rows] += ~ended
        game_over |= np.array([e.is_at_step_limit() for e in self.emulators])
        for e, ale in zip(self.emulators, ales, strict=True):
            ale.getRAM(e.ram)
            e.show_screens()
        return game_over, life_over

    def prepare_next_games(self, interrupted: Callable[[], bool]) -> None:
        """Begin the next games of environments with an ended game, until interrupted.

        A new game costs as much as 16 steps; the pool does not wait meanwhile.
        """
        for e in self.emulators:
            if e.phase is Phase.GAME_OVER:
                if interrupted():
                    return
                e.prepare_next()

    def save(self) -> None:
        """Save the states of all environments."""
        for e in self.emulators:
            e.save()

    def restore(self) -> None:
        """Restore the states of the chosen environments."""
        for e in self.chosen():
            if e.phase is Phase.UNLOADED:
                e.load(-1)
            e.restore()

    def write_ram(self) -> None:
        """Write the RAM of the chosen environments."""
        for e in self.chosen():
            e.write_ram(self.commands.new_ram[e.i])


def _load_hooks(hooks: Iterable[tuple[str, str]]) -> list[tuple[str, Hook]]:
    loaded = []
    for name, pickled in hooks:
        try:
            loaded.append((name, pickle.loads(bytes.fromhex(pickled))))
        except Exception as error:
            raise RuntimeError(
                f"the hook {name} cannot be loaded in a worker process: {type(error).__name__}: "
                f"{error}"
            ) from error
    return loaded


def main(socket_fd: int, memory_fd: int, parent: int) -> None:
    """Run the worker until its socket closes or the process `parent` has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    if hasattr(os, "SCHED_BATCH"):
        # With this policy, a woken worker does not preempt the parent before the parent has woken
        # the other workers. A sandbox may forbid it, which costs a few percent of speed.
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    link = socket.socket(fileno=socket_fd)
    with link.makefile("rb") as incoming:
        config = WorkerConfig.from_json(incoming.readline())
        memory = mmap.mmap(memory_fd, interface.memory_size(config))
        shown, commands = interface.shared_arrays(memory, config)
        _serve(
            EmulatorBlock(config, shown, commands),
            link,
            incoming,
            commands.finished[config.block[0] :],
        )


def _serve(
    block: EmulatorBlock, link: socket.socket, incoming: IO[bytes], finished: np.ndarray
) -> None:
    """Execute commands until the socket closes. After a failure, all further commands fail."""
    last, healthy = 0, True

    def interrupted() -> bool:
        return bool(select.select([link], [], [], 0)[0])

    while len(message := incoming.read(interface.MESSAGE.size)) == interface.MESSAGE.size:
        command, number = interface.MESSAGE.unpack(message)
        if number != last:
            healthy = healthy and _attempt(block.execute, command)
            limit_stderr()
            last, finished[0] = number, number if healthy else -number
        link.sendall(interface.REPLY)
        healthy = healthy and _attempt(block.prepare_next_games, interrupted)


def limit_stderr() -> None:
    """Truncate a long stderr to its end: it is a file, which messages of hooks would fill."""
    size = os.fstat(_STDERR).st_size
    if size <= _MOST_STDERR:
        return
    sys.stderr.flush()
    end = os.pread(_STDERR, _KEPT_STDERR, max(0, size - _KEPT_STDERR))
    os.ftruncate(_STDERR, 0)
    os.lseek(_STDERR, 0, os.SEEK_SET)
    os.write(_STDERR, end)


def _attempt(action: Callable[..., None], *args: Any) -> bool:
    """Run an action; return False, and print the error to stderr, if it fails."""
    try:
        action(*args)
    except Exception:
        traceback.print_exc()
        return False
    return True


def _end_with(parent: int) -> None:
    """End this process when the parent has ended.

    A hanging hook or a forked child can keep the socket open, and a signal on the parent's death
    would come at the end of the thread that made the pool.
    """
    while os.getppid() == parent:
        time.sleep(_PARENT_CHECK)
    os._exit(1)
