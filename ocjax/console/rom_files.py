"""The ROM files that ale-py installs, found without importing ale-py."""

import functools
import hashlib
import importlib.util
import os
from pathlib import Path

__all__ = ["RomError", "game_name", "read_rom", "rom_names", "rom_path"]


class RomError(ValueError):
    """A game's ROM is missing, or differs from the one for which its decoder was written."""


def rom_names() -> tuple[str, ...]:
    """Return ale-py's sorted names of its ROMs, such as "space_invaders"."""
    return tuple(sorted(path.stem for path in _installed().glob("*.bin")))


def game_name(rom: str) -> str:
    """Return the game of a ROM as in ale-py's ids: "air_raid" is the ROM of "ALE/AirRaid-v5"."""
    return rom.title().replace("_", "")


def _installed() -> Path:
    spec = importlib.util.find_spec("ale_py")
    if spec is None or not spec.submodule_search_locations:
        raise RomError(
            "the games' ROMs come with ale-py, which is not installed: pip install ale-py"
        )
    return Path(spec.submodule_search_locations[0]) / "roms"


def rom_path(rom: str) -> Path:
    """The path of a ROM, such as "space_invaders".

    The folder is `ALE_ROMS_DIR`, by default ale-py's.
    """
    folder = Path(os.environ.get("ALE_ROMS_DIR") or _installed())
    path = folder / f"{rom}.bin"
    if not path.is_file():
        raise RomError(
            f"expected the ROM {rom!r} at {path}, which does not exist: install ale-py >= 0.12, "
            "or correct ALE_ROMS_DIR"
        )
    return path


def read_rom(rom: str, md5: str) -> bytes:
    """Read a ROM with an MD5 hash in hexadecimal, once per process."""
    path = rom_path(rom)
    data, found = _contents(path)
    if found != md5:
        raise RomError(
            f"expected the ROM {rom!r} with md5 {md5}, which the game's decoder was written for, "
            f"but {path} has md5 {found}: "
            "reinstall ale-py, or point ALE_ROMS_DIR to a folder with the expected ROM"
        )
    return data


@functools.cache
def _contents(path: Path) -> tuple[bytes, str]:
    data = path.read_bytes()
    return data, hashlib.md5(data, usedforsecurity=False).hexdigest()
