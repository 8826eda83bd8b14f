"""Progress bars."""

import io
import sys

import pytest
import rich.console
from rich.console import Console

from ocjax.emulators import progress as module
from ocjax.emulators.progress import progress, progress_bar, start_bar


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture(params=[False, True], ids=["terminal", "notebook"])
def notebook(request):
    return request.param


def terminals(monkeypatch, notebook):
    """Replace the standard streams; the streams of a notebook look like terminals, too."""
    out, err = Terminal(), Terminal()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    monkeypatch.setattr(rich.console, "_is_jupyter", lambda: notebook)
    monkeypatch.setenv("TERM", "xterm")
    return out, err


def test_notebooks_show_no_bar(notebook, monkeypatch):
    """In a notebook, rich warns if ipywidgets is missing, and warnings are errors here."""
    out, _ = terminals(monkeypatch, notebook)
    with progress_bar("playing", "games", Console(file=out)) as report:
        report(1, 3)
    assert ("1 of 3 games" in out.getvalue()) == (not notebook)


def test_notebooks_show_lines_of_progress(notebook, monkeypatch):
    out, err = terminals(monkeypatch, notebook)
    monkeypatch.setattr(module, "SECONDS", 0.0)
    monkeypatch.setattr(rich, "_console", None)  # rich's shared console keeps its kind of output
    assert list(progress(range(2), "changing")) == [0, 1]
    assert bool(out.getvalue()) == (not notebook)
    assert ("changing: 100 %" in err.getvalue()) == notebook


def test_notebooks_show_no_bar_of_emulators(notebook, monkeypatch):
    terminals(monkeypatch, notebook)
    with start_bar(4) as report:
        assert (report is None) == notebook
