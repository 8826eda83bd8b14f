"""A game that a person plays in a window, and its recording."""

import os
import warnings
from itertools import product
from typing import Any

import ale_py
import gymnasium as gym
import jax
import numpy as np

from ocjax._extras import require
from ocjax.emulators.start import start_emulator
from ocjax.extraction.game import Game
from ocjax.recordings import Recording
from ocjax.transforms.drawing import overlay

# In the order of ALE's action names.
MOVES = {
    "w": "UP",
    "s": "DOWN",
    "d": "RIGHT",
    "a": "LEFT",
    " ": "FIRE",
}
RATE = 30  # pictures shown per second
FRAMES_PER_SHOWN = 2  # the console draws 60 frames a second
FRAME_SKIP = 4  # emulated frames between recorded samples
SCALE = 3  # window pixels per screen pixel


class HumanGame(gym.Env):
    """A game for `gymnasium.utils.play`, with REM's objects drawn over the screen.

    A step emulates two frames. Actions are ale-py's numbers, and observations the RAM.
    """

    # Gymnasium declares it without ClassVar.
    metadata = {"render_modes": ["rgb_array"], "render_fps": RATE}  # noqa: RUF012
    render_mode = "rgb_array"

    def __init__(self, game: Game, seed: int = 0, *, with_terrain: bool = False) -> None:
        self.game, self.ale = game, start_emulator(game, seed)
        self.with_terrain = with_terrain
        self.action_space = gym.spaces.Discrete(len(ale_py.Action.__members__))
        self.observation_space = gym.spaces.Box(0, 255, self.ale.getRAM().shape, np.uint8)
        self._samples: dict[str, list[Any]] = {
            name: []
            for name in ("rams", "screens", "previous", "rewards", "lives", "resets", "ends")
        }
        self._begin()

    def _begin(self) -> None:
        self.reward = 0
        self.screen = self.previous = self.ale.getScreen()
        self._keep(first=True)

    def _keep(self, first: bool = False) -> None:
        sample = {
            "rams": self.ale.getRAM(),
            "screens": self.screen,
            "previous": self.previous,
            "rewards": self.reward,
            "lives": self.ale.lives(),
            "resets": first,
            "ends": self.ale.game_over(),
        }
        for name, value in sample.items():
            self._samples[name].append(value)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start the next game if the last one has ended; the arguments have no effect."""
        if self.ale.game_over():
            self.ale.reset_game()
            self._begin()
        return self.ale.getRAM(), {}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Emulate the frames of one picture, or fewer if the game ends."""
        before = self.reward
        for _ in range(FRAMES_PER_SHOWN):
            if not self.ale.game_over():
                self._frame(action)
        return self.ale.getRAM(), float(self.reward - before), self.ale.game_over(), False, {}

    def _frame(self, action: int) -> None:
        self.reward += self.ale.act(action)
        self.previous, self.screen = self.screen, self.ale.getScreen()
        if self.ale.game_over() or self.ale.getEpisodeFrameNumber() % FRAME_SKIP == 0:
            self._keep()

    def render(self) -> np.ndarray:
        """The screen with REM's objects, uint8 `[H * 3, 160 * 6, 3]`."""
        ram = self.ale.getRAM()
        objects = jax.tree.map(np.asarray, self.game.rem(ram))
        terrain = self.game.terrain_of(ram) if self.with_terrain else None
        return np.asarray(overlay(self.game, self.screen, objects, scale=SCALE, terrain=terrain))

    def recording(self) -> Recording:
        """The recording: a sample every 4 emulated frames, and the last one of each game."""
        arrays: dict[str, Any] = {name: np.array(values) for name, values in self._samples.items()}
        return Recording(self.game, **arrays, frame_skip=FRAME_SKIP)


def play(human: HumanGame) -> None:
    """Play in a window until it is closed or Escape is pressed."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about Matplotlib, which Gymnasium needs only for plots
        keys = keys_to_action(require("pygame"))
        play_in_window = require("gymnasium.utils.play").play
    play_in_window(human, keys_to_action=keys)


def keys_to_action(pygame: Any) -> dict[tuple[str | int, ...], int]:
    """ale-py's number of the action of each combination of wasd, arrows and space."""
    keys = {move: (key, getattr(pygame, f"K_{move}", key)) for key, move in MOVES.items()}
    actions = {}
    for name, action in ale_py.Action.__members__.items():
        if action != ale_py.Action.NOOP:
            pressed = product(*(keys[move] for move in keys if move in name))
            actions |= dict.fromkeys(pressed, action.value)
    return actions
