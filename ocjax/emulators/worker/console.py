"""ALE's saved states: a check of every field, and the facts for restoring.

ALE trusts lengths, banks and positions: a forged state could write outside its memory.
"""

import struct
from typing import Any, NamedTuple

from .sticky import generator_state

BYTE, WORD, ANY = range(2**8), range(2**16), range(-(2**31), 2**31)
COUNT = range(2**31)
_BOOLS = (0xFAB1FAB2 - 2**32, 0xBAD1BAD2 - 2**32)  # True and False
_STOPPED = 1  # bit of the processor's status for a complete last frame
_TRUE = _BOOLS[:1]
_LINE = 228  # clocks of a scan line

# The allowed integers; the "same integer" or the "same" text as in other states of the game; or the
# text of "random" numbers.
Kind = range | tuple[int, ...] | str
Fields = tuple[tuple[int, Kind], ...]  # (number of fields, their kind), in order

_HEAD: Fields = ((2, ANY), (4, COUNT))  # paddles; numbers of frames, mode, difficulty
_FRAMES_AT = 12  # bytes before the number of frames since the reset
_SYSTEM: Fields = ((2, "same"), (1, ANY), (1, "random"))  # ROM; cycles
# A, X, Y, SP, IR; PC; flags; status. Then: number of bytes, RAM, timer, its shift, cycles,
# interrupt, directions of the ports.
_PROCESSOR: Fields = ((1, "same"), (5, BYTE), (1, WORD), (7, _BOOLS), (1, BYTE))
_RAM: Fields = (
    *((1, "same"), (1, (128,)), (128, BYTE), (1, ANY), (1, (0, 3, 6, 10))),
    *((2, ANY), (1, _BOOLS), (2, BYTE)),
)
_CLOCKS, _CLOCKS_AT = 8, len(b"\3\0\0\0TIA")
_PICTURE: Fields = (
    *((1, "same"), (_CLOCKS, ANY)),
    (5, BYTE),  # enabled objects, VSYNC, VBLANK, NUSIZ
    (4, ANY),  # colours
    (2, BYTE),  # CTRLPF, priority and score
    *((2, _BOOLS), (1, ANY), (4, BYTE), (4, _BOOLS)),  # REFP, PF, GRP, ENAM and ENABL
    *((5, range(-128, 128)), (5, _BOOLS), (1, WORD)),  # HM, VDEL and RESMP, collisions
    *((5, range(160)), (2, BYTE)),  # positions, current GRP
    *((1, ANY), (2, _BOOLS), (1, range(4))),  # HMOVE, the stars of Cosmic Ark
    *((1, _BOOLS), (1, ANY)),  # dump
    *((1, "same"), (6, BYTE), (1, ANY)),  # sound
)
_CARTRIDGES: dict[bytes, Fields] = {
    b"Cartridge2K": (),
    b"Cartridge4K": (),
    b"CartridgeF8": ((1, range(2)),),
    b"CartridgeF6": ((1, range(4)),),
    b"CartridgeF6SC": ((1, range(4)), (1, (128,)), (128, BYTE)),  # with the cartridge's RAM
    b"CartridgeFE": (),
    # ALE does not restore the mapped parts of the ROM.
    b"CartridgeE0": ((1, (4,)), (4, "same integer")),
    b"CartridgeDPC": (
        *(
            (1, range(2)),
            (1, (8,)),
            (8, BYTE),
            (1, (8,)),
            (8, BYTE),
            (1, (8,)),
            (8, range(2048)),
            (1, (8,)),
            (8, BYTE),
        ),
        *((1, (3,)), (3, _BOOLS), (1, BYTE), (1, ANY), (1, range(10**8))),
    ),
}
_ROUNDED = b"CartridgeDPC"
_ROUNDED_AT = 4 * (sum(count for count, _ in _CARTRIDGES[_ROUNDED]) - 1)


class ConsoleState(NamedTuple):
    """Facts of one of ALE's states."""

    frames: int  # emulated since the reset
    # The last frame is complete. ALE stops very long frames early, such as Q*bert's first.
    complete: bool
    random: bytes  # the random numbers, for `ExecutedAction.synchronize`


class _Reader:
    """Reads a state in parallel with a known good state of the same game."""

    def __init__(self, data: bytes, good: bytes) -> None:
        self.data, self.good = data, good
        self.at = self.good_at = 0

    def integers(self, count: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The next integers of both states."""
        size = 4 * count
        if self.at + size > len(self.data):
            raise ValueError("it is too short")
        pair = (
            struct.unpack_from(f"<{count}i", self.data, self.at),
            struct.unpack_from(f"<{count}i", self.good, self.good_at),
        )
        self.at, self.good_at = self.at + size, self.good_at + size
        return pair

    def text(self) -> tuple[bytes, bytes]:
        """The next text of both states."""
        (length,), (good_length,) = self.integers(1)
        if not 0 <= length <= len(self.data) - self.at:
            raise ValueError(f"a text has {length} bytes")
        pair = (
            self.data[self.at : self.at + length],
            self.good[self.good_at : self.good_at + good_length],
        )
        self.at, self.good_at = self.at + length, self.good_at + good_length
        return pair

    def read(self, fields: Fields) -> list[Any]:
        """The next fields, integers and texts."""
        out: list[Any] = []
        for count, kind in fields:
            if kind in ("same", "random"):
                out += [self._checked_text(kind) for _ in range(count)]
            else:
                out += self._checked_integers(count, kind)
        return out

    def _checked_text(self, kind: Kind) -> bytes:
        where, (text, good) = self.at, self.text()
        if kind == "random":
            generator_state(text)
        elif text != good:
            raise ValueError(f"expected {good!r} at byte {where}, got {text[:40]!r}")
        return text

    def _checked_integers(self, count: int, kind: Kind) -> tuple[int, ...]:
        where, (values, good) = self.at, self.integers(count)
        allowed = good if isinstance(kind, str) else kind
        wrong = [] if kind is ANY else [value for value in values if value not in allowed]
        if wrong:
            raise ValueError(f"the number {wrong[0]} at or after byte {where} is out of range")
        return values


def check(data: bytes, good: bytes) -> None:
    """Check that bytes are a well-formed state of ALE with all fields in their ranges.

    Args:
        good: a state of the same game.
    """
    outer = _Reader(data, good)
    outer.read(_HEAD)
    inner = _Reader(*outer.text())
    outer.read(((2, ANY),))  # limits of paddles
    inner.read(_SYSTEM)
    *_, status = inner.read(_PROCESSOR)
    inner.read(_RAM)
    clocks = struct.unpack_from(f"<{_CLOCKS}i", inner.good, inner.good_at + _CLOCKS_AT)
    _, *picture = inner.read(_PICTURE)
    _check_clocks(picture[:_CLOCKS], list(clocks), complete=bool(status & _STOPPED))
    (cartridge,) = inner.read(((1, "same"),))
    inner.read(_cartridge(cartridge))
    _check_game(inner)
    inner.read(((1, _TRUE), (1, "random")))
    if outer.at != len(data) or inner.at != len(inner.data):
        raise ValueError("it is too long")


def _cartridge(name: bytes) -> Fields:
    """The fields of a kind of cartridge."""
    if name not in _CARTRIDGES:
        known = ", ".join(one.decode() for one in _CARTRIDGES)
        raise RuntimeError(
            f"the cartridge {name.decode()} is not supported, only {known}; add its fields to "
            "_CARTRIDGES in ocjax/emulators/worker/console.py"
        )
    return _CARTRIDGES[name]


def _check_clocks(clocks: list[int], good: list[int], *, complete: bool) -> None:
    """Check the clocks of the picture, which ALE resets unless the last frame is incomplete."""
    _, start, stop, last_update, left, *_ = clocks
    fits = stop - start == good[2] - good[1] and last_update >= start and 0 <= left <= _LINE
    if not complete and not fits:
        raise ValueError(f"its frame is incomplete, and its clocks are out of range: {clocks}")


def _check_game(reader: _Reader) -> None:
    """Read the game's fields: the integers and bools before the random numbers."""
    size = _tail(reader.good)[0] - 8 - reader.good_at
    where, (values, good) = reader.at, reader.integers(size // 4)
    if any(g in _BOOLS and value not in _BOOLS for value, g in zip(values, good, strict=True)):
        raise ValueError(f"the game's fields at byte {where} are damaged")


def _tail(inner: bytes) -> tuple[int, bytes]:
    """The random numbers at the end of a state: their start, and their text."""
    start = len(inner.rstrip(b"0123456789 "))
    return start, inner[start:]


def facts(data: bytes) -> ConsoleState:
    """The facts of a state that ALE has written."""
    inner = data[: len(data) - 8]
    processor_end = data.index(b"\5\0\0\0M6532")
    (status,) = struct.unpack_from("<i", data, processor_end - 4)
    (frames,) = struct.unpack_from("<i", data, _FRAMES_AT)
    return ConsoleState(frames, bool(status & _STOPPED), _tail(inner)[1])


def equal(a: bytes, b: bytes) -> bool:
    """True if two states are equal, except for a field of Pitfall II that ALE rounds."""
    at = a.find(_ROUNDED)
    rounded = (
        slice(0, 0)
        if at < 0
        else slice(at + len(_ROUNDED) + _ROUNDED_AT, at + len(_ROUNDED) + _ROUNDED_AT + 4)
    )
    return a[: rounded.start] == b[: rounded.start] and a[rounded.stop :] == b[rounded.stop :]
