"""Digits, colours and files of games without a decoder."""

import dataclasses
import sys

import numpy as np
import pytest

import ocjax
from ocjax import extractors
from ocjax.console.fonts import DIGITS_3X5
from ocjax.console.rom_files import rom_path
from ocjax.extraction import names
from ocjax.ramtools import new, roms
from ocjax.ramtools.new import colors, fonts
from tests.support.command import run

DIGITS = np.array([[int(row, 16) for row in word] for word in DIGITS_3X5], np.uint8)


@pytest.mark.parametrize("top_first", [False, True])
@pytest.mark.parametrize(("stride", "shift"), [(5, 0), (6, 1), (7, 5), (5, 4)])
def test_font_among_other_bytes(top_first, stride, shift):
    rng = np.random.default_rng(stride)
    rom = rng.integers(0, 256, 2048, np.uint8)
    cells = np.zeros((10, stride), np.uint8)
    cells[:, :5] = (DIGITS if top_first else DIGITS[:, ::-1]) << shift
    rom[700 : 700 + cells.size] = cells.ravel()
    (found,) = fonts.find(rom)
    assert dataclasses.astuple(dataclasses.replace(found, likeness=0)) == (
        700,
        5,
        stride,
        3,
        shift,
        top_first,
        0,
        False,
    )


def test_mirrored_fonts():
    """A ROM may hold the same digits twice, for parts of the playfield that are drawn backwards."""
    data = np.frombuffer(rom_path("breakout").read_bytes(), np.uint8)
    assert {font.offset: font.mirrored for font in fonts.find(data)} == {0x100: False, 0x200: True}


@pytest.mark.parametrize("seed", range(3))
def test_no_font_in_noise(seed):
    assert fonts.find(np.random.default_rng(seed).integers(0, 256, 4096, np.uint8)) == []


@pytest.mark.parametrize(
    ("rom", "text"),
    [
        ("kaboom", "ROM.font(0x728, rows=8)"),
        ("freeway", "ROM.font(0x700, rows=8)"),
        ("frogger", "ROM.font(0xF01, rows=7, stride=8, top_first=True)"),
        ("bowling", "ROM.font(0x734, rows=5, dots=3, shift=1, top_first=True)"),
    ],
)
def test_fonts_of_games(rom, text):
    found = fonts.find(np.frombuffer(rom_path(rom).read_bytes(), np.uint8))
    assert [str(font) for font in found] == [text]


@pytest.fixture(scope="module")
def screens():
    """A wide floor, two balls of one colour that move, and a figure of two colours."""
    out = np.zeros((20, 210, 160), np.uint8)
    out[:, 200:] = 12
    for i, screen in enumerate(out):
        screen[50:54, 10 + i : 12 + i] = 20
        screen[70:74, 40:42] = 20
        screen[100:108, 60:66] = 30
        screen[108:110, 62:70] = 40
    return out


def test_survey(screens):
    found = {color.index: color for color in colors.survey(screens)}
    assert list(found) == [0, 12, 20, 30, 40]
    assert found[0].is_scenery
    assert found[12].is_scenery
    ball = found[20]
    assert (ball.seen, ball.most, ball.w, ball.h, ball.usual) == (1, 2, (2, 2), (4, 4), ((2, 4),))
    assert ball.area == (10, 50, 42, 74)
    assert ball.places == 21
    (figure,) = colors.mixed(screens, found.values())
    assert (figure.colors, figure.count, figure.size) == ((30, 40), 1, (10, 10))


def test_source_is_a_game(screens):
    """The library accepts the file for every combination of facts."""
    found = tuple(colors.survey(screens))
    facts = new.NewGame("Kaboom", "kaboom", "0" * 32, 210, False, (0,), (0, 1), 20, (), found, ())
    font = fonts.FoundFont(0x74B, 5, 8, 3, 5, True, 0.5, False)
    backwards = dataclasses.replace(font, mirrored=True)
    mixed = (colors.Mixed((30, 40), 1.0, (10, 10)),)
    real = facts._replace(md5="5428cdfada281c569c74c7308c7f2c26", fonts=(font, backwards))
    for given in (facts, real._replace(mixed=mixed, height=250, pal=True)):
        text = new.source(given)
        assert max(map(len, text.splitlines())) <= 100
        module = {"__name__": "kaboom"}
        exec(text, module)
        game = module["GAME"]
        assert (game.name, game.screen, game.pal) == ("Kaboom", (given.height, 160), given.pal)
        assert [c.name for c in game.categories] == ["Color20", "Color30", "Color40"]
        assert [c.count for c in game.categories] == [2, 1, 1]
    assert "FONT_2 = ROM.font(0x74B, rows=5, stride=8, dots=3, shift=5, top_first=True)" in text
    assert "# 30, 40: 1.0 per frame, mostly 10 x 10" in text
    assert text.count("# Mirror images") == 1
    assert f"{new.MIRRORED}FONT_2 = " in text
    lines = text.splitlines()
    assert [line.split(":")[0].strip() for line in lines if "touches" in line] == [
        "# It touches 40",
        "# It touches 30",
    ]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A further folder of games."""
    monkeypatch.setattr(extractors, "__path__", [*extractors.__path__, str(tmp_path)])
    for cached in (names.modules, names.games):
        cached.cache_clear()
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]
    for cached in (names.modules, names.games):
        cached.cache_clear()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["LaserGates", "LostLuggage", "Othello"])
def test_new_game_runs(name, folder):
    """Its file loads by name, finds objects in frames, and has an empty decoder."""
    result = run("ram", "new", name, "--frames", 20, "--out", folder / f"{name.lower()}.py")
    assert result.exit_code == 0, result.output
    names.modules.cache_clear()
    game = ocjax.load(name)
    moments = roms.moments(roms.find(name), 8, 50, 1)
    frames = np.stack([ale.getScreen() for ale in moments])
    assert np.asarray(game.vem(frames).valid).any(axis=0).sum() >= 10
    assert not np.asarray(game.rem(np.zeros((2, 128), np.uint8)).valid).any()


def test_wrong_use(tmp_path):
    taken = tmp_path / "taken.py"
    taken.touch()
    for args, message in (
        (("Othelo",), "no game 'Othelo': did you mean othello"),
        (("Pong",), "pong.py exists: give another output"),
        (("Adventure",), "adventure exists: give another output"),
        (("Othello", "--out", taken), "taken.py exists"),
        (("Othello", "--out", tmp_path / "no" / "othello.py"), "no folder"),
    ):
        result = run("ram", "new", *args)
        assert result.exit_code == 2, result.output
        assert message in " ".join(result.output.split())
    assert taken.read_bytes() == b""
