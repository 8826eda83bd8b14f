"""The ROMs that ale-py installs."""

import functools
import hashlib
import importlib.util
import os
from pathlib import Path


class RomError(ValueError):
    """A game's ROM is missing, or is not the one that its decoder was written for."""


def rom_path(rom: str) -> Path:
    """The file of a ROM, found without importing ale-py.

    Args:
        rom: ale-py's name of the ROM, such as "space_invaders".

    Returns:
        `<rom>.bin` in the folder that the environment variable `ALE_ROMS_DIR` names, or by default where ale-py installs its ROMs.

    Raises:
        RomError: a ValueError; there is no such file.
    """
    folder = os.environ.get("ALE_ROMS_DIR")
    if not folder:
        spec = importlib.util.find_spec("ale_py")
        if spec is None or not spec.submodule_search_locations:
            raise RomError(f"the ROM {rom!r} comes with ale-py, which is not installed: pip install ale-py")
        folder = Path(spec.submodule_search_locations[0]) / "roms"
    path = Path(folder) / f"{rom}.bin"
    if not path.is_file():
        raise RomError(f"expected the ROM {rom!r} at {path}, which does not exist: install ale-py >= 0.12, or correct ALE_ROMS_DIR")
    return path


def read_rom(rom: str, md5: str) -> bytes:
    """The contents of a ROM, which are read once per process.

    Args:
        rom: ale-py's name of the ROM.
        md5: the expected MD5 hash in hexadecimal.

    Raises:
        RomError: a ValueError; the ROM is missing, or its hash is another one.
    """
    path = rom_path(rom)
    data, found = _contents(path)
    if found != md5:
        raise RomError(
            f"expected the ROM {rom!r} with md5 {md5}, which the game's decoder was written for, but {path} has md5 {found}: "
            "reinstall ale-py, or point ALE_ROMS_DIR to a folder with the expected ROM"
        )
    return data


@functools.cache
def _contents(path: Path) -> tuple[bytes, str]:
    """A file's contents and their MD5 hash."""
    data = path.read_bytes()
    return data, hashlib.md5(data).hexdigest()
