"""The setuptools command that collects the packages of a wheel or an editable install.

In the repository, `ocjax/extractors` is a symbolic link to `extractors`. Zip archives of code
hosts, pip and `python -m zipfile` turn it into a text file; the build restores the link.
"""

from pathlib import Path

from setuptools import find_packages
from setuptools.command.build_py import build_py
from setuptools.errors import FileError

# Relative to the repository, the working directory of builds.
LINK, TARGET = (Path("ocjax/extractors"), Path("../extractors"))


class BuildPy(build_py):
    """`build_py` that always includes the games."""

    def finalize_options(self) -> None:
        """Restore the link, and find the packages behind it."""
        if not (LINK / "__init__.py").is_file():
            _restore()
            self.distribution.packages = find_packages(include=["ocjax", "ocjax.*"])
        super().finalize_options()


def _restore() -> None:
    try:
        LINK.unlink(missing_ok=True)
        LINK.symlink_to(TARGET, target_is_directory=True)
    except OSError as error:
        raise FileError(
            f"{LINK} must be a symbolic link to {TARGET}, and it cannot be created here: {error}"
        ) from error
    if not (LINK / "__init__.py").is_file():
        raise FileError(
            f"{LINK} leads to no games: the folder {TARGET.name} is missing in {Path.cwd()}"
        )
