"""Find the instructions of a program that can be reached from its entry points."""

from collections.abc import Iterable
from typing import NamedTuple

from ocjax.ramtools.disassembly.cartridge import Cartridge, Slots
from ocjax.ramtools.disassembly.opcodes import BRANCHES, LEAVES, LENGTHS, OPCODES, Opcode
from ocjax.ramtools.disassembly.processor import BREAK, RESET

Place = tuple[int, Slots]  # an address, and what the processor sees of the cartridge


class Instruction(NamedTuple):
    """An instruction in a cartridge.

    Args:
        offset: of its first byte in the file.
        slots: what the processor sees of the cartridge then.
        operand: the number behind the first byte; the target's address of branches; 0 without one.
    """

    offset: int
    address: int
    slots: Slots
    opcode: Opcode
    operand: int
    data: bytes

    @property
    def target(self) -> int | None:
        """The address of a branch, jump or call."""
        jumps = self.opcode.name in ("JMP", "JSR") and self.opcode.mode == "absolute"
        return self.operand if jumps or self.opcode.name in BRANCHES else None


def decode(cartridge: Cartridge, address: int, slots: Slots) -> Instruction | None:
    """The instruction at an address. None for an undocumented opcode."""
    offset = cartridge.offset(address, slots)
    opcode = OPCODES.get(cartridge.data[offset])
    if opcode is None:
        return None
    length = LENGTHS[opcode.mode]
    data = bytes(cartridge.data[cartridge.offset(address + i, slots)] for i in range(length))
    operand = int.from_bytes(data[1:], "little")
    if opcode.name in BRANCHES:
        operand = address + 2 + (operand ^ 0x80) - 0x80 & 0xFFFF
    return Instruction(offset, address, slots, opcode, operand, data)


def switched(cartridge: Cartridge, instruction: Instruction) -> Slots:
    """The visible slots of the cartridge after an instruction and its memory access."""
    slots = instruction.slots
    for i in range(len(instruction.data)):
        slots = cartridge.after(instruction.address + i, slots)
    mode = instruction.opcode.mode
    reads = mode.startswith("absolute") and instruction.target is None
    return cartridge.after(instruction.operand, slots) if reads else slots


def reachable(cartridge: Cartridge, entries: Iterable[Place]) -> dict[int, Instruction]:
    """The instructions that can be reached, by their offsets in the file.

    Branches are followed both ways, and subroutines return; jumps to RAM are not followed. The
    first way to an instruction decides which banks it sees.
    """
    found: dict[int, Instruction] = {}
    todo = list(entries)[::-1]
    while todo:
        address, slots = todo.pop()
        if not address & 0x1000 or cartridge.offset(address, slots) in found:
            continue
        instruction = decode(cartridge, address, slots)
        if instruction is None:
            continue
        found[instruction.offset] = instruction
        after, name = switched(cartridge, instruction), instruction.opcode.name
        if instruction.target is not None:
            todo.append((instruction.target, after))
        if name == "BRK":
            todo += [(address + 2, after), (word(cartridge, BREAK, after), after)]
        if name not in LEAVES:
            todo.append((address + len(instruction.data), after))
    return found


def word(cartridge: Cartridge, address: int, slots: Slots) -> int:
    """The address that two bytes of the cartridge hold."""
    low, high = (cartridge.data[cartridge.offset(address + i, slots)] for i in range(2))
    return low | high << 8


def start(cartridge: Cartridge) -> Place:
    """Where the program begins."""
    return word(cartridge, RESET, cartridge.start), cartridge.start
