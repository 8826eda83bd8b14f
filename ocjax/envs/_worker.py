"""The program of one worker process: steps its share of the emulators, results into shared memory.

Run as a file with two inherited file descriptors, a socket and the shared memory. It must not import ocjax: a worker needs neither
JAX nor its start-up time. One byte over the socket asks for something, one byte answers; an error is answered by its text.
It ends when the socket closes, so it cannot outlive the process that started it.
"""

import contextlib
import json
import mmap
import os
import pickle
import select
import signal
import socket
import sys
import traceback
from collections.abc import Callable
from typing import Any

import ale_py
import numpy as np

RESET, STEP, SAVE, RESTORE, WRITE, QUIT, OK, ERROR = b"R", b"S", b"C", b"L", b"W", b"Q", b"K", b"E"
NEXT_STEP, SAME_STEP, DISABLED = "next step", "same step", "disabled"  # what happens to an environment whose episode ended
STATE_BYTES = 2**15  # room for a saved emulator, which takes 14,500
# Repeats until an action is held for certain where sticky actions are on: as many as make another one likelier than this impossible.
CERTAIN = 1e-9

# What an observation may need of the screen: name -> (frames kept, trailing shape).
SCREENS: dict[str, tuple[int, tuple[int, ...]]] = {"screen": (2, ()), "gray": (2, ()), "rgb": (1, (3,))}
# What the end of an episode keeps where another begins in the same step.
KEPT = ("ram", *SCREENS, "lives", "frame_number", "episode_return", "episode_length")


def layout(config: dict[str, Any]) -> tuple[dict[str, tuple[str, tuple[int, ...], int]], int]:
    """Name -> (dtype, shape, offset) of the arrays in the shared memory, and its size in bytes."""
    n = config["num_envs"]
    arrays: dict[str, tuple[str, tuple[int, ...]]] = {
        "ram": ("uint8", (n, 128)),
        "action": ("int32", (n,)),  # index into the action set
        "seed": ("int64", (n,)),  # -1: none
        "chosen": ("bool", (n,)),  # which RESET, RESTORE and WRITE are for
        "loaded": ("bool", (n,)),
        "written": ("uint8", (n, 128)),  # the RAM wanted on WRITE
        "reward": ("float64", (n,)),
        "terminated": ("bool", (n,)),
        "truncated": ("bool", (n,)),
        "started": ("bool", (n,)),  # an episode began in this step
        "lives": ("int32", (n,)),
        "frame_number": ("int64", (n,)),  # emulated frames of the game
        "episode_return": ("float64", (n,)),  # of the game
        "episode_length": ("int64", (n,)),  # agent steps of the game
        "state": ("uint8", (n, STATE_BYTES)),  # only touched where states are saved
        "state_bytes": ("int64", (n,)),
    }
    for name in config["screens"]:
        frames, tail = SCREENS[name]
        arrays[name] = ("uint8", (n, frames, *config["size"], *tail))  # the latest frame last
    if config["autoreset"] == SAME_STEP:
        arrays |= {f"final_{name}": arrays[name] for name in KEPT if name in arrays}
    out, offset = {}, 0
    for name, (dtype, shape) in arrays.items():
        out[name] = (dtype, shape, offset)
        offset += -(-int(np.prod(shape)) * np.dtype(dtype).itemsize // 64) * 64
    return out, offset


def view(memory: Any, config: dict[str, Any]) -> dict[str, np.ndarray]:
    """The arrays in the shared memory."""
    arrays, _ = layout(config)
    return {k: np.ndarray(shape, dtype, memory, offset) for k, (dtype, shape, offset) in arrays.items()}


class Emulator:
    """One environment."""

    def __init__(self, i: int, config: dict[str, Any], arrays: dict[str, np.ndarray], hook: Callable[[np.ndarray], None] | None) -> None:
        self.i, self.config, self.arrays, self.hook = i, config, arrays, hook
        self.ram = arrays["ram"][i]
        self.screens = {name: arrays[name][i] for name in config["screens"]}
        self.actions = [ale_py.Action(a) for a in config["actions"]]
        self.least_skip, self.most_skip = config["frame_skip"][0], config["frame_skip"][1] - 1
        # All frames of a step in one call, unless something is wanted of single ones.
        self.pairs = [name for name in self.screens if SCREENS[name][0] > 1]
        self.whole = self.least_skip == self.most_skip and hook is None and not self.pairs and not config["noop_max"]
        self.over = self.game_over = False  # the episode that is shown has ended, and so has the game
        self.ended = b""  # the state that is shown, where the next game has begun already

    def load(self, seed: int) -> None:
        c = self.config
        ale = ale_py.ALEInterface()
        ale.setFloat("repeat_action_probability", c["repeat_action_probability"])
        ale.setInt("max_num_frames_per_episode", c["max_episode_frames"])
        ale.setInt("frame_skip", self.least_skip if self.whole else 1)
        # As gymnasium's own environment derives them, so that equal seeds give equal episodes.
        for_rng, for_ale = np.random.SeedSequence(None if seed < 0 else seed).generate_state(2)
        self.rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(for_rng))))
        ale.setInt("random_seed", int(for_ale.astype(np.int32)))
        ale.loadROM(c["rom_path"])
        if c["game_mode"][self.i] is not None:
            ale.setMode(c["game_mode"][self.i])
        if c["game_difficulty"][self.i] is not None:
            ale.setDifficulty(c["game_difficulty"][self.i])
        self.ale = ale
        self.over, self.ended = False, b""
        self.arrays["loaded"][self.i] = True

    def play(self, action: int, *, seen: bool = True) -> float:
        """As many frames as a step has, with an action held: their reward. No screen is copied where the step is not `seen`."""
        self.held = action
        if self.whole:
            return self.ale.act(self.actions[action])
        low, high = self.least_skip, self.most_skip
        reward, frames = 0.0, low if low == high else int(self.rng.integers(low, high + 1))
        for k in range(frames):
            if seen and k == frames - 1:
                for name in self.pairs:
                    self.shoot(name, -2) if k else self.shift(name)
            reward += self.frame(action)
        return reward

    def frame(self, action: int) -> float:
        """One emulated frame, its hook before it."""
        if self.hook is not None:
            self.edit()
        return self.ale.act(self.actions[action])

    def edit(self) -> None:
        """Let the hook write RAM."""
        before = self.ale.getRAM()
        wanted = before.copy()
        self.hook(wanted)  # pyright: ignore[reportOptionalCall]
        for address in np.flatnonzero(wanted != before).tolist():
            self.ale.setRAM(address, int(wanted[address]))

    def shoot(self, name: str, place: int) -> None:
        """Copy the screen, as it is after the last frame."""
        out = self.screens[name][place]
        if name == "screen":
            self.ale.getScreen(out)
        elif name == "gray":
            self.ale.getScreenGrayscale(out)
        else:
            self.ale.getScreenRGB(out)

    def shift(self, name: str) -> None:
        """What was the latest frame is the one before it."""
        self.screens[name][-2] = self.screens[name][-1]

    def prepare(self) -> None:
        """Begin the next episode unseen: with the next life where a life is an episode and the game goes on, else with a new game."""
        total, length = self.arrays["episode_return"][self.i], self.arrays["episode_length"][self.i]
        if not self.game_over:
            total += self.play(0, seen=False)
        if self.game_over or self.ale.game_over():
            total, length = self.new_game(), 0
        for action in self.config["fire"]:
            total = self.unless_over(total + self.play(action, seen=False))
        self.game_over, self.first = False, (total, length)

    def new_game(self) -> float:
        """Random no-ops follow where wanted; none of it counts as steps. Their reward."""
        noop_max, total = self.config["noop_max"], 0.0
        self.ale.reset_game()
        self.held = 0
        for _ in range(int(self.rng.integers(1, noop_max + 1)) if noop_max else 0):
            total = self.unless_over(total + self.frame(0))
        return total

    def unless_over(self, total: float) -> float:
        """The rewards of a game; of a new one where it ended before its first step."""
        if not self.ale.game_over():
            return total
        self.ale.reset_game()
        return 0.0

    def restart(self) -> None:
        """Show the beginning of the next episode."""
        if not self.ended:
            self.prepare()
        self.over, self.ended = False, b""
        arrays, ale, i = self.arrays, self.ale, self.i
        arrays["reward"][i] = 0
        arrays["terminated"][i] = arrays["truncated"][i] = False
        arrays["started"][i] = True
        arrays["episode_return"][i], arrays["episode_length"][i] = self.first
        arrays["lives"][i], arrays["frame_number"][i] = ale.lives(), ale.getEpisodeFrameNumber()
        ale.getRAM(self.ram)
        for name in self.screens:
            self.shoot(name, -1)
        for name in self.pairs:
            self.shift(name)

    def reset(self) -> None:
        """Show the beginning of another episode, of a new game unless only a life had ended."""
        if not self.over:
            self.game_over = True
        self.restart()

    def keep_final(self) -> None:
        for name in KEPT:
            if name in self.arrays:
                self.arrays[f"final_{name}"][self.i] = self.arrays[name][self.i]

    def state(self) -> bytes:
        """What is shown and all that the next steps depend on."""
        return self.ended or pickle.dumps(
            (self.ale.cloneState(include_rng=True), self.rng.bit_generator.state, self.over, self.game_over, self.held)
        )

    def save(self) -> None:
        state = self.state()
        if len(state) > STATE_BYTES:
            raise RuntimeError(f"the emulator's state takes {len(state)} bytes, there is room for {STATE_BYTES}")
        self.arrays["state"][self.i, : len(state)] = np.frombuffer(state, np.uint8)
        self.arrays["state_bytes"][self.i] = len(state)

    def restore(self) -> None:
        data = self.arrays["state"][self.i, : self.arrays["state_bytes"][self.i]].tobytes()
        state, self.rng.bit_generator.state, self.over, self.game_over, self.held = pickle.loads(data)
        # The emulator's state lacks the action that a sticky frame repeats: act it until it is held for certain.
        p = self.config["repeat_action_probability"]
        for _ in range(1 + int(np.ceil(np.log(CERTAIN) / np.log(p))) if p else 1):
            self.ale.act(self.actions[self.held])
        self.ale.restoreState(state)
        self.ended = b""

    def write(self) -> None:
        wanted, ram = self.arrays["written"][self.i], self.ram
        if self.ended or (self.over and self.game_over):  # what is written cannot matter any more
            ram[:] = wanted
            return
        for address in np.flatnonzero(wanted != ram).tolist():
            self.ale.setRAM(address, int(wanted[address]))
        self.ale.getRAM(ram)


class Share:
    """The environments of one worker."""

    def __init__(self, config: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        self.arrays, self.autoreset, self.episodic_life = arrays, config["autoreset"], config["episodic_life"]
        hook = None
        if config["hook"] is not None:
            hook = pickle.loads(bytes.fromhex(config["hook"]))  # by value: see `AlePool`
        self.share = slice(*config["share"])
        self.emulators = [Emulator(i, config, arrays, hook) for i in range(*config["share"])]
        self.commands = {RESET: self.reset, STEP: self.step, SAVE: self.save, RESTORE: self.restore, WRITE: self.write}

    def reset(self) -> None:
        for e in self.chosen():
            seed = int(self.arrays["seed"][e.i])
            if seed >= 0 or not self.arrays["loaded"][e.i]:
                e.load(seed)
            e.reset()

    def step(self) -> None:
        arrays, here = self.arrays, self.share
        # The step after an end restarts, whatever the action.
        resting = [e.over and self.autoreset == NEXT_STEP for e in self.emulators]
        # All play before any is looked at: an emulation leaves nothing else in the processor's caches, so little should lie between two.
        rewards = [
            0.0 if rests else e.play(action)
            for e, action, rests in zip(self.emulators, arrays["action"][here].tolist(), resting, strict=True)
        ]
        ales = [e.ale for e in self.emulators]
        game_over, lives = np.array([ale.game_over() for ale in ales]), np.array([ale.lives() for ale in ales])
        life_over = (lives > 0) & (lives < arrays["lives"][here]) & self.episodic_life
        arrays["reward"][here] = rewards
        arrays["terminated"][here] = life_over
        arrays["truncated"][here] = arrays["started"][here] = False
        arrays["lives"][here] = lives
        arrays["frame_number"][here] = [ale.getEpisodeFrameNumber() for ale in ales]
        arrays["episode_return"][here] += rewards
        arrays["episode_length"][here] += 1
        for e, ale in zip(self.emulators, ales, strict=True):
            ale.getRAM(e.ram)
            for name in e.screens:
                e.shoot(name, -1)
        for k in np.flatnonzero(game_over | life_over | resting).tolist():
            self.emulators[k].restart() if resting[k] else self.end(self.emulators[k], bool(game_over[k]))

    def end(self, e: Emulator, game_over: bool) -> None:
        """An episode ended with this step."""
        arrays, i = self.arrays, e.i
        e.over, e.game_over = True, game_over
        if game_over:
            arrays["terminated"][i] |= e.ale.game_over(with_truncation=False)
            arrays["truncated"][i] = e.ale.game_truncated()
        if self.autoreset == SAME_STEP:
            e.keep_final()
            kept = {name: arrays[name][i] for name in ("reward", "terminated", "truncated")}
            e.restart()
            for name, value in kept.items():
                arrays[name][i] = value

    def ahead(self, wanted: Callable[[], bool]) -> None:
        """Until something is wanted, prepare new games where games are over: each costs as much as 16 steps, and nobody waits now."""
        for e in self.emulators:
            if e.over and e.game_over:
                if wanted():
                    return
                e.ended = e.state()
                e.prepare()

    def save(self) -> None:
        for e in self.emulators:
            e.save()

    def restore(self) -> None:
        for e in self.chosen():
            if not self.arrays["loaded"][e.i]:
                e.load(-1)
                e.ale.reset_game()
            e.restore()

    def write(self) -> None:
        for e in self.chosen():
            e.write()

    def chosen(self) -> list[Emulator]:
        return [e for e in self.emulators if self.arrays["chosen"][e.i]]


def main(socket_fd: int, memory_fd: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    if hasattr(os, "SCHED_BATCH"):  # a worker that is woken must not take the core of the parent before that has woken the others
        with contextlib.suppress(OSError):  # where a sandbox forbids it, it costs a few percent
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    link = socket.socket(fileno=socket_fd)
    with link.makefile("rb") as incoming:
        config = json.loads(incoming.readline())
        memory = mmap.mmap(memory_fd, layout(config)[1])
        share = Share(config, view(memory, config))
        while (command := incoming.read(1)) not in (b"", QUIT):
            try:
                share.commands[command]()
                link.sendall(OK)
                share.ahead(lambda: bool(select.select([link], [], [], 0)[0]))
            except Exception:
                text = traceback.format_exc().encode()
                link.sendall(ERROR + len(text).to_bytes(4, "big") + text)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
