"""Contract tests for every game. Tests of the framework alone are in tests/extraction."""

import inspect

import jax
import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax._xla import batches
from ocjax.console import palette, rom_files
from ocjax.vision.rules import ByColor
from tests.support.checks import check, host, random_frames, same
from tests.support.record.deciding import BATCH, in_batches
from tests.support.states import ROOT

GREY_HUES = {0x0, 0x1, 0xE, 0xF}  # of PAL consoles


def unoptimized_jit(f):
    """`jax.jit` without optimization of the machine code: it compiles in a third of the time and
    computes the same."""
    return jax.jit(
        f,
        compiler_options=(batches.compiler_options() or {}) | {"xla_backend_optimization_level": 0},
    )


def test_declaration(game):
    for name in (game.name.lower(), f"ALE/{game.name}-v5", f"{game.name}NoFrameskip-v4"):
        assert ocjax.load(name) is game
    assert rom_files.read_rom(game.rom, game.md5), (
        "ale-py has the ROM that the decoder was written for"
    )
    names = [c.name for c in game.categories]
    assert len(set(names)) == len(names)
    assert names == sorted(names, key=lambda name: game.categories[names.index(name)].hud), (
        "the display's categories are last"
    )
    ends = np.cumsum([c.count for c in game.categories]).tolist()
    assert [(game.slices[name].start, game.slices[name].stop) for name in names] == list(
        zip([0, *ends[:-1]], ends, strict=True)
    )
    assert all(c.doc for c in game.categories), "every category has a line for people"


def test_colors_of_rules_are_even(game):
    """All colours on a screen are even, except the stand-ins for colours of levels.

    An odd index shows as the even one below it, so that a slip would go unnoticed.
    """
    stand_ins = () if game.shades is None else game.shades.levels[0]
    allowed = {color for color in stand_ins if color % 2}
    odd = {c.name: {color for color in colors_of_rules(c) if color % 2} for c in game.categories}
    assert {name: colors for name, colors in odd.items() if colors - allowed} == {}
    assert set().union(*odd.values()) == allowed


def colors_of_rules(category):
    """The colours that a category's rules look for, and those that its gauges measure."""
    rules = [rule for rule in (category.rule, category.otherwise) if rule is not None]
    for rule in rules:
        for part in getattr(rule, "parts", (rule,)):
            yield from part.palette
        for search in (getattr(f, "search", None) for f in getattr(rule, "filters", ())):
            yield from getattr(search, "colors", ())
    if isinstance(category.value, ByColor):
        yield from (color for color, _ in category.value.values)


def test_truth_is_well_formed(game, truth):
    rem, vem = in_batches(game.rem, truth["rams"]), in_batches(game.vem, truth["screens"])
    check(game, rem, (len(truth["rams"]),))
    assert (rem.orientation >= 0).all()
    check(game, vem, (len(truth["screens"]),))


def test_random_ram(game, fuzz):
    rng = np.random.default_rng(0)
    for _ in range(0, fuzz, BATCH):
        check(game, game.rem(rng.integers(0, 256, (BATCH, 128), dtype=np.uint8)), (BATCH,))


def test_random_frames(game, fuzz):
    rng = np.random.default_rng(0)
    for _ in range(0, fuzz, BATCH):
        check(game, game.vem(random_frames(game, rng, BATCH)), (BATCH,))


def arbitrary_frames(game, rng):
    """Frames of one colour, checkerboards, and noise, in palette indices uint8 `[n, H, 160]`."""
    height, width = game.screen
    y, x = np.indices((height, width))
    plain = [np.full((height, width), color) for color in range(0, 256, 2)]
    boards = [
        rng.choice(256, 2)[(x // size + y // size) % 2]
        for size in (4, 8, 16, 32)
        for _ in range(15)
    ]
    noise = [
        rng.choice(colors, (height, width))
        for colors in (np.arange(256), np.array(game.colors))
        for _ in range(2)
    ]
    return np.array([*plain, *boards, *noise], np.uint8)


def test_rgb_is_as_good_as_indices(game):
    """PAL consoles show several palette indices as the same grey; RGB maps such a grey to one of
    them."""
    shown = np.asarray(palette.to_index(game.palette, game.palette, game.colors))
    assert np.array_equal(game.palette[shown], game.palette)
    different = {color >> 4 for color in np.flatnonzero(shown != np.arange(256) & 0xFE)}
    assert different <= (GREY_HUES if game.pal else set())
    frames = shown[arbitrary_frames(game, np.random.default_rng(0))]
    assert same(in_batches(game.vem, frames), in_batches(game.vem, game.palette[frames]))


@pytest.mark.slow
def test_without_hud_is_a_prefix(game, truth):
    bare = ocjax.load(game.name, hud=False)
    assert not bare.slot_hud.any()
    for method, key in (("rem", "rams"), ("vem", "screens")):
        whole, part = (
            host(getattr(game, method)(truth[key])),
            host(unoptimized_jit(getattr(bare, method))(truth[key])),
        )
        assert same(jax.tree.map(lambda a: a[:, : bare.num_slots], whole), part)


def test_decode_is_pure(game):
    """A decoder has no effects, callbacks or random numbers."""
    jaxpr = jax.make_jaxpr(game.rem)(
        np.zeros((BATCH, 128), np.uint8)
    )  # as the other tests, so that it is traced once
    assert not jaxpr.effects
    text = str(jaxpr)
    assert not [word for word in ("callback", "random_bits", "float64", "io_") if word in text]


def test_tests_are_grouped(request):
    """pytest-xdist names a test's group in its ID; without groups, every process would compile
    every game."""
    assert ("@" in request.node.nodeid) == getattr(request.config.option, "loadgroup", False)


def test_the_docstring_names_a_picture(game):
    name = f"docs/games/{game.name}.png"
    assert f"\n\nPicture: {name}\n\n" in inspect.getdoc(inspect.getmodule(game.decode)) + "\n\n"
    margin, width, height = 4, 2 * 2 * 160, 2 * game.screen[0]
    with Image.open(ROOT / name) as picture:  # boxes beside pixels
        assert picture.size == (2 * width + 3 * margin, height + 2 * margin)
