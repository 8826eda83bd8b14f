"""A game that a person plays in a window, and its recording."""

from collections.abc import Collection
from typing import Any

import ale_py
import jax
import numpy as np
from PIL import Image

from ocjax.emulators.start import start_emulator
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.play import window
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
NAMED_KEYS = {"Up": "w", "Left": "a", "Down": "s", "Right": "d", "space": " "}  # Tk's names
FRAMES_PER_SHOWN = 2  # the console draws 60 frames a second, and the window shows 30
FRAME_SKIP = 4  # emulated frames between recorded samples
SCALE = 3  # window pixels per screen pixel
HELP = (
    "arrows or wasd  move\nspace           fire\nb               boxes on and off\np             "
    "  pause\nEscape          end"
)


def held_action(held: Collection[str]) -> ale_py.Action:
    """The action of the held keys of `MOVES`.

    ALE names its actions by their moves: UPRIGHTFIRE, LEFT, FIRE, ...
    """
    actions = ale_py.Action.__members__
    return actions.get("".join(move for key, move in MOVES.items() if key in held), actions["NOOP"])


class HumanGame:
    """A game that a person plays by holding keys. After its end, the next game begins.

    Args:
        game: the game.
        seed: the emulator's seed.
        game_mode: ale-py's number of the mode; by default the game's own.

    Raises:
        RomError, ValueError: see `ocjax.emulators.start.start_emulator`.
    """

    def __init__(self, game: Game, seed: int = 0, game_mode: int | None = None) -> None:
        self.game, self.ale = game, start_emulator(game, seed, game_mode)
        self.paused = self.done = False
        self.boxes = True
        self.held: set[str] = set()
        self._released: set[str] = set()  # since the last frame
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
        """Record a sample."""
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

    def key(self, key: str, pressed: bool) -> None:
        """Handle a key that is pressed or released."""
        key = NAMED_KEYS.get(key, key)
        if key in MOVES and pressed:
            self.held.add(key)
            self._released.discard(key)
        elif key in MOVES:
            self._released.add(key)
        elif pressed:
            self.paused ^= key == "p"
            self.boxes ^= key == "b"
            self.done |= key == "Escape"

    def step(self) -> None:
        """Emulate the frames of one picture, unless the game is paused."""
        if not self.paused:
            for _ in range(FRAMES_PER_SHOWN):
                self.frame()
        # Key repetition releases and presses a key at once. A key counts as released only if it
        # stays released.
        self.held -= self._released
        self._released.clear()

    def frame(self) -> None:
        """Emulate one frame."""
        if self.ale.game_over():
            self.ale.reset_game()
            self._begin()
        self.reward += self.ale.act(held_action(self.held))
        self.previous, self.screen = self.screen, self.ale.getScreen()
        if self.ale.game_over() or self.ale.getEpisodeFrameNumber() % FRAME_SKIP == 0:
            self._keep()

    def picture(self) -> Image.Image:
        """The screen, with REM's objects unless they are switched off."""
        objects: Objects = jax.tree.map(np.asarray, self.game.rem(self.ale.getRAM()))
        if not self.boxes:
            objects = jax.tree.map(np.zeros_like, objects)
        return overlay(self.game, self.screen, objects, scale=SCALE)

    def text(self) -> str:
        """The state of play and the keys."""
        state = "paused" if self.paused else ""
        return f"reward {self.reward}\nlives  {self.ale.lives()}\n{state}\n\n{HELP}"

    def recording(self) -> Recording:
        """The recording: a sample every 4 emulated frames, and the last one of each game."""
        arrays: dict[str, Any] = {name: np.array(values) for name, values in self._samples.items()}
        return Recording(self.game, **arrays, frame_skip=FRAME_SKIP)


def play(human: HumanGame) -> None:
    """Play in a window until it is closed or Escape is pressed.

    Raises:
        RuntimeError: see `ocjax.play.window.show`.
    """

    def step() -> tuple[Image.Image, str] | None:
        human.step()
        return None if human.done else (human.picture(), human.text())

    window.show(f"ocjax: {human.game.name}", step, human.key)
