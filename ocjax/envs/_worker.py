"""The program of one worker process: steps its share of the emulators, results into shared memory.

Run as a file with two inherited file descriptors, a socket and the shared memory. It must not import ocjax: a worker needs neither
JAX nor its start-up time. One byte over the socket asks for something, one byte answers; an error is answered by its text.
It ends when the socket closes, so it cannot outlive the process that started it.
"""

import json
import mmap
import signal
import socket
import sys
import traceback
from typing import Any

import ale_py
import numpy as np

RESET, STEP, SAVE, RESTORE, WRITE, QUIT, OK, ERROR = b"R", b"S", b"C", b"L", b"W", b"Q", b"K", b"E"


def layout(num_envs: int, screen: tuple[int, int] | None) -> tuple[dict[str, tuple[str, tuple[int, ...], int]], int]:
    """Name -> (dtype, shape, offset) of the arrays in the shared memory, and its size in bytes."""
    arrays: dict[str, tuple[str, tuple[int, ...]]] = {
        "ram": ("uint8", (num_envs, 128)),
        "action": ("int32", (num_envs,)),  # index into the action set
        "seed": ("int64", (num_envs,)),  # -1: none
        "chosen": ("bool", (num_envs,)),  # which RESET, RESTORE and WRITE are for
        "written": ("uint8", (num_envs, 128)),  # the RAM wanted on WRITE
        "reward": ("float64", (num_envs,)),
        "terminated": ("bool", (num_envs,)),
        "truncated": ("bool", (num_envs,)),
        "lives": ("int32", (num_envs,)),
        "frame_number": ("int64", (num_envs,)),  # of the episode
    }
    if screen:
        arrays["screen"] = ("uint8", (num_envs, 2, *screen))  # the last two emulated frames, the latest second
    out, offset = {}, 0
    for name, (dtype, shape) in arrays.items():
        out[name] = (dtype, shape, offset)
        offset += -(-int(np.prod(shape)) * np.dtype(dtype).itemsize // 64) * 64
    return out, offset


def view(memory: mmap.mmap, num_envs: int, screen: tuple[int, int] | None) -> dict[str, np.ndarray]:
    """The arrays in the shared memory."""
    arrays, _ = layout(num_envs, screen)
    return {k: np.ndarray(shape, dtype, memory, offset) for k, (dtype, shape, offset) in arrays.items()}


class Share:
    """The emulators of one worker."""

    def __init__(self, config: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        self.config = config
        self.arrays = arrays
        self.emulators: dict[int, Any] = {}
        self.over = dict.fromkeys(range(*config["share"]), False)
        self.saved: dict[int, tuple[Any, bool]] = {}

    def load(self, i: int, seed: int) -> None:
        ale = ale_py.ALEInterface()
        ale.setFloat("repeat_action_probability", self.config["repeat_action_probability"])
        ale.setInt("max_num_frames_per_episode", self.config["max_episode_frames"])
        # Emulated frames are stepped in one call unless the one before the last is wanted too.
        ale.setInt("frame_skip", 1 if "screen" in self.arrays else self.config["frame_skip"])
        # As ale-py's own environment derives it, so that equal seeds give equal episodes.
        entropy = None if seed < 0 else seed
        ale.setInt("random_seed", int(np.random.SeedSequence(entropy).generate_state(2)[1].astype(np.int32)))
        ale.loadROM(self.config["rom_path"])
        if self.config["mode"] is not None:
            ale.setMode(self.config["mode"])
        if self.config["difficulty"] is not None:
            ale.setDifficulty(self.config["difficulty"])
        self.emulators[i] = ale

    def restart(self, i: int) -> None:
        ale, arrays = self.emulators[i], self.arrays
        ale.reset_game()
        self.over[i] = False
        arrays["reward"][i] = 0
        arrays["terminated"][i] = arrays["truncated"][i] = False
        self.observe(i)
        if "screen" in arrays:
            ale.getScreen(arrays["screen"][i, 1])
            arrays["screen"][i, 0] = arrays["screen"][i, 1]

    def observe(self, i: int) -> None:
        ale, arrays = self.emulators[i], self.arrays
        ale.getRAM(arrays["ram"][i])
        arrays["lives"][i] = ale.lives()
        arrays["frame_number"][i] = ale.getEpisodeFrameNumber()

    def reset(self) -> None:
        for i in self.over:
            if self.arrays["chosen"][i]:
                seed = int(self.arrays["seed"][i])
                if seed >= 0 or i not in self.emulators:
                    self.load(i, seed)
                self.restart(i)

    def save(self) -> None:
        self.saved = {i: (ale.cloneState(include_rng=True), self.over[i]) for i, ale in self.emulators.items()}

    def restore(self) -> None:
        for i, (state, over) in self.saved.items():
            if self.arrays["chosen"][i]:
                self.emulators[i].restoreState(state)
                self.over[i] = over
                self.observe(i)

    def write(self) -> None:
        for i, ale in self.emulators.items():
            if self.arrays["chosen"][i]:
                wanted = self.arrays["written"][i]
                for address in np.flatnonzero(wanted != self.arrays["ram"][i]).tolist():
                    ale.setRAM(address, int(wanted[address]))
                ale.getRAM(self.arrays["ram"][i])

    def step(self) -> None:
        arrays, actions, skip = self.arrays, self.config["actions"], self.config["frame_skip"]
        screens = arrays.get("screen")
        for i, over in self.over.items():
            if over:
                self.restart(i)  # next-step autoreset: the action is ignored
                continue
            ale, action = self.emulators[i], ale_py.Action(actions[arrays["action"][i]])
            if screens is None:
                reward = ale.act(action)
            else:
                reward = 0
                for _ in range(skip - 1):
                    reward += ale.act(action)
                if skip > 1:
                    ale.getScreen(screens[i, 0])
                else:
                    screens[i, 0] = screens[i, 1]
                reward += ale.act(action)
                ale.getScreen(screens[i, 1])
            arrays["reward"][i] = reward
            arrays["terminated"][i] = terminated = ale.game_over(with_truncation=False)
            arrays["truncated"][i] = truncated = ale.game_truncated()
            self.over[i] = terminated or truncated
            self.observe(i)


def main(socket_fd: int, memory_fd: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    link = socket.socket(fileno=socket_fd)
    with link.makefile("rb") as incoming:
        config = json.loads(incoming.readline())
        screen = tuple(config["screen"]) if config["screen"] else None
        memory = mmap.mmap(memory_fd, layout(config["num_envs"], screen)[1])
        share = Share(config, view(memory, config["num_envs"], screen))
        commands = {RESET: share.reset, STEP: share.step, SAVE: share.save, RESTORE: share.restore, WRITE: share.write}
        while (command := incoming.read(1)) not in (b"", QUIT):
            try:
                commands[command]()
            except Exception:
                text = traceback.format_exc().encode()
                link.sendall(ERROR + len(text).to_bytes(4, "big") + text)
            else:
                link.sendall(OK)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
