"""Comparison of other implementations of games with the real ROM."""

from typing import ClassVar

import ale_py
import jax
import numpy as np
import pytest

import ocjax
from ocjax.emulators.start import start_emulator
from ocjax.evaluation import parity
from ocjax.evaluation.parity import Frame

PONG = ocjax.load("Pong")


class Shifted:
    """A simulator that runs the real Pong, with the ball some pixels to the right."""

    name = "Shifted"
    fields: ClassVar = {"paddles": ("Player", "Enemy"), "ball": ("Ball",)}
    actions = ("NOOP", "RIGHT", "LEFT", "DOWN")

    def __init__(self, shift):
        self.shift, self.ale = shift, None

    def reset(self, seed):
        self.ale = start_emulator(PONG, seed)
        return self.frame(0.0)

    def step(self, action):
        return self.frame(self.ale.act(ale_py.Action[action]))

    def frame(self, reward):
        objects = jax.tree.map(np.asarray, PONG.rem(self.ale.getRAM()))
        boxes = {
            name: np.concatenate([objects.of(c).xywh[objects.of(c).valid] for c in of])
            for name, of in self.fields.items()
        }
        boxes["ball"] = boxes["ball"] + np.array((self.shift, 0, 0, 0))
        return Frame(boxes, reward, self.ale.game_over())


def test_the_same_game_does_not_differ():
    p = parity.compare(PONG, Shifted(0), seed=1, frames=80)
    found = parity.errors(p)
    assert len(p.real) == len(p.simulated) == len(p.screens) == 81
    assert (found.f1 == 1).all()
    assert (found.off == 0).all()
    assert found.first.tolist() == [-1, -1]
    assert np.array_equal(p.rewards[0], p.rewards[1])
    assert p.aligned == ("ball",)


def test_what_differs_is_measured():
    p = parity.compare(PONG, Shifted(3), seed=1, frames=80, align=False)
    found = parity.errors(p)
    assert p.aligned == ()
    assert found.off.tolist() == [[0, 0, 0, 0], [3, 0, 0, 0]]
    shown = (p.real.label == 1).any(axis=1)
    assert found.first.tolist() == [-1, int(shown.argmax())]
    (row,) = [row for row in parity.to_table([p, p]).rows if row[0] == "ball"]
    assert row[3:] == [100.0, "3.0", "0.0", "0.0", "0.0", f"{shown.argmax()}, {shown.argmax()}"]
    (picture,) = parity.pictures(p, [80], scale=1)
    assert picture.size[0] > 2 * 320


def test_wrong_use():
    with pytest.raises(ValueError, match="frames must be at least 1, got 0"):
        parity.compare(PONG, Shifted(0), frames=0)
    simulator = Shifted(0)
    simulator.actions = ("UPFIRE",)
    with pytest.raises(ValueError, match="Shifted and the real Pong have no action in common"):
        parity.compare(PONG, simulator)
