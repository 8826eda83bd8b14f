"""The documented instructions of the 6507, from MOS's programming manual (1976), appendix B."""

from typing import NamedTuple


class Opcode(NamedTuple):
    """An instruction with its addressing mode, a key of `LENGTHS`.

    `cycles` excludes the additional ones of branches and crossed pages.
    """

    name: str
    mode: str
    cycles: int


LENGTHS = {  # bytes of an instruction, by its addressing mode
    "implied": 1,
    "accumulator": 1,
    "immediate": 2,
    "zero": 2,
    "zero,x": 2,
    "zero,y": 2,
    "(zero,x)": 2,
    "(zero),y": 2,
    "relative": 2,
    "absolute": 3,
    "absolute,x": 3,
    "absolute,y": 3,
    "(absolute)": 3,
}

# by mnemonic: for each mode the code and the cycles
_TABLE = {
    "ADC": {
        "immediate": (0x69, 2),
        "zero": (0x65, 3),
        "zero,x": (0x75, 4),
        "absolute": (0x6D, 4),
        "absolute,x": (0x7D, 4),
        "absolute,y": (0x79, 4),
        "(zero,x)": (0x61, 6),
        "(zero),y": (0x71, 5),
    },
    "AND": {
        "immediate": (0x29, 2),
        "zero": (0x25, 3),
        "zero,x": (0x35, 4),
        "absolute": (0x2D, 4),
        "absolute,x": (0x3D, 4),
        "absolute,y": (0x39, 4),
        "(zero,x)": (0x21, 6),
        "(zero),y": (0x31, 5),
    },
    "ASL": {
        "accumulator": (0x0A, 2),
        "zero": (0x06, 5),
        "zero,x": (0x16, 6),
        "absolute": (0x0E, 6),
        "absolute,x": (0x1E, 7),
    },
    "BCC": {"relative": (0x90, 2)},
    "BCS": {"relative": (0xB0, 2)},
    "BEQ": {"relative": (0xF0, 2)},
    "BIT": {"zero": (0x24, 3), "absolute": (0x2C, 4)},
    "BMI": {"relative": (0x30, 2)},
    "BNE": {"relative": (0xD0, 2)},
    "BPL": {"relative": (0x10, 2)},
    "BRK": {"implied": (0x00, 7)},
    "BVC": {"relative": (0x50, 2)},
    "BVS": {"relative": (0x70, 2)},
    "CLC": {"implied": (0x18, 2)},
    "CLD": {"implied": (0xD8, 2)},
    "CLI": {"implied": (0x58, 2)},
    "CLV": {"implied": (0xB8, 2)},
    "CMP": {
        "immediate": (0xC9, 2),
        "zero": (0xC5, 3),
        "zero,x": (0xD5, 4),
        "absolute": (0xCD, 4),
        "absolute,x": (0xDD, 4),
        "absolute,y": (0xD9, 4),
        "(zero,x)": (0xC1, 6),
        "(zero),y": (0xD1, 5),
    },
    "CPX": {"immediate": (0xE0, 2), "zero": (0xE4, 3), "absolute": (0xEC, 4)},
    "CPY": {"immediate": (0xC0, 2), "zero": (0xC4, 3), "absolute": (0xCC, 4)},
    "DEC": {
        "zero": (0xC6, 5),
        "zero,x": (0xD6, 6),
        "absolute": (0xCE, 6),
        "absolute,x": (0xDE, 7),
    },
    "DEX": {"implied": (0xCA, 2)},
    "DEY": {"implied": (0x88, 2)},
    "EOR": {
        "immediate": (0x49, 2),
        "zero": (0x45, 3),
        "zero,x": (0x55, 4),
        "absolute": (0x4D, 4),
        "absolute,x": (0x5D, 4),
        "absolute,y": (0x59, 4),
        "(zero,x)": (0x41, 6),
        "(zero),y": (0x51, 5),
    },
    "INC": {
        "zero": (0xE6, 5),
        "zero,x": (0xF6, 6),
        "absolute": (0xEE, 6),
        "absolute,x": (0xFE, 7),
    },
    "INX": {"implied": (0xE8, 2)},
    "INY": {"implied": (0xC8, 2)},
    "JMP": {"absolute": (0x4C, 3), "(absolute)": (0x6C, 5)},
    "JSR": {"absolute": (0x20, 6)},
    "LDA": {
        "immediate": (0xA9, 2),
        "zero": (0xA5, 3),
        "zero,x": (0xB5, 4),
        "absolute": (0xAD, 4),
        "absolute,x": (0xBD, 4),
        "absolute,y": (0xB9, 4),
        "(zero,x)": (0xA1, 6),
        "(zero),y": (0xB1, 5),
    },
    "LDX": {
        "immediate": (0xA2, 2),
        "zero": (0xA6, 3),
        "zero,y": (0xB6, 4),
        "absolute": (0xAE, 4),
        "absolute,y": (0xBE, 4),
    },
    "LDY": {
        "immediate": (0xA0, 2),
        "zero": (0xA4, 3),
        "zero,x": (0xB4, 4),
        "absolute": (0xAC, 4),
        "absolute,x": (0xBC, 4),
    },
    "LSR": {
        "accumulator": (0x4A, 2),
        "zero": (0x46, 5),
        "zero,x": (0x56, 6),
        "absolute": (0x4E, 6),
        "absolute,x": (0x5E, 7),
    },
    "NOP": {"implied": (0xEA, 2)},
    "ORA": {
        "immediate": (0x09, 2),
        "zero": (0x05, 3),
        "zero,x": (0x15, 4),
        "absolute": (0x0D, 4),
        "absolute,x": (0x1D, 4),
        "absolute,y": (0x19, 4),
        "(zero,x)": (0x01, 6),
        "(zero),y": (0x11, 5),
    },
    "PHA": {"implied": (0x48, 3)},
    "PHP": {"implied": (0x08, 3)},
    "PLA": {"implied": (0x68, 4)},
    "PLP": {"implied": (0x28, 4)},
    "ROL": {
        "accumulator": (0x2A, 2),
        "zero": (0x26, 5),
        "zero,x": (0x36, 6),
        "absolute": (0x2E, 6),
        "absolute,x": (0x3E, 7),
    },
    "ROR": {
        "accumulator": (0x6A, 2),
        "zero": (0x66, 5),
        "zero,x": (0x76, 6),
        "absolute": (0x6E, 6),
        "absolute,x": (0x7E, 7),
    },
    "RTI": {"implied": (0x40, 6)},
    "RTS": {"implied": (0x60, 6)},
    "SBC": {
        "immediate": (0xE9, 2),
        "zero": (0xE5, 3),
        "zero,x": (0xF5, 4),
        "absolute": (0xED, 4),
        "absolute,x": (0xFD, 4),
        "absolute,y": (0xF9, 4),
        "(zero,x)": (0xE1, 6),
        "(zero),y": (0xF1, 5),
    },
    "SEC": {"implied": (0x38, 2)},
    "SED": {"implied": (0xF8, 2)},
    "SEI": {"implied": (0x78, 2)},
    "STA": {
        "zero": (0x85, 3),
        "zero,x": (0x95, 4),
        "absolute": (0x8D, 4),
        "absolute,x": (0x9D, 5),
        "absolute,y": (0x99, 5),
        "(zero,x)": (0x81, 6),
        "(zero),y": (0x91, 6),
    },
    "STX": {"zero": (0x86, 3), "zero,y": (0x96, 4), "absolute": (0x8E, 4)},
    "STY": {"zero": (0x84, 3), "zero,x": (0x94, 4), "absolute": (0x8C, 4)},
    "TAX": {"implied": (0xAA, 2)},
    "TAY": {"implied": (0xA8, 2)},
    "TSX": {"implied": (0xBA, 2)},
    "TXA": {"implied": (0x8A, 2)},
    "TXS": {"implied": (0x9A, 2)},
    "TYA": {"implied": (0x98, 2)},
}
OPCODES = {
    code: Opcode(name, mode, cycles)
    for name, modes in _TABLE.items()
    for mode, (code, cycles) in modes.items()
}
"""The instructions by their first byte."""

STORES = frozenset({"STA", "STX", "STY"})
CHANGES = frozenset({"ASL", "LSR", "ROL", "ROR", "INC", "DEC"})  # read and write the same address
BRANCHES = frozenset(name for name, modes in _TABLE.items() if "relative" in modes)
LEAVES = frozenset({"RTS", "RTI", "BRK", "JMP"})  # the next instruction does not follow them
