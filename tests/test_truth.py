"""Every game against what the video chip drew and what the emulator says, on excerpts of recorded play."""

import dataclasses

import jax
import numpy as np
import pytest

from ocjax import evaluation
from ocjax.rules import Bounds


@pytest.fixture(scope="session")
def seen(game, truth):
    host = lambda objects: jax.tree.map(np.asarray, objects)  # noqa: E731
    return host(game.rem(truth["rams"])), host(game.vem(truth["screens"])), host(game.vem(truth["previous"]))


def test_methods_agree(game, seen):
    rem, vem, before = seen
    counts = evaluation.agreement(*map(evaluation.detections, (rem, vem, before)))
    whole, each = counts.sum(), counts.sum(axis=0)
    # What blinks is hidden for longer than the two frames that are compared.
    least = 0.98 if any(c.blinks for c in game.categories) else 0.99
    assert whole.f1 >= least, list(zip(game.slices, each.precision.round(3), each.recall.round(3), strict=True))
    assert whole.mean_iou >= 0.95


def test_boxes_hold_drawn_pixels(game, truth, seen):
    """On the frame or the one before. What blinks for longer has a counterpart in VEM where it is drawn (test_methods_agree)."""
    steady = ~np.array([c.blinks for c in game.categories])[game.slot_category]
    boxes = evaluation.detections(dataclasses.replace(seen[0], valid=seen[0].valid & steady))
    assert evaluation.coverage(boxes, truth["drawn"], truth["drawn"])[1] >= 0.99


def test_score_and_lives_follow_the_emulator(truth, seen):
    shares = evaluation.value_shares(seen[0], truth["rewards"], truth["lives"])
    assert all(share == 1 for share in shares.values() if share == share), shares  # nan: never shown


def test_vem_reads_what_is_shown(game, seen):
    """Where a rule reads digits or a gauge, it reads REM's value, but on the few frames on which the display lags behind the RAM."""
    rem, vem, _ = seen
    for c in game.categories:
        if isinstance(c.rule, Bounds) and c.rule.value is not None:
            s = game.slices[c.name]
            both = rem.valid[:, s] & vem.valid[:, s]
            lag = np.abs(rem.value[:, s] - vem.value[:, s])[both]
            if len(lag) > 5:
                assert (lag <= 2).mean() >= 0.95  # two hundredths of a second are one frame of a clock
