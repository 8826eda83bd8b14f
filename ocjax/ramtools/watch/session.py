"""`ocjax ram watch`: the state of a watched game, and the effects of keys."""

from collections.abc import Collection
from typing import Any

import ale_py
import jax
import numpy as np

from ocjax.emulators.start import start_emulator
from ocjax.extraction.game import Game
from ocjax.play.human import FRAMES_PER_SHOWN, MOVES
from ocjax.play.policies import Seen, make_policy

HELP = (
    "wasd/arrows move, space fires, p pauses, n steps one frame, v toggles vision, k saves, l "
    "loads, :ADDRESS VALUE pokes, "
    "r acts at random, m by hand, q quits"
)
ARROWS = {"\x1b[A": "w", "\x1b[D": "a", "\x1b[B": "s", "\x1b[C": "d"}
ENTER, ESCAPE, BACKSPACE = ("\r", "\n"), "\x1b", ("\x7f", "\x08")
HELD = 6  # emulated frames that a key press lasts: terminals do not report releases
GLOW = 15  # emulated frames that a changed byte stays marked


def held_action(held: Collection[str]) -> ale_py.Action:
    """The action of the held keys of `MOVES`.

    ALE names its actions by their moves: UPRIGHTFIRE, LEFT, FIRE, ...
    """
    actions = ale_py.Action.__members__
    return actions.get("".join(move for key, move in MOVES.items() if key in held), actions["NOOP"])


class Session:
    """A watched emulator: its screen, objects, RAM, recently changed bytes, and a message.

    Keys are single characters, or a terminal's sequences for arrows.

    Args:
        policy: "keyboard", or the name of a policy for `make_policy`.
        seed: seed of the emulator and the policy.
        game_mode: in ale-py's numbering; None for the game's default.
    """

    def __init__(
        self, game: Game, policy: str = "keyboard", seed: int = 0, game_mode: int | None = None
    ) -> None:
        self.game, self.ale = game, start_emulator(game, seed, game_mode)
        self.actions = list(self.ale.getMinimalActionSet())
        self._random = make_policy("repeat", game, len(self.actions), 1, seed)
        self.policy = (
            None if policy == "keyboard" else make_policy(policy, game, len(self.actions), 1, seed)
        )
        self.paused = self.vision = self.done = False
        self.started = True  # the game has just begun
        self.message = HELP
        self.typed: str | None = None  # the line after ":" while it is typed
        self.saved: Any = None
        self.held: dict[str, int] = {}  # held keys and their remaining frames
        self.changed = np.zeros(128, int)  # remaining frames of each byte's mark
        self.reward = 0
        self.ram = self.ale.getRAM()
        self._observe()

    def _observe(self) -> None:
        before, self.ram, self.screen = self.ram, self.ale.getRAM(), self.ale.getScreen()
        self.changed = np.where(before != self.ram, GLOW, np.maximum(self.changed - 1, 0))
        found = self.game.vem(self.screen) if self.vision else self.game.rem(self.ram)
        self.objects = jax.tree.map(np.asarray, found)

    def action(self) -> ale_py.Action:
        """The next action, from the policy or from the held keys."""
        if self.policy is not None:
            return self.actions[int(self.policy(self._seen())[0])]
        return held_action(self.held)

    def _seen(self) -> Seen:
        """The inputs of policies. A step is one frame, without pooling."""
        gray = np.zeros((1, *self.game.screen), np.uint8)
        self.ale.getScreenGrayscale(gray[0])
        return Seen(self.ram[None], np.array([self.started]), gray)

    def step(self) -> None:
        """Emulate the frames of one displayed frame, unless paused."""
        for _ in range(FRAMES_PER_SHOWN):
            if not self.paused:
                self.frame()

    def frame(self) -> None:
        """Emulate one frame. A finished game restarts."""
        if self.ale.game_over():
            self.ale.reset_game()
            self.reward, self.started = 0, True
        self.reward += self.ale.act(self.action())
        self.started = False
        self.held = {k: n - 1 for k, n in self.held.items() if n > 1}
        self._observe()

    def poke(self, address: int, value: int) -> None:
        """Write a byte. The next frame shows its effect."""
        if not (0 <= address < 128 and 0 <= value < 256):
            self.message = f"an address is 0-127 and a value 0-255, got {address} and {value}"
            return
        self.ale.setRAM(address, value)
        self.message = f"byte {address} is {value} now"
        self._observe()

    def key(self, key: str) -> None:
        """Handle a key press."""
        key = ARROWS.get(key, key)
        if self.typed is not None:
            self._type(key)
        elif key in MOVES:
            self.held[key] = HELD
        else:
            self._command(key)

    def _command(self, key: str) -> None:
        match key:
            case ":":
                self.typed = ""
            case "p":
                self.paused = not self.paused
                self.message = "paused; n steps one frame" if self.paused else HELP
            case "n":
                self.paused = True
                self.frame()
            case "v":
                self.vision = not self.vision
                self._observe()
                self.message = "boxes from pixels (VEM)" if self.vision else "boxes from RAM (REM)"
            case "k":
                self.saved = (self.ale.cloneState(include_rng=True), self.reward)
                self.message = "state saved"
            case "l" if self.saved is None:
                self.message = "no state has been saved: k saves one"
            case "l":
                state, self.reward = self.saved
                self.ale.restoreState(state)
                self._observe()
                self.message = "state loaded; the picture follows with the next frame"
            case "r":
                self.policy, self.message = (
                    self._random,
                    "random actions; m returns to the keyboard",
                )
            case "m":
                self.policy, self.message = None, HELP
            case "q" | "\x03" | "\x1b":  # Ctrl-C and Escape
                self.done = True

    def _type(self, key: str) -> None:
        assert self.typed is not None
        if key in ENTER:
            words, self.typed = self.typed.replace("=", " ").split(), None
            try:
                address, value = (int(w, 0) for w in words)
            except ValueError:
                self.message = "to poke type :ADDRESS VALUE, for example :51 120 or :0x33 0x78"
            else:
                self.poke(address, value)
        elif key == ESCAPE:
            self.typed = None
        elif key in BACKSPACE:
            self.typed = self.typed[:-1]
        elif key.isprintable() and len(key) == 1:
            self.typed += key

    def line(self) -> str:
        """The typed line, or else the message."""
        return self.message if self.typed is None else f":{self.typed}"

    def title(self) -> str:
        """The state of play in one line."""
        method, control = (
            "VEM" if self.vision else "REM",
            "paused" if self.paused else "by hand" if self.policy is None else "policy",
        )
        play = (
            f"frame {self.ale.getEpisodeFrameNumber()}  reward {self.reward}  lives "
            f"{self.ale.lives()}"
        )
        return f"{self.game.name}  {play}  {method}  {control}"
