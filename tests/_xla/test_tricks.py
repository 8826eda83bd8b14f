"""`benchmarks/tricks.py` finds every trick, and each trick that a comment names exists."""

import importlib
import re

import pytest

import ocjax
from tests.support.states import ROOT

MODULES = [*ROOT.glob("ocjax/_xla/*.py"), *ROOT.glob("ocjax/vision/**/*.py")]
MODULES += [ROOT / "ocjax" / "extraction" / f"{name}.py" for name in ("rem", "vem")]


@pytest.fixture
def tricks(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("tricks")


def test_places_exist(tricks):
    for trick in tricks.BY_NAME.values():
        module, _, name = trick.place.rpartition(".")
        assert hasattr(importlib.import_module(f"ocjax.{module}"), name), trick.name
        assert {game for case in trick.cases for game in case.games} <= set(ocjax.games())
    assert len(tricks.BY_NAME) == len(tricks.TRICKS) + len(tricks.SIZES)


def test_rows_that_comments_name_exist(tricks):
    for path in MODULES:
        comments = re.sub(r"\n# ", " ", path.read_text())
        for text in re.findall(r"Rows? (`[^.]*?) of benchmarks/tricks", comments):
            for name in re.findall(r"`([^`]+)`", text):
                assert any(trick.startswith(name) for trick in tricks.BY_NAME), (path, name)


def test_a_trick_is_replaced_where_it_is_used(tricks, monkeypatch):
    from ocjax.vision.components import candidates, layout

    monkeypatch.setattr(candidates, "BLOCK_ROWS", layout.BLOCK_ROWS)  # undone afterwards
    monkeypatch.setattr(layout, "BLOCK_ROWS", layout.BLOCK_ROWS)
    tricks.replace(tricks.BY_NAME["blocks of rows, 16"])
    assert candidates.BLOCK_ROWS == layout.BLOCK_ROWS == 16
