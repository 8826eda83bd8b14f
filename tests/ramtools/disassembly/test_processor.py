"""Hand-traced programs, and the emulator's RAM after the same frames."""

import ale_py
import numpy as np
import pytest

from ocjax.console.rom_files import rom_path
from ocjax.emulators.start import log_errors_only
from ocjax.ramtools.disassembly import all_ram, cartridge
from ocjax.ramtools.disassembly.machine import Machine
from ocjax.ramtools.disassembly.opcodes import LENGTHS, OPCODES
from ocjax.ramtools.disassembly.processor import Processor, StopError

START, SUBROUTINE = 0xF000, 0xF100


class Memory:
    """64 KiB of RAM with a program."""

    def __init__(self, program, subroutine=()):
        self.bytes = bytearray(1 << 16)
        self.bytes[START : START + len(program)] = bytes(program)
        self.bytes[SUBROUTINE : SUBROUTINE + len(subroutine)] = bytes(subroutine)
        self.bytes[0xFFFC:] = bytes((0x00, 0xF0, 0x00, 0xF1))

    def read(self, address):
        return self.bytes[address]

    def write(self, address, value):
        self.bytes[address] = value


def run(program, steps, subroutine=()):
    p = Processor(Memory(bytes.fromhex(program), bytes.fromhex(subroutine or "")))
    for _ in range(steps):
        p.step()
    return p


def test_opcodes():
    assert len(OPCODES) == 151
    assert {o.mode for o in OPCODES.values()} == set(LENGTHS)
    assert OPCODES[0x91] == ("STA", "(zero),y", 6)


@pytest.mark.parametrize(
    ("program", "steps", "a", "carry", "overflow"),
    [
        ("18 A9 58 69 46", 3, 0x9E, 0, 1),  # 88 + 70 as signed bytes
        ("F8 18 A9 58 69 46", 4, 0x04, 1, 1),  # 58 + 46 as decimals
        ("38 A9 40 E9 41", 3, 0xFF, 0, 0),
        ("F8 38 A9 40 E9 13", 4, 0x27, 1, 0),  # 40 - 13 as decimals
        ("F8 38 A9 00 E9 01", 4, 0x99, 0, 0),
        ("38 A9 01 6A", 3, 0x80, 1, 0),
        ("38 A9 80 2A", 3, 0x01, 1, 0),
    ],
)
def test_arithmetic(program, steps, a, carry, overflow):
    p = run(program, steps)
    assert (p.a, p.c, p.v) == (a, carry, overflow)


def test_addresses():
    """LDX #3, LDY #2; pointers at 0x83 (0x0112) and 0x80; every way of access."""
    memory = "A2 03 A0 02 A9 12 85 83 A9 01 85 84 A9 77 81 80 A9 55 91 83 B6 7F 86 90"
    p = run(memory, 12)
    assert p.bus.bytes[0x112] == 0x77, "(0x80,X) is the address at 0x83"
    assert p.bus.bytes[0x114] == 0x55, "(0x83),Y is two bytes further"
    assert p.x == p.bus.bytes[0x90] == 0, "0x7F,Y is 0x81"
    assert p.cycles == 4 * 2 + 3 + 2 + 3 + 2 + 6 + 2 + 6 + 4 + 3 - 2


def test_cycles_of_branches_and_pages():
    assert run("18 B0 10", 2).cycles == 4, "not taken"
    assert run("18 90 10", 2).cycles == 5, "taken"
    assert run("18 90 80", 2).cycles == 6, "to another page"
    assert run("A2 01 BD 00 F0", 2).cycles == 6
    assert run("A2 01 BD FF F0", 2).cycles == 7, "a load across a page"
    assert run("A2 01 9D FF 01", 2).cycles == 7, "a store always takes 5"


def test_subroutines():
    p = run("20 00 F1 A9 07", 3, "E8 60")
    assert (p.x, p.a, p.s, p.pc) == (1, 0, 0xFF, START + 3)
    assert p.cycles == 6 + 2 + 6
    p = run("38 00 FF A9 07", 4, "18 40")
    assert (p.pc, p.c, p.s) == (START + 3, 1, 0xFF), "BRK skips a byte, and RTI restores flags"


def test_undocumented_instruction():
    with pytest.raises(StopError, match="no instruction at F000"):
        run("02", 1)


@pytest.mark.parametrize("size", [1000, 32768])
def test_unsupported_cartridge(size):
    with pytest.raises(ValueError, match=f"cartridges of {size:,} bytes are not supported"):
        cartridge.read(bytes(size))


@pytest.mark.parametrize(
    ("rom", "kind", "banks"),
    [
        ("pong", "2K", 1),
        ("seaquest", "4K", 1),
        ("asterix", "F8", 2),
        ("double_dunk", "F6", 4),
        ("montezuma_revenge", "E0", 8),
        ("robotank", "FE", 2),
        ("pitfall2", "DPC", 2),
        ("elevator_action", "F8SC", 2),
        ("klax", "F6SC", 4),
    ],
)
def test_kinds_of_cartridges(rom, kind, banks):
    found = cartridge.read(rom_path(rom).read_bytes())
    assert (found.kind, found.banks) == (kind, banks)


def test_hotspots():
    found = cartridge.read(rom_path("asterix").read_bytes())
    assert found.offset(0xF123, found.after(0xFFF8, found.start)) == 0x0123
    assert found.offset(0xF123, found.after(0x1FF9, found.start)) == 0x1123
    assert found.after(0x0FF8, found.start) == found.start, "an address outside of the cartridge"
    slices = cartridge.read(rom_path("montezuma_revenge").read_bytes())
    after = slices.after(0x1FEA, slices.start)
    assert [slices.offset(0x1000 + 0x400 * i, after) // 0x400 for i in range(4)] == [4, 2, 6, 7]


@pytest.mark.parametrize(
    "rom", ["space_invaders", "montezuma_revenge", "robotank", "up_n_down", "klax"]
)
def test_frames_as_in_the_emulator(rom):
    """The RAM after a frame equals ALE's. Other games also depend on collisions and paddles."""
    log_errors_only()
    ale = ale_py.ALEInterface()
    ale.setFloat("repeat_action_probability", 0.0)
    ale.loadROM(rom_path(rom))
    for _ in range(100):
        ale.act(ale_py.Action.NOOP)
    machine = Machine(cartridge.read(rom_path(rom).read_bytes()))
    for _ in range(8):
        machine.run_frame()
    same = []
    for _ in range(10):
        machine.load(all_ram(machine.cartridge, ale))
        machine.run_frame()
        ale.act(ale_py.Action.NOOP)
        after = machine.ram + machine.extra if machine.cartridge.has_ram else machine.ram
        expected = np.frombuffer(all_ram(machine.cartridge, ale), np.uint8)
        same.append(np.frombuffer(after, np.uint8) == expected)
    assert np.mean(same) > 0.99
