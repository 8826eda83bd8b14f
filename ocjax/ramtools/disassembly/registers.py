"""Names of the video chip's and the timer chip's registers, from the Stella Programmer's Guide."""

TIA_WRITTEN = (
    *("VSYNC", "VBLANK", "WSYNC", "RSYNC", "NUSIZ0", "NUSIZ1", "COLUP0", "COLUP1"),
    *("COLUPF", "COLUBK", "CTRLPF", "REFP0", "REFP1", "PF0", "PF1", "PF2"),
    *("RESP0", "RESP1", "RESM0", "RESM1", "RESBL", "AUDC0", "AUDC1", "AUDF0"),
    *("AUDF1", "AUDV0", "AUDV1", "GRP0", "GRP1", "ENAM0", "ENAM1", "ENABL"),
    *("HMP0", "HMP1", "HMM0", "HMM1", "HMBL", "VDELP0", "VDELP1", "VDELBL"),
    *("RESMP0", "RESMP1", "HMOVE", "HMCLR", "CXCLR"),
)
"""The video chip's registers by address, as stores see them."""

TIA_READ = (
    *("CXM0P", "CXM1P", "CXP0FB", "CXP1FB", "CXM0FB", "CXM1FB", "CXBLPF", "CXPPMM"),
    *("INPT0", "INPT1", "INPT2", "INPT3", "INPT4", "INPT5"),
)
"""The video chip's registers by address, as loads see them."""

TIMER = {
    0x280: "SWCHA",
    0x281: "SWACNT",
    0x282: "SWCHB",
    0x283: "SWBCNT",
    0x284: "INTIM",
    0x285: "TIMINT",
    0x294: "TIM1T",
    0x295: "TIM8T",
    0x296: "TIM64T",
    0x297: "T1024T",
}
"""The timer chip's registers by address."""

VSYNC, VBLANK, WSYNC = 0x00, 0x01, 0x02
GRAPHICS = frozenset(map(TIA_WRITTEN.index, "PF0 PF1 PF2 GRP0 GRP1 ENAM0 ENAM1 ENABL".split()))
"""Addresses of the registers that hold pictures of objects and of the playfield."""


def is_ram(address: int) -> bool:
    """True if the console's address is one of the 128 bytes of RAM, or of their copies."""
    return address & 0x1280 == 0x80


def name(address: int, *, written: bool) -> str | None:
    """The name of the register at a console's address. None for RAM, ROM and unused addresses."""
    if address & 0x1000 or is_ram(address):
        return None
    if address & 0x80:
        return TIMER.get(address & 0x297)
    names, index = (TIA_WRITTEN, address & 0x3F) if written else (TIA_READ, address & 0xF)
    return names[index] if index < len(names) else None
