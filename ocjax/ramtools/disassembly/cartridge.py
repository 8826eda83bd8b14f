"""Cartridges: which byte of the ROM's file the processor sees at an address.

The processor sees 4 KiB. Larger cartridges switch banks at accesses to certain addresses, the
hotspots.
"""

from dataclasses import dataclass, field

Slots = tuple[int, int, int, int]
"""For each KiB that the processor sees, its offset in the file."""

KIB = 0x400
LAST = 0xFFF  # of an address in the 4 KiB
EXTRA = 0x80  # bytes of RAM in some cartridges: written at $1000, read at $1080
DPC_ROM = 0x2000  # bytes of Pitfall II's program; the rest is data of the chip DPC
SPLIT = 0x2000  # bit of an address that selects the bank of an FE cartridge

# Loads and stores of hotspots that occur in E0 cartridges only. Source: Stella's CartDetector.
E0_SIGNS = ("8de01f", "8de05f", "8de9ff", "0ce01f", "ade01f", "ade9ff", "adedff", "adf3bf")
FE_SIGNS = ("2000d0c6c5", "20c3f8a582", "d0fb2073fe", "2000f084d6")  # subroutines of the other bank


def _bank(number: int) -> Slots:
    start = 4 * KIB * number
    return start, start + KIB, start + 2 * KIB, start + 3 * KIB


@dataclass(frozen=True)
class Cartridge:
    """A cartridge.

    Args:
        kind: "2K", "4K", "F8", "F8SC", "F6", "F6SC", "E0", "FE" or "DPC"; SC: with RAM.
        start: what the processor sees after the reset.
        bank: bytes that are switched together.
        hotspots: by the low 12 bits of an address, the KiB slots that change, with their new
            offsets.
    """

    kind: str
    data: bytes
    start: Slots
    bank: int = 4 * KIB
    hotspots: dict[int, dict[int, int]] = field(default_factory=dict)

    @property
    def banks(self) -> int:
        """Number of banks."""
        return max(1, self.program // self.bank)

    @property
    def has_ram(self) -> bool:
        """Whether the cartridge contains RAM."""
        return self.kind.endswith("SC")

    def extra(self, address: int) -> int | None:
        """The byte of the cartridge's RAM at an address."""
        inside = self.has_ram and address & 0x1000 and address & LAST < 2 * EXTRA
        return address & (EXTRA - 1) if inside else None

    @property
    def program(self) -> int:
        """Bytes of the file that the processor can see."""
        return DPC_ROM if self.kind == "DPC" else len(self.data)

    def offset(self, address: int, slots: Slots) -> int:
        """The offset of an address's byte in the file."""
        if self.kind == "FE":
            slots = _bank(0 if address & SPLIT else 1)
        return slots[address >> 10 & 3] + (address & KIB - 1)

    def after(self, address: int, slots: Slots) -> Slots:
        """The visible slots after an access to an address."""
        changed = self.hotspots.get(address & LAST) if address & 0x1000 else None
        if not changed:
            return slots
        a, b, c, d = (changed.get(i, old) for i, old in enumerate(slots))
        return a, b, c, d


def read(data: bytes) -> Cartridge:
    """Recognize a cartridge."""
    size = len(data)
    if size == 2 * KIB:
        return Cartridge("2K", data, (0, KIB, 0, KIB), 2 * KIB)
    if size == 4 * KIB:
        return Cartridge("4K", data, _bank(0))
    if size == 8 * KIB and _has(data, FE_SIGNS):
        return Cartridge("FE", data, _bank(0))
    if size == 8 * KIB and _has(data, E0_SIGNS):
        slices = {0xFE0 + 8 * slot + i: {slot: KIB * i} for slot in range(3) for i in range(8)}
        return Cartridge("E0", data, (4 * KIB, 5 * KIB, 6 * KIB, 7 * KIB), KIB, slices)
    if size == 8 * KIB or DPC_ROM < size < 12 * KIB:
        kind = "F8" + _extra_ram(data) if size == 8 * KIB else "DPC"
        return Cartridge(kind, data, _bank(1), 4 * KIB, _switches(0xFF8, 2))
    if size == 16 * KIB:
        return Cartridge("F6" + _extra_ram(data), data, _bank(0), 4 * KIB, _switches(0xFF6, 4))
    raise ValueError(f"cartridges of {size:,} bytes are not supported")


def _has(data: bytes, signs: tuple[str, ...]) -> bool:
    return any(bytes.fromhex(sign) in data for sign in signs)


def _extra_ram(data: bytes) -> str:
    """SC for RAM in the cartridge: the bytes at its addresses are twice the same in each bank."""
    starts = range(0, len(data), 4 * KIB)
    twice = all(data[i : i + EXTRA] == data[i + EXTRA : i + 2 * EXTRA] for i in starts)
    return "SC" if twice else ""


def _switches(first: int, banks: int) -> dict[int, dict[int, int]]:
    """Hotspots that switch all 4 KiB."""
    return {first + i: dict(enumerate(_bank(i))) for i in range(banks)}
