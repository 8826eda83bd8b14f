"""Every game against what the video chip drew and what the emulator says, on excerpts of recorded play."""

import jax
import numpy as np
import pytest

from ocjax import evaluation
from ocjax.spec import Bounds


@pytest.fixture(scope="session")
def seen(game, truth):
    host = lambda objects: jax.tree.map(np.asarray, objects)  # noqa: E731
    return host(game.rem(truth["rams"])), host(game.vem(truth["screens"])), host(game.vem(truth["previous"]))


def test_methods_agree(game, seen):
    rem, vem, before = seen
    by_category = evaluation.agreement(game, rem, vem, before)
    whole = evaluation.total(by_category)
    assert whole.f1 >= 0.99, {k: (round(100 * a.precision, 1), round(100 * a.recall, 1)) for k, a in by_category.items()}
    assert whole.mean_iou >= 0.95


def test_boxes_hold_drawn_pixels(game, truth, seen):
    """On the frame or the one before. What blinks for longer has a counterpart in VEM where it is drawn (test_methods_agree)."""
    rem = seen[0]
    steady = ~np.array([c.blinks for c in game.categories])[game.slot_category]
    held = []
    for xywh, valid, drawn in zip(rem.xywh.astype(int), rem.valid, truth["drawn"], strict=True):
        held += [drawn[y : y + h, x : x + w].any() for x, y, w, h in xywh[valid & steady]]
    assert np.mean(held) >= 0.99


def test_score_follows_rewards(game, truth, seen):
    for name in ("Score", "PlayerScore"):
        category = next((c for c in game.categories if c.name == name and c.count == 1 and "value" in c.attributes), None)
        if category is None:
            continue
        value = seen[0].value[:, game.slices[name]][:, 0]
        if "EnemyScore" in game.slices:  # the reward is the difference of the two
            value = value - seen[0].value[:, game.slices["EnemyScore"]][:, 0]
        assert (value == truth["rewards"]).mean() == 1


def test_lives_follow_the_emulator(game, truth, seen):
    for name in ("Lives", "Life", "Live"):
        category = next((c for c in game.categories if c.name == name and c.count == 1 and "value" in c.attributes), None)
        if category is not None:
            valid = seen[0].valid[:, game.slices[name]][:, 0]
            value = seen[0].value[:, game.slices[name]][:, 0]
            assert (value == truth["lives"])[valid].all()


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
