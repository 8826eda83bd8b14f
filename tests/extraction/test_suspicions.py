"""Warnings about frames that are not the emulator's frames of the game."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from tests.support.states import excerpt

pytestmark = pytest.mark.usefixtures("quick_compilation")


def warned(name, frames, transform=lambda f: f):
    """The messages of the warnings of two calls of a fresh game."""
    game = ocjax.load(name).without_hud()  # has made no call
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(2):
            transform(game.vem)(frames)
    return [str(w.message) for w in caught]


@pytest.fixture(scope="module")
def screens():
    return excerpt("Pong")["screens"]


def test_frames_of_the_game(screens):
    game = ocjax.load("Pong")
    assert warned("Pong", screens) == []
    assert warned("Pong", game.palette[screens]) == []


@pytest.mark.parametrize("name", ["AirRaid", "Pacman", "KeystoneKapers"])
def test_frames_of_pal_consoles(name):
    screens = excerpt(name)["screens"]
    assert warned(name, screens) == []
    assert warned(name, ocjax.load(name).palette[screens]) == []


def test_grey_frames(screens):
    grey = np.asarray(ocjax.load("Pong").palette[screens].mean(-1), np.uint8)
    messages = warned("Pong", grey)
    assert len(messages) >= 1
    assert "of the pixels have palette indices that the console does not draw" in messages[0]


def test_frames_with_other_colors(screens):
    frames = ocjax.load("Pong").palette[screens].copy()
    frames[:, 100] += 1
    assert [m.partition(" of the")[0] for m in warned("Pong", frames)] == ["Pong: 0.5%"]


def test_frames_of_another_game():
    frames = excerpt("Boxing")["screens"][:4] * 0 + 0x94
    assert warned("Pong", frames) == [
        "Pong: VEM found no objects. Are these frames of another game, or of a blank screen?"
    ]


def test_only_the_first_call_with_numpy_is_checked(screens):
    blank = np.zeros_like(screens)
    assert len(warned("Pong", blank)) == 1
    assert warned("Pong", jnp.asarray(blank)) == []
    assert warned("Pong", blank, jax.jit) == []
    assert warned("Pong", blank[:0]) == []


def test_numpy_frames_in_a_traced_function(screens):
    game = ocjax.load("Pong").without_hud()
    found = jax.jit(lambda x: game.vem(screens).x + x)(jnp.int16(0))
    assert (found == game.vem(jnp.asarray(screens)).x).all()
