"""The interface of backends: a pool of emulators of one game."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import NoReturn

import ale_py
import numpy as np

from ocjax.emulators.checks import Uncopied
from ocjax.emulators.settings import Settings
from ocjax.emulators.states import States
from ocjax.emulators.worker.interface import EmulatorArrays
from ocjax.extraction.game import Game

StartReport = Callable[[int], None]  # called with the number of started emulators


class EmulatorPool(Uncopied, ABC):
    """N emulators of one game, with screens of H x W pixels.

    A step is `send`, then `wait` or `as_completed`. The arrays are updated in place, so they are
    valid until the next call.

    Attributes:
        actions: the action set; actions are indices into it.
        arrays: the state of the emulators after the last call. The properties below return single
            arrays.
        shards: consecutive blocks that together contain all emulators, and finish a step
            independently.
    """

    game: Game
    num_envs: int
    settings: Settings
    actions: tuple[ale_py.Action, ...]
    arrays: EmulatorArrays
    shards: list[slice]
    _awaited_steps: int  # the number of steps that were waited for

    @abstractmethod
    def reset(
        self,
        seeds: Sequence[int | None] | None = None,
        mask: np.ndarray | None = None,
        report: StartReport | None = None,
    ) -> None:
        """Start new episodes, and wait until they have started.

        Args:
            seeds: one per emulator, not negative. With None, the current random state continues.
            mask: bool `[N]`, the emulators to reset; by default all.
            report: during a long start, called repeatedly with the number of started emulators.

        Raises:
            ValueError: a seed, the number of seeds or the mask is wrong, the first reset has a
                mask, or the backend does not support the arguments.
            AlreadyPendingCallError: a step is pending.
            WorkerError: the environments are closed, or a worker failed, died or did not reply in
                time. The methods below also raise it.
        """

    @abstractmethod
    def send(self, actions: np.ndarray, *, strengths: np.ndarray | None = None) -> None:
        """Start a step without waiting for it.

        Args:
            actions: integers `[N]`, indices into `self.actions`. An emulator whose episode has
                ended ignores its action and starts the next one.
            strengths: float32 `[N]`, the speeds of paddles as fractions of full speed; by default
                1.

        Raises:
            ValueError: the actions have the wrong shape or dtype, an action does not exist, or the
                emulators have not been reset.
            AlreadyPendingCallError: a step is pending.
        """

    @abstractmethod
    def as_completed(self) -> Iterator[int]:
        """Wait for the step: yield the index of each shard as soon as its emulators have finished.

        The step is pending until the iterator is exhausted. After an interrupt, make a new
        iterator.

        Raises:
            NoAsyncCallError: no step is pending.
        """

    def wait(self) -> None:
        """Wait for the step of all emulators. An interrupted call can be repeated.

        Raises:
            NoAsyncCallError: no step is pending.
        """
        for _ in self.as_completed():
            pass

    def step(self, actions: np.ndarray) -> None:
        """Step all emulators: `send`, then `wait`."""
        self.send(actions)
        self.wait()

    @property
    @abstractmethod
    def steps(self) -> int:
        """The number of started steps."""

    @property
    def pending(self) -> bool:
        """True if a step has started but not been waited for."""
        return self.steps != self._awaited_steps

    @abstractmethod
    def require_open(self) -> None:
        """Check that the pool can be used in this process.

        Raises:
            WorkerError: the pool is closed, or belongs to another process.
        """

    @abstractmethod
    def close(self) -> None:
        """Release the emulators. Further calls have no effect."""

    def clone_state(self) -> States:
        """Save the state of every emulator.

        Raises:
            ValueError: the backend cannot save states.
        """
        self._refuse("states")

    def restore_state(self, states: States, mask: np.ndarray | None = None) -> None:
        """Restore saved states, and the arrays at the time of saving.

        Args:
            states: one per emulator, or a single one for all.
            mask: bool `[N]`, the emulators to restore; by default all.

        Raises:
            ValueError: the states do not fit this pool, or the backend cannot restore states.
        """
        self._refuse("states")

    def set_ram(self, ram: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Write the RAM of emulators. `self.ram` changes at once; frames change with the next step.

        Args:
            ram: uint8 `[N, 128]`, or `[128]` for all emulators.
            mask: bool `[N]`, the emulators to write to; by default all.

        Raises:
            TypeError: `ram` is not a uint8 array.
            ValueError: `ram` has the wrong shape, or the backend cannot write RAM.
        """
        self._refuse("RAM")

    def emulator(self, i: int) -> ale_py.ALEInterface:
        """The emulator of one environment.

        Raises:
            ValueError: the emulator is not in this process.
        """
        self._refuse("emulators")

    def _refuse(self, what: str) -> NoReturn:
        raise ValueError(f"envpool gives no access to {what}: use backend='ale'")

    @property
    def ram(self) -> np.ndarray:
        """The consoles' RAM, uint8 `[N, 128]`."""
        return self.arrays.ram

    @property
    def reward(self) -> np.ndarray:
        """Unclipped rewards of the step, float64 `[N]`."""
        return self.arrays.reward

    @property
    def terminated(self) -> np.ndarray:
        """True if the step ended the episode, bool `[N]`."""
        return self.arrays.terminated

    @property
    def truncated(self) -> np.ndarray:
        """True if the step reached a limit of frames or steps, bool `[N]`."""
        return self.arrays.truncated

    @property
    def game_over(self) -> np.ndarray:
        """True if the game ended or reached a limit in the step, bool `[N]`.

        The next episode is then a new game. With same-step autoreset, use the array in
        `arrays.final`.
        """
        return self.arrays.game_over

    @property
    def started(self) -> np.ndarray:
        """True if an episode began in the step, bool `[N]`."""
        return self.arrays.started

    @property
    def lives(self) -> np.ndarray:
        """Lives left, int32 `[N]`."""
        return self.arrays.lives

    @property
    def frame_number(self) -> np.ndarray:
        """Emulated frames since the game began, int64 `[N]`."""
        return self.arrays.frame_number

    @property
    def episode_return(self) -> np.ndarray:
        """Unclipped return since the game began, float64 `[N]`."""
        return self.arrays.episode_return

    @property
    def episode_length(self) -> np.ndarray:
        """Agent steps since the game began, int64 `[N]`."""
        return self.arrays.episode_length

    @property
    def executed_action(self) -> np.ndarray | None:
        """The action of the last emulated frame, int32 `[N]`, or None if it is unknown.

        It is an index into `actions`, or -1 if a restored state executed another action.
        """
        return None

    def action_index(self, numbers: np.ndarray) -> np.ndarray:
        """Indices into `actions` of ale-py's action numbers, int32; -1 for other actions."""
        index_of = np.full(len(ale_py.Action.__members__), -1, np.int32)
        index_of[[int(a.value) for a in self.actions]] = np.arange(len(self.actions))
        return index_of[numbers]

    @property
    def screen(self) -> np.ndarray:
        """Palette indices of the last two emulated frames, the latest last, uint8 `[N, 2, H, 160]`.

        Raises:
            ValueError: the pool does not record it. The properties below also raise it.
        """
        return self._recorded("screen")

    @property
    def gray(self) -> np.ndarray:
        """The last emulated frame in shades of grey, uint8 `[N, 1, H, 160]`."""
        return self._recorded("gray")

    @property
    def pooled(self) -> np.ndarray:
        """The pixelwise maximum of the step's last two grey frames, uint8 `[N, 1, H, 160]`.

        With a frame skip of 1 it is the single emulated frame.
        """
        return self._recorded("pooled")

    @property
    def rgb(self) -> np.ndarray:
        """The last emulated frame in RGB, uint8 `[N, 1, H, 160, 3]`."""
        return self._recorded("rgb")

    def _recorded(self, name: str) -> np.ndarray:
        array = getattr(self.arrays, name)
        if array is None:
            raise ValueError(
                f"the pool does not record {name!r}: request it with screens=({name!r},)"
            )
        return array
