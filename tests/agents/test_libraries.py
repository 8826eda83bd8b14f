"""The programs of the page on training libraries; a missing library skips its program."""

import importlib.util
import re
import subprocess
import sys

import pytest

from tests.support.states import ROOT

PAGE = (ROOT / "docs" / "training.md").read_text("utf-8")
PROGRAMS = dict(re.findall(r"<!-- (\S+) -->\n```py\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE))


def installed(module):
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def test_programs_are_found():
    assert len(PROGRAMS) == PAGE.count("<!--") == 4


@pytest.mark.slow
@pytest.mark.parametrize("library", PROGRAMS)
def test_program(library, tmp_path):
    if not installed(library):
        pytest.skip(f"{library} is not installed")
    # Warnings of other projects do not concern ocjax.
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", PROGRAMS[library]],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
