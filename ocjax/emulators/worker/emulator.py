"""One environment: an emulator, the phases of its episodes, and its rows of the shared arrays."""

import enum
import math
from collections.abc import Callable, Sequence
from typing import Any

import ale_py
import numpy as np

from . import console, snapshot
from .interface import (
    GRAY,
    OBSERVED,
    POOLED,
    SAME_STEP,
    SCREENS,
    CommandArrays,
    EmulatorArrays,
    WorkerConfig,
)
from .snapshot import EmulatorState
from .sticky import ExecutedAction

# ROMs where ALE's reset presses a button. The number of frames is ALE's frame skip.
PRESSING = ("berzerk", "double_dunk")
NOOP = 0  # index in every action set
FULL = 1.0  # strength of an action that is not continuous

Hook = Callable[[np.ndarray], None]


class Phase(enum.IntEnum):
    """The phases of an environment. The "shown" episode is in the shared arrays."""

    UNLOADED = 0  # no ROM has been loaded
    LOADED = 1  # no episode has been shown since the ROM was loaded
    RUNNING = 2  # the shown episode continues
    LIFE_LOST = 3  # the shown episode ended with a life, and its game continues
    GAME_OVER = 4  # the shown episode ended with its game, or was truncated
    NEXT_READY = 5  # like GAME_OVER, but the emulator has begun the next game, which is not shown


def apply_hooks(
    ale: ale_py.ALEInterface,
    hooks: Sequence[tuple[str, Any]],
    before: np.ndarray | None = None,
    seed: int = 0,
    place: str = "",
) -> np.ndarray:
    """Let hooks edit a copy of the console's RAM, and write the changes to the console.

    A hook with the attribute `takes_moment` also gets the fields of a `Moment`.

    Returns:
        The edited RAM.
    """
    ram, frame, game_frame = ale.getRAM(), ale.getFrameNumber(), ale.getEpisodeFrameNumber()
    edited = ram.copy()
    moment = (ram if before is None or not game_frame else before, seed, frame, game_frame)
    for name, hook in hooks:
        try:
            hook(edited, moment) if getattr(hook, "takes_moment", False) else hook(edited)
        except Exception as error:
            raise RuntimeError(
                f"the hook {name} failed{place}: {type(error).__name__}: {error}"
            ) from error
    for address in np.flatnonzero(edited != ram).tolist():
        ale.setRAM(address, int(edited[address]))
    return edited


class Emulator:
    """One environment.

    Args:
        i: its row in the arrays.
        shown: arrays for the results.
        commands: arguments of the commands.
        hooks: names and functions, called before every emulated frame.
        starts: names and functions, called at the start of every game.
    """

    def __init__(
        self,
        i: int,
        config: WorkerConfig,
        shown: EmulatorArrays,
        commands: CommandArrays,
        hooks: Sequence[tuple[str, Hook]],
        starts: Sequence[tuple[str, Hook]],
    ) -> None:
        self.i, self.config = i, config
        self.shown, self.commands = shown, commands
        self.hooks, self.starts = hooks, starts
        self.phase = Phase.UNLOADED
        self.ram = shown.ram[i]
        self.screens: dict[str, np.ndarray] = {
            name: getattr(shown, name)[i] for name in config.screens
        }
        self.previous = {
            name: frames[-2] for name, frames in self.screens.items() if SCREENS[name] > 1
        }
        if POOLED in self.screens:
            self.previous[GRAY] = np.zeros(config.screen_size, np.uint8)
        self.actions = [ale_py.Action(a) for a in config.actions]
        self.max_steps = config.max_episode_steps or math.inf  # of an episode
        self.least_skip, self.most_skip = config.frame_skip[0], config.frame_skip[1] - 1
        # One call of `act` emulates all frames of a step, unless single frames are needed.
        single = hooks or self.previous or config.noop_max or config.rom in PRESSING
        self.whole_steps = self.least_skip == self.most_skip and not single
        self.frames_per_act = self.least_skip if self.whole_steps else 1  # frames of ALE's `act`
        self.executed = ExecutedAction(config.repeat_action_probability)
        self.start_totals = (0.0, 0)  # return and length at the start of the next episode
        self.before: np.ndarray | None = None  # the edited RAM before the last frame
        self.shown_state: EmulatorState | None = None  # NEXT_READY: of the shown game

    def load(self, seed: int) -> None:
        """Make a new emulator; a negative seed selects a random seed."""
        c = self.config
        ale = ale_py.ALEInterface()
        ale.setFloat("repeat_action_probability", c.repeat_action_probability)
        ale.setInt("max_num_frames_per_episode", c.max_episode_frames)
        ale.setInt("frame_skip", self.frames_per_act)
        # Derive seeds as ale-py's Gymnasium environment does: equal seeds give equal episodes.
        rng_seed, ale_seed = np.random.SeedSequence(None if seed < 0 else seed).generate_state(2)
        self.rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(rng_seed))))
        ale.setInt("random_seed", int(ale_seed.astype(np.int32)))
        ale.loadROM(c.rom_path)
        mode, difficulty = c.game_modes[self.i], c.game_difficulties[self.i]
        if mode is not None:
            ale.setMode(mode)
        if difficulty is not None:
            ale.setDifficulty(difficulty)
        self.ale = ale
        self.executed.synchronize(console.facts(self.console_state()).random)
        self.commands.loaded[self.i] = True
        self.phase = Phase.LOADED

    @property
    def seed(self) -> int:
        """A number in saved states that identifies the seed.

        The increment of the generator's state.
        """
        return self.rng.bit_generator.state["state"]["inc"]

    def play(self, action: int, strength: float = FULL, *, visible: bool = True) -> float:
        """Hold an action for one step; keep screens if `visible`."""
        if self.whole_steps:
            return self.act(action, strength)
        frames = self.draw_skip()
        if not (self.hooks or self.previous):
            return self.hold_for(action, strength, frames)
        reward = 0.0
        for k in range(frames):
            if visible and k == frames - 1:
                self.keep_previous(shown=k == 0)
                if frames == 1 and POOLED in self.screens:
                    self.previous[GRAY][:] = 0  # do not pool across steps
            reward += self.frame(action, strength)
        return reward

    def act(self, action: int, strength: float) -> float:
        """Send an action to the emulator for `frames_per_act` frames."""
        self.executed.send(self.config.actions[action], strength, self.frames_per_act)
        return self.ale.act(self.actions[action], strength)

    def hold_for(self, action: int, strength: float, frames: int) -> float:
        """Send an action to the emulator for each of several frames, and return their reward."""
        self.executed.send(self.config.actions[action], strength, frames)
        act, sent, reward = self.ale.act, self.actions[action], 0.0
        for _ in range(frames):
            reward += act(sent, strength)
        return reward

    def draw_skip(self) -> int:
        """The number of emulated frames of the next step; random if `frame_skip` is a range."""
        low, high = self.least_skip, self.most_skip
        return low if low == high else int(self.rng.integers(low, high + 1))

    def frame(self, action: int, strength: float = FULL) -> float:
        """Let the hooks edit the RAM, emulate one frame, and return its reward."""
        if self.hooks:
            self.before = apply_hooks(
                self.ale, self.hooks, self.before, self.seed, f" in environment {self.i}"
            )
        return self.act(action, strength)

    def copy_frame(self, name: str, out: np.ndarray) -> None:
        """Copy the latest emulated frame in the format of a pixel array."""
        if name == "screen":
            self.ale.getScreen(out)
        elif name == GRAY:
            self.ale.getScreenGrayscale(out)
        else:
            self.ale.getScreenRGB(out)

    def keep_previous(self, *, shown: bool) -> None:
        """Keep the latest frame before the next one; the arrays hold it if `shown`."""
        for name, out in self.previous.items():
            if shown:
                out[:] = self.screens[name][-1]
            else:
                self.copy_frame(name, out)

    def show_screens(self) -> None:
        """Write the latest frame to the pixel arrays."""
        for name, frames in self.screens.items():
            if name == POOLED:
                np.maximum(self.screens[GRAY][-1], self.previous[GRAY], out=frames[-1])
            else:
                self.copy_frame(name, frames[-1])

    def reset(self) -> None:
        """Show the start of the next episode, which continues the game after the loss of a life."""
        if self.phase is not Phase.NEXT_READY:
            self.begin_episode()
        self.phase = Phase.RUNNING
        self.shown_state = None
        shown, ale, i = self.shown, self.ale, self.i
        shown.reward[i] = 0
        shown.terminated[i] = shown.truncated[i] = shown.game_over[i] = False
        shown.started[i] = True
        shown.episode_return[i], shown.episode_length[i] = self.start_totals
        shown.lives[i], shown.frame_number[i] = ale.lives(), ale.getEpisodeFrameNumber()
        shown.executed[i] = self.executed.action
        ale.getRAM(self.ram)
        self.keep_previous(shown=False)
        self.show_screens()

    def prepare_next(self) -> None:
        """Begin the next game while the arrays still show the end of this one."""
        self.shown_state = self.state()
        self.begin_episode()
        self.phase = Phase.NEXT_READY

    def begin_episode(self) -> None:
        """Emulate the start of the next episode without showing it."""
        self.start_totals = self.shown.episode_return[self.i], self.shown.episode_length[self.i]
        new_game = self.phase is not Phase.LIFE_LOST
        if not new_game:
            self.add_reward(self.play(NOOP, visible=False))
        if new_game or self.ale.game_over():
            self.new_game()
        for action in self.config.start_actions:
            self.add_reward(self.play(action, visible=False))
            self.restart_if_over()

    def new_game(self) -> None:
        """Begin a game with random no-ops, which do not count as steps."""
        noop_max = self.config.noop_max
        self.reset_console()
        for _ in range(int(self.rng.integers(1, noop_max + 1)) if noop_max else 0):
            self.add_reward(self.frame(NOOP))
            self.restart_if_over()

    def add_reward(self, reward: float) -> None:
        """Add a reward that occurs before the episode's first step."""
        total, length = self.start_totals
        self.start_totals = total + reward, length

    def restart_if_over(self) -> None:
        """Begin a new game if this one has ended before the episode's first step."""
        if self.ale.game_over():
            self.reset_console()

    def reset_console(self) -> None:
        """Reset the console, and write the RAM of the game's start."""
        self.start_totals = (0.0, 0)
        self.reset_game()
        if self.starts:
            place = f" at the beginning of a game in environment {self.i}"
            apply_hooks(self.ale, self.starts, None, self.seed, place)

    def reset_game(self) -> None:
        """Reset the console, which releases all buttons.

        In the games of `PRESSING` it draws random numbers.
        """
        self.ale.reset_game()
        self.executed.release()
        self.executed.synchronize(console.facts(self.console_state()).random)

    def end(self, *, game_over: bool) -> None:
        """End the episode with the last step; without `game_over`, it ended with a life."""
        shown, i = self.shown, self.i
        self.phase = Phase.GAME_OVER if game_over else Phase.LIFE_LOST
        shown.game_over[i] = game_over or self.next_episode_begins_game()
        if game_over:
            shown.terminated[i] |= self.ale.game_over(with_truncation=False)
            shown.truncated[i] = self.ale.game_truncated() or self.is_at_step_limit()
        if self.config.autoreset == SAME_STEP:
            self.record_final()
            result = shown.reward[i], shown.terminated[i], shown.truncated[i]
            self.reset()
            shown.reward[i], shown.terminated[i], shown.truncated[i] = result

    def is_at_step_limit(self) -> bool:
        """True if the shown episode has as many steps as the settings allow."""
        return self.shown.episode_length[self.i] >= self.max_steps

    def next_episode_begins_game(self) -> bool:
        """True if the start of the next episode, after a lost life, reaches the frame limit."""
        state = self.rng.bit_generator.state
        frames = sum(self.draw_skip() for _ in range(1 + len(self.config.start_actions)))
        self.rng.bit_generator.state = state
        return self.ale.getEpisodeFrameNumber() + frames >= self.config.max_episode_frames

    def record_final(self) -> None:
        """Copy the shown arrays at the end of an episode."""
        for name in OBSERVED:
            final = getattr(self.shown.final, name)
            if final is not None:
                final[self.i] = getattr(self.shown, name)[self.i]

    def state(self) -> EmulatorState:
        """The shown state, with all values that determine the next steps."""
        return self.shown_state or EmulatorState(
            self.phase.value,
            self.executed.strength,
            self.rng.bit_generator.state,
            self.before,
            self.console_state(),
        )

    def console_state(self) -> bytes:
        """ALE's state."""
        return self.ale.cloneState(include_rng=True).serialize()

    def save(self) -> None:
        """Write the state to the shared memory."""
        snapshot.write(self.state(), self.commands, self.i)

    def restore(self) -> None:
        """Continue from the state and the RAM in the shared memory.

        The pool restores the other arrays.
        """
        saved = snapshot.read(self.commands, self.i)
        try:
            self.restore_console(saved)
        except Exception:  # ALE raises errors of many types
            self.phase, self.commands.rejected[self.i] = Phase.UNLOADED, True
            return
        self.rng.bit_generator.state = saved.generator
        self.before = saved.before
        self.phase, self.shown_state = Phase(saved.phase), None
        self.write_ram(self.ram)

    def restore_console(self, saved: EmulatorState) -> None:
        """Restore a saved state.

        Frames before ALE's state is loaded set what it lacks: the action that a sticky frame
        repeats, whether the last frame is complete, and pixels that the next frame does not draw.
        """
        ale, facts = ale_py.ALEState(saved.ale), console.facts(saved.ale)
        action = int(self.shown.executed[self.i])
        if facts.frames:
            self.hold(action, saved.strength)
            # Written RAM may have jammed the processor.
            if not console.facts(self.console_state()).complete:
                self.reset_game()
                self.hold(action, saved.strength)
        else:  # a reset gives the same pixels, and in some games an incomplete frame
            self.ale.restoreState(ale)  # for the game mode
            self.reset_game()
        prepared = (
            console.facts(self.console_state()).complete == facts.complete
            and self.executed.action == action
        )
        self.ale.restoreState(ale)
        self.executed.synchronize(facts.random)
        if not prepared or not console.equal(self.console_state(), saved.ale):
            raise ValueError("the emulator did not take over the state")

    def hold(self, action: int, strength: float) -> None:
        """Send an action until a frame executes it."""
        while True:
            self.ale.act(ale_py.Action(action), strength)
            if self.executed.send(action, strength, self.frames_per_act):
                break

    def write_ram(self, new: np.ndarray) -> None:
        """Write RAM, uint8 `[128]`.

        After the end of a game, which has no further step, only the shown RAM.
        """
        if self.phase not in (Phase.GAME_OVER, Phase.NEXT_READY):
            for address in np.flatnonzero(new != self.ale.getRAM()).tolist():
                self.ale.setRAM(address, int(new[address]))
        self.ram[:] = new
