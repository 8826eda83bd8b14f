"""Run a game's program on states of play, and find when it writes each byte of RAM."""

import copy
import dataclasses
from collections.abc import Iterable

import numpy as np

from ocjax.ramtools.disassembly.cartridge import Cartridge
from ocjax.ramtools.disassembly.machine import IDLE, LINE, NOT_PRESSED, Frame, Machine, Visit
from ocjax.ramtools.disassembly.processor import StopError

BOOT = 8  # frames from the reset before states of play are loaded
STICKS = (IDLE, IDLE & ~0x10, IDLE & ~0x20, IDLE & ~0x40, IDLE & ~0x80)  # of the first player
TIMES = ("before", "during", "after")


@dataclasses.dataclass
class Writes:
    """The first and last scan line of an instruction's writes to a byte."""

    first: int
    last: int


@dataclasses.dataclass
class Trace:
    """The execution of a program.

    Args:
        visits: the executed instructions by their offsets in the file.
        writes: by byte of RAM, offset of the instruction and one of `TIMES`.
        frames: number of frames of play that were run.
        failed: number of states from which the program got lost.
    """

    visits: dict[int, Visit]
    writes: dict[tuple[int, int, str], Writes]
    frames: int
    failed: int


def trace(cartridge: Cartridge, rams: Iterable[bytes], seed: int = 0) -> Trace:
    """Run a program from its reset, then for one frame from each state of play.

    A frame begins when the program ends the vertical sync, as in ALE; there, the RAM of a state
    replaces the machine's. If a program gets lost, the machine continues from the frames after its
    reset.

    Args:
        rams: the RAM of the states; see `Machine.load`.
    """
    machine, rng = Machine(cartridge), np.random.default_rng(seed)
    out = Trace(machine.visits, {}, 0, 0)
    try:
        for _ in range(BOOT):
            machine.run_frame()
    except StopError:
        out.failed += 1
        return out
    booted = copy.deepcopy(machine)
    for ram in rams:
        machine.load(ram)
        machine.joysticks = STICKS[rng.integers(len(STICKS))]
        machine.button = int(rng.integers(2)) * NOT_PRESSED
        try:
            _count(machine.run_frame(), out)
        except StopError:
            out.failed += 1
            machine = copy.deepcopy(booted)
            machine.visits = out.visits
    return out


def _count(frame: Frame, out: Trace) -> None:
    out.frames += 1
    for byte, at, cycle in frame.writes:
        line = (cycle - frame.start) // LINE
        found = out.writes.setdefault((byte, at, _time(frame, cycle)), Writes(line, line))
        found.first, found.last = min(found.first, line), max(found.last, line)


def _time(frame: Frame, cycle: int) -> str:
    if frame.first_drawn is None or frame.last_drawn is None or cycle < frame.first_drawn:
        return TIMES[0]
    return TIMES[1] if cycle <= frame.last_drawn else TIMES[2]
