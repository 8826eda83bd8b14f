"""The format of a saved emulator: a header that identifies it, a checksum, and numbers.

Unlike a pickle, it cannot contain code.
"""

import struct
import zlib
from typing import Any, NamedTuple

from . import console

MAGIC = b"ocjaxALE"
VERSION = 3
# Magic, version, name and MD5 hash of the ROM, CRC-32 of everything after the header.
_HEADER = struct.Struct("<8sH32s16sI")
# Phase, action and its strength; the random generator's state, increment, flag of 32 remaining
# bits, and these bits; the number of bytes of `before`.
_NUMBERS = struct.Struct("<BBf16s16sBIB")
_PHASES = range(2, 5)  # phases that show an episode or its end
RUNNING = _PHASES[0]  # an episode
_ACTIONS = range(18)
_LENGTHS = (0, 128)  # of `before`: empty, or a RAM


class EmulatorState(NamedTuple):
    """All values that determine the future of an emulator."""

    phase: int
    action: int  # ale-py's number of the action of the last emulated frame
    strength: float  # of this action
    generator: dict[str, Any]  # state of NumPy's PCG64
    before: bytes  # the RAM before the last frame, after the hooks' edits; empty without hooks
    ale: bytes  # ALE's state


def pack(rom: str, md5: str, snapshot: EmulatorState) -> bytes:
    """The bytes of a saved emulator."""
    state, increment = (
        snapshot.generator["state"][name].to_bytes(16, "little") for name in ("state", "inc")
    )
    left = snapshot.generator["has_uint32"], snapshot.generator["uinteger"]
    numbers = _NUMBERS.pack(
        snapshot.phase,
        snapshot.action,
        snapshot.strength,
        state,
        increment,
        *left,
        len(snapshot.before),
    )
    body = numbers + snapshot.before + snapshot.ale
    return _HEADER.pack(MAGIC, VERSION, rom.encode(), bytes.fromhex(md5), zlib.crc32(body)) + body


def unpack(data: bytes) -> EmulatorState:
    """The inverse of `pack`, for bytes that have passed `check`."""
    phase, action, strength, state, increment, has_left, left, length = _NUMBERS.unpack_from(
        data, _HEADER.size
    )
    numbers = {"state": int.from_bytes(state, "little"), "inc": int.from_bytes(increment, "little")}
    generator = {
        "bit_generator": "PCG64",
        "state": numbers,
        "has_uint32": has_left,
        "uinteger": left,
    }
    rest = data[_HEADER.size + _NUMBERS.size :]
    return EmulatorState(phase, action, strength, generator, rest[:length], rest[length:])


def check(data: bytes, rom: str, md5: str, good: bytes) -> int:
    """Check that bytes are an undamaged state of an emulator with this ROM; return its phase.

    `good` is a state of ALE to compare with.

    Raises:
        ValueError: the bytes are damaged, or belong to another ROM or version.
    """
    if len(data) < _HEADER.size + _NUMBERS.size or not data.startswith(MAGIC):
        raise ValueError(
            f"expected a state that clone_state saved, which begins with {MAGIC!r}, got "
            f"{len(data)} bytes: {data[:8]!r}..."
        )
    _, version, saved_rom, saved_md5, checksum = _HEADER.unpack_from(data)
    if version != VERSION:
        raise ValueError(
            f"expected a state in version {VERSION} of the format, got version {version}: save "
            "it with this version of ocjax"
        )
    if saved_md5.hex() != md5:
        name = saved_rom.rstrip(b"\0").decode(errors="replace")
        raise ValueError(
            f"expected a state of the ROM {rom!r} with md5 {md5}, got one of the ROM {name!r} "
            f"with md5 {saved_md5.hex()}"
        )
    found = zlib.crc32(data[_HEADER.size :])
    if found != checksum:
        raise ValueError(
            f"the state is damaged: expected the checksum {checksum:08x}, got {found:08x}; save "
            "it again"
        )
    phase, action, strength, *_, has_left, _, length = _NUMBERS.unpack_from(data, _HEADER.size)
    known = phase in _PHASES and action in _ACTIONS and length in _LENGTHS and has_left in (0, 1)
    if not known or not 0 <= strength <= 1:
        numbers = (
            f"phase {phase}, action {action}, strength {strength}, flag {has_left}, length {length}"
        )
        raise ValueError(
            f"the state is damaged: a number is out of range in {numbers}; save it again"
        )
    try:
        console.check(unpack(data).ale, good)
    except ValueError as error:
        raise ValueError(
            f"the state is damaged: in the emulator's part, {error}; save it again"
        ) from error
    return phase
