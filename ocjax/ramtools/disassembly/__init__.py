"""`ocjax ram disassemble`: the program of a game, with the beam's position and its RAM writes.

`opcodes` and `registers` are tables. `cartridge` knows the banks, `processor` interprets
instructions, and `machine` is a console that records them. `tracing` runs it on states of play,
`code` follows the program without running it, and `listing` writes the result.
"""

from pathlib import Path

import ale_py

from ocjax.ramtools import roms
from ocjax.ramtools.disassembly import cartridge, listing, tracing

__all__ = ["disassemble"]

APART = 10  # frames of play from one state to the next
INTEGER = 4  # bytes of an integer in a saved state; RAM has one integer a byte


def disassemble(
    name: str, *, states: int = 120, seed: int = 0, game_mode: int | None = None
) -> listing.Program:
    """Disassemble a program, and run it for a frame from each of some states of play.

    Args:
        name: of the game; see `roms.find`.
        game_mode: see `ocjax.make_vec`.
    """
    found = roms.find(name)
    rom = cartridge.read(Path(found.path).read_bytes())
    moments = roms.moments(found, states, APART, seed, game_mode)
    trace = tracing.trace(rom, [all_ram(rom, ale) for ale in moments], seed)
    return listing.program(found.name, rom, trace, found.game.ram if found.game else None)


def all_ram(of: cartridge.Cartridge, ale: ale_py.ALEInterface) -> bytes:
    """The console's RAM, followed by the cartridge's RAM if there is any.

    Raises:
        ValueError: the emulator does not save the cartridge's RAM.
    """
    ram = ale.getRAM().tobytes()
    if not of.has_ram:
        return ram
    saved = ale.cloneSystemState().serialize()
    name = f"Cartridge{of.kind}".encode()
    if name not in saved:
        raise ValueError(f"the emulator's state does not contain {name.decode()}")
    first = saved.rindex(name) + len(name) + len(("bank", "size")) * INTEGER
    return ram + saved[first : first + cartridge.EXTRA * INTEGER : INTEGER]
