"""An interpreter of the 6507's documented instructions."""

from collections.abc import Callable
from typing import Protocol

from ocjax.ramtools.disassembly.opcodes import CHANGES, LENGTHS, OPCODES, STORES

STACK = 0x100
RESET, BREAK = 0xFFFC, 0xFFFE  # where the addresses of the first instruction and of BRK's are


class StopError(Exception):
    """The program cannot be followed any further."""


class Bus(Protocol):
    """Everything that the processor reads and writes."""

    def read(self, address: int) -> int:
        """Read a byte."""
        ...

    def write(self, address: int, value: int) -> None:
        """Write a byte."""
        ...


class Processor:
    """The registers of a 6507, and its instructions.

    Attributes:
        pc: address of the next instruction, 16 bits.
        n, v, d, i, z, c: flags, 0 or 1.
        cycles: since the start; the bus may add some.
    """

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.a = self.x = self.y = 0
        self.s = 0xFF
        self.n = self.v = self.d = self.z = self.c = 0
        self.i = 1
        self.cycles = 0
        self.pc = self._word(RESET)

    def step(self) -> None:
        """Execute an instruction."""
        pc = self.pc
        opcode = OPCODES.get(self.bus.read(pc))
        if opcode is None:
            raise StopError(f"no instruction at {pc:04X}")
        name, mode, cycles = opcode
        self.pc = pc + LENGTHS[mode] & 0xFFFF
        self.cycles += cycles
        address = self._address(mode, pc + 1, name)
        if mode == "relative":
            if _TAKEN[name](self):
                self.cycles += 1 + (address >> 8 != self.pc >> 8)
                self.pc = address
        elif mode == "accumulator":
            self.a = _CHANGED[name](self, self.a)
        elif name in STORES:
            self.bus.write(address, getattr(self, name[2].lower()))
        elif name in CHANGES:
            self.bus.write(address, _CHANGED[name](self, self.bus.read(address)))
        elif mode == "implied":
            _IMPLIED[name](self)
        elif name == "JMP":
            self.pc = address
        elif name == "JSR":
            self._push_word(self.pc - 1)
            self.pc = address
        else:
            _READ[name](self, self.bus.read(address))

    def _address(self, mode: str, at: int, name: str) -> int:
        """The address of the operand whose first byte is at `at`; 0 without one."""
        if mode in ("implied", "accumulator"):
            return 0
        if mode == "immediate":
            return at
        low = self.bus.read(at)
        if mode in _ZERO_PAGE:
            return _ZERO_PAGE[mode](self, low)
        if mode == "(zero,x)":
            return self._zero_word(low + self.x)
        if mode == "(zero),y":
            return self._paged(self._zero_word(low), self.y, name)
        if mode == "relative":
            return self.pc + (low ^ 0x80) - 0x80 & 0xFFFF
        word = low | self.bus.read(at + 1) << 8
        if mode == "absolute":
            return word
        if mode == "(absolute)":
            return self.bus.read(word) | self.bus.read(word & 0xFF00 | word + 1 & 0xFF) << 8
        return self._paged(word, self.x if mode == "absolute,x" else self.y, name)

    def _paged(self, base: int, index: int, name: str) -> int:
        """Add an index to an address; loads take a cycle more if this crosses a page."""
        address = base + index & 0xFFFF
        if address >> 8 != base >> 8 and name not in STORES and name not in CHANGES:
            self.cycles += 1
        return address

    def _zero_word(self, address: int) -> int:
        return self.bus.read(address & 0xFF) | self.bus.read(address + 1 & 0xFF) << 8

    def _word(self, address: int) -> int:
        return self.bus.read(address) | self.bus.read(address + 1) << 8

    def push(self, value: int) -> None:
        """Push a byte to the stack."""
        self.bus.write(STACK | self.s, value)
        self.s = self.s - 1 & 0xFF

    def _push_word(self, value: int) -> None:
        self.push(value >> 8 & 0xFF)
        self.push(value & 0xFF)

    def call_break(self) -> None:
        """BRK: some games call a subroutine with it. It returns to the byte after the next one."""
        self._push_word(self.pc + 1)
        self.push(self.status)
        self.i, self.pc = 1, self._word(BREAK)

    def pull(self) -> int:
        """Pull a byte from the stack."""
        self.s = self.s + 1 & 0xFF
        return self.bus.read(STACK | self.s)

    def flagged(self, value: int) -> int:
        """Set the flags N and Z to a value's, and return its low byte."""
        value &= 0xFF
        self.n, self.z = value >> 7, int(value == 0)
        return value

    @property
    def status(self) -> int:
        """The flags as a byte, as PHP pushes it."""
        return self.n << 7 | self.v << 6 | 0x30 | self.d << 3 | self.i << 2 | self.z << 1 | self.c

    @status.setter
    def status(self, value: int) -> None:
        self.n, self.v = value >> 7, value >> 6 & 1
        self.d, self.i, self.z, self.c = (value >> bit & 1 for bit in (3, 2, 1, 0))


def _add(p: Processor, value: int) -> None:
    total = p.a + value + p.c
    p.v = ((p.a ^ total) & (value ^ total)) >> 7 & 1
    if p.d:
        low = (p.a & 15) + (value & 15) + p.c
        low += 6 if low > 9 else 0
        high = (p.a >> 4) + (value >> 4) + (low > 15)
        high += 6 if high > 9 else 0
        p.flagged(total)
        p.c, p.a = int(high > 15), (high << 4 | low & 15) & 0xFF
        return
    p.c, p.a = int(total > 0xFF), p.flagged(total)


def _subtract(p: Processor, value: int) -> None:
    total, borrow = p.a - value - 1 + p.c, 1 - p.c
    p.v = ((p.a ^ value) & (p.a ^ total)) >> 7 & 1
    p.c = int(total >= 0)
    if p.d:
        low = (p.a & 15) - (value & 15) - borrow
        high = (p.a >> 4) - (value >> 4) - (low < 0)
        p.flagged(total)
        p.a = (high - (6 if high < 0 else 0) << 4 | low - (6 if low < 0 else 0) & 15) & 0xFF
        return
    p.a = p.flagged(total)


def _compare(register: int, p: Processor, value: int) -> None:
    p.flagged(register - value)
    p.c = int(register >= value)


def _test_bits(p: Processor, value: int) -> None:
    p.n, p.v, p.z = value >> 7, value >> 6 & 1, int(p.a & value == 0)


def _shifted_left(p: Processor, value: int, carry: int = 0) -> int:
    p.c = value >> 7
    return p.flagged(value << 1 | carry)


def _shifted_right(p: Processor, value: int, carry: int = 0) -> int:
    p.c = value & 1
    return p.flagged(value >> 1 | carry << 7)


def _set(target: str, value: Callable[[Processor], int]) -> Callable[[Processor], None]:
    """A copy to a register, which sets the flags N and Z."""
    return lambda p: setattr(p, target, p.flagged(value(p)))


def _flag(target: str, value: int) -> Callable[[Processor], None]:
    return lambda p: setattr(p, target, value)


def _return(p: Processor) -> None:
    low = p.pull()
    p.pc = (low | p.pull() << 8) + 1 & 0xFFFF


def _return_from_interrupt(p: Processor) -> None:
    p.status = p.pull()
    low = p.pull()
    p.pc = low | p.pull() << 8


_ZERO_PAGE: dict[str, Callable[[Processor, int], int]] = {
    "zero": lambda p, low: low,
    "zero,x": lambda p, low: low + p.x & 0xFF,
    "zero,y": lambda p, low: low + p.y & 0xFF,
}
_TAKEN: dict[str, Callable[[Processor], bool | int]] = {
    "BPL": lambda p: not p.n,
    "BMI": lambda p: p.n,
    "BVC": lambda p: not p.v,
    "BVS": lambda p: p.v,
    "BCC": lambda p: not p.c,
    "BCS": lambda p: p.c,
    "BNE": lambda p: not p.z,
    "BEQ": lambda p: p.z,
}
_CHANGED: dict[str, Callable[[Processor, int], int]] = {
    "ASL": _shifted_left,
    "LSR": _shifted_right,
    "ROL": lambda p, value: _shifted_left(p, value, p.c),
    "ROR": lambda p, value: _shifted_right(p, value, p.c),
    "INC": lambda p, value: p.flagged(value + 1),
    "DEC": lambda p, value: p.flagged(value - 1),
}
_READ: dict[str, Callable[[Processor, int], None]] = {
    "LDA": lambda p, value: setattr(p, "a", p.flagged(value)),
    "LDX": lambda p, value: setattr(p, "x", p.flagged(value)),
    "LDY": lambda p, value: setattr(p, "y", p.flagged(value)),
    "AND": lambda p, value: setattr(p, "a", p.flagged(p.a & value)),
    "ORA": lambda p, value: setattr(p, "a", p.flagged(p.a | value)),
    "EOR": lambda p, value: setattr(p, "a", p.flagged(p.a ^ value)),
    "ADC": _add,
    "SBC": _subtract,
    "CMP": lambda p, value: _compare(p.a, p, value),
    "CPX": lambda p, value: _compare(p.x, p, value),
    "CPY": lambda p, value: _compare(p.y, p, value),
    "BIT": _test_bits,
}
_IMPLIED: dict[str, Callable[[Processor], None]] = {
    "BRK": Processor.call_break,
    "CLC": _flag("c", 0),
    "SEC": _flag("c", 1),
    "CLD": _flag("d", 0),
    "SED": _flag("d", 1),
    "CLI": _flag("i", 0),
    "SEI": _flag("i", 1),
    "CLV": _flag("v", 0),
    "NOP": lambda p: None,
    "DEX": _set("x", lambda p: p.x - 1),
    "DEY": _set("y", lambda p: p.y - 1),
    "INX": _set("x", lambda p: p.x + 1),
    "INY": _set("y", lambda p: p.y + 1),
    "TAX": _set("x", lambda p: p.a),
    "TAY": _set("y", lambda p: p.a),
    "TSX": _set("x", lambda p: p.s),
    "TXA": _set("a", lambda p: p.x),
    "TYA": _set("a", lambda p: p.y),
    "TXS": lambda p: setattr(p, "s", p.x),
    "PHA": lambda p: p.push(p.a),
    "PHP": lambda p: p.push(p.status),
    "PLA": _set("a", Processor.pull),
    "PLP": lambda p: setattr(p, "status", p.pull()),
    "RTS": _return,
    "RTI": _return_from_interrupt,
}
