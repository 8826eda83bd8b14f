"""A console that runs a game's program and records its execution and its RAM writes.

It draws nothing: collisions read as none, and the chip DPC of Pitfall II reads as 0.
"""

from dataclasses import dataclass, field

from ocjax.console.ram import RAM_SIZE
from ocjax.ramtools.disassembly.cartridge import EXTRA, KIB, Cartridge
from ocjax.ramtools.disassembly.processor import Processor, StopError
from ocjax.ramtools.disassembly.registers import GRAPHICS, VBLANK, VSYNC, WSYNC

LINE = 76  # processor cycles per scan line
MOST_CYCLES = 4 * 262 * LINE  # without a vertical sync, the program is lost
INTERVALS = (1, 8, 64, 1024)  # cycles per step of the timer, by the register that starts it
TIMER_AT_START = 25  # any; programs wait for its end to have random numbers
PADDLE_LINE = 120  # scan line of a frame from which paddles are charged
SWITCHES = 0x3F  # nothing pressed, colour television, both difficulties B
ELSEWHERE = -1  # in place of the offset of an instruction that is not in the cartridge
STACK_TOP = 0x70  # bytes of RAM from here on may be the stack
IDLE = 0xFF  # of the joysticks
NOT_PRESSED = 0x80


@dataclass
class Visit:
    """An executed instruction; it began at cycles `first` to `last` of a scan line."""

    address: int
    slots: tuple[int, int, int, int]
    first: int
    last: int


@dataclass
class Frame:
    """The events between two vertical syncs, by the processor's cycles.

    Args:
        start: the end of the vertical sync.
        writes: byte of RAM, offset of the instruction, and cycle.
        first_drawn, last_drawn: the first and last nonzero writes to a register of graphics while
            the picture is on.
    """

    start: int
    writes: list[tuple[int, int, int]] = field(default_factory=list)
    first_drawn: int | None = None
    last_drawn: int | None = None


class Machine:
    """A console.

    Attributes:
        joysticks, button: the registers SWCHA and INPT4.
        visits: the executed instructions by their offsets in the file.
    """

    def __init__(self, cartridge: Cartridge) -> None:
        self.cartridge, self.slots = cartridge, cartridge.start
        self.ram = bytearray(RAM_SIZE)
        self.extra = bytearray(EXTRA)
        self.joysticks, self.button = IDLE, NOT_PRESSED
        self.visits: dict[int, Visit] = {}
        self._at = 0  # offset of the running instruction
        self._sync: int | None = None  # cycle at which the vertical sync began
        self._timer = (TIMER_AT_START, 0, INTERVALS[-1])  # value, cycle of its start, interval
        self._picture, self._ended = True, False
        self._frame = Frame(0)
        self.processor = Processor(self)

    def load(self, ram: bytes) -> None:
        """Replace the RAM, except for the stack, which has the addresses of running subroutines.

        Args:
            ram: the console's 128 bytes, and then those of the cartridge, if it has RAM.
        """
        ram, extra = ram[:RAM_SIZE], ram[RAM_SIZE:]
        self.extra[: len(extra)] = extra
        stack = self.processor.s + 1 - 0x80
        kept = self.ram[stack:] if stack >= STACK_TOP else b""
        self.ram[:] = ram[: len(ram) - len(kept)] + kept

    def run_frame(self) -> Frame:
        """Run to the end of the next vertical sync."""
        frame = self._frame = Frame(self.processor.cycles)
        self._ended = False
        while not self._ended:
            if self.processor.cycles - frame.start > MOST_CYCLES:
                raise StopError("no vertical sync")
            self._visit()
            self.processor.step()
        return frame

    def _visit(self) -> None:
        pc, cycle = self.processor.pc, self.processor.cycles % LINE
        if not pc & 0x1000:
            self._at = ELSEWHERE
            return
        self._at = self.cartridge.offset(pc, self.slots)
        seen = self.visits.get(self._at)
        if seen is None:
            self.visits[self._at] = Visit(pc, self.slots, cycle, cycle)
        elif not seen.first <= cycle <= seen.last:
            seen.first, seen.last = min(seen.first, cycle), max(seen.last, cycle)

    def read(self, address: int) -> int:
        """Read a byte."""
        if address & 0x1000:
            return self._read_cartridge(address)
        if not address & 0x80:
            return self._read_video(address & 0xF)
        if not address & 0x200:
            return self.ram[address & 0x7F]
        if address & 4:
            return self._read_timer()
        return (self.joysticks, 0, SWITCHES, 0)[address & 3]

    def _read_cartridge(self, address: int) -> int:
        cartridge = self.cartridge
        extra = cartridge.extra(address)
        if extra is not None:
            return self.extra[extra]
        if address & 0xFFF in cartridge.hotspots:
            self.slots = cartridge.after(address, self.slots)
        if cartridge.kind == "FE":
            return cartridge.data[cartridge.offset(address, self.slots)]
        if cartridge.kind == "DPC" and address & 0xFFF < 0x80:
            return 0
        return cartridge.data[self.slots[address >> 10 & 3] + (address & KIB - 1)]

    def _read_video(self, register: int) -> int:
        if register < 8:
            return 0  # no collision
        if register < 12:
            charged = self.processor.cycles - self._frame.start > PADDLE_LINE * LINE
            return 0x80 if charged else 0
        return self.button if register == 12 else NOT_PRESSED

    def _read_timer(self) -> int:
        value, since, interval = self._timer
        passed = self.processor.cycles - since
        steps = 1 + (passed - 1) // interval
        if steps <= value:
            return value - steps
        return value - steps if interval == 1 else -1 - (passed - value * interval - 1) & 0xFF

    def write(self, address: int, value: int) -> None:
        """Write a byte."""
        cycles = self.processor.cycles
        if address & 0x1000:
            self.slots = self.cartridge.after(address, self.slots)
            extra = self.cartridge.extra(address)
            if extra is not None and not address & EXTRA:
                self.extra[extra] = value
        elif not address & 0x80:
            self._write_video(address & 0x3F, value, cycles)
        elif not address & 0x200:
            self.ram[address & 0x7F] = value
            self._frame.writes.append((address & 0x7F, self._at, cycles))
        elif address & 0x14 == 0x14:
            self._timer = value, cycles, INTERVALS[address & 3]

    def _write_video(self, register: int, value: int, cycles: int) -> None:
        if register == WSYNC:
            self.processor.cycles += -cycles % LINE
        elif register == VBLANK:
            self._picture = not value & 2
        elif register == VSYNC:
            if value & 2:
                self._sync = cycles
            elif self._sync is not None and cycles >= self._sync + LINE:
                self._sync, self._ended = None, True
        elif register in GRAPHICS and value and self._picture:
            if self._frame.first_drawn is None:
                self._frame.first_drawn = cycles
            self._frame.last_drawn = cycles
