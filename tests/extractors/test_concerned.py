"""Errors in a game's files name the categories that they concern."""

import pytest

import ocjax
from tests.support import concerned

GAME = """
WIDTH = 4
AREA = (0, 0, 160, 210)
BALL = Blobs(AREA)


def decode(m):
    x = _column(m)
    y = m.y
    return {
        "Ball": box(x, y, 1, 1),
        "Player": box(m.x, y, WIDTH, 2),
    }


def _column(m):
    shifted = m.x + 1
    return shifted


GAME = game(
    Category("Ball", BALL),
    Category("Player", Blobs((0, 0, 160, WIDTH))),
)
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("WIDTH = 4", ["Player"]),
        ("AREA = (", ["Ball"]),
        ("    x = ", ["Ball"]),
        ("    y = ", ["Ball", "Player"]),
        ("shifted = ", ["Ball"]),
        ('"Player": box', ["Player"]),
        ('Category("Ball"', ["Ball"]),
        ("GAME = ", []),
    ],
)
def test_lines_concern_categories(tmp_path, text, expected):
    path = tmp_path / "game.py"
    path.write_text(GAME)
    (line,) = [i for i, row in enumerate(GAME.splitlines(), 1) if text in row]
    assert concerned.categories_at(path, line) == expected


def test_errors_get_a_note():
    with pytest.raises(AttributeError) as caught:
        ocjax.load("Pong").decode(None)
    concerned.add_categories(caught.value)
    assert caught.value.__notes__ == ["This concerns Player."]


def test_errors_with_a_cause_get_a_note():
    with pytest.raises(ValueError, match="decode failed") as caught:
        try:
            ocjax.load("Pong").decode(None)
        except AttributeError as error:
            raise ValueError("decode failed") from error
    concerned.add_categories(caught.value)
    assert caught.value.__notes__ == ["This concerns Player."]


def test_errors_elsewhere_get_no_note():
    with pytest.raises(ZeroDivisionError) as caught:
        _ = 1 / 0
    concerned.add_categories(caught.value)
    assert not hasattr(caught.value, "__notes__")
