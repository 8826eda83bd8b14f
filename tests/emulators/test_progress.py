"""Progress bars."""

import io

import pytest
from rich.console import Console

from ocjax.emulators.progress import progress_bar


@pytest.mark.parametrize("notebook", [False, True])
def test_notebooks_show_no_bar(notebook):
    """In a notebook, rich warns if ipywidgets is missing."""
    console = Console(file=io.StringIO(), force_jupyter=notebook, force_terminal=not notebook)
    with progress_bar("playing", "games", console) as report:
        report(1, 3)
    assert ("1 of 3 games" in console.file.getvalue()) == (not notebook)
