"""Kinds: one table gives the boxes of REM and the categories of VEM."""

import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import box
from ocjax.extraction.categories import Category
from ocjax.extraction.kinds import KindEntry, Kinds
from ocjax.vision.rules import Blobs

ROCKS = Category("Rock", Blobs(20), count=3)
BIRDS = Category("Bird", Blobs(30), count=3)


def test_kinds():
    kinds = Kinds(KindEntry(ROCKS, range(2, 4)), KindEntry(BIRDS, (0, 7)))
    assert kinds.categories == (ROCKS, BIRDS)
    records = box(np.arange(4), 0, 1, 1, np.array([True, True, True, False]))
    boxes = kinds.split(records, jnp.array([3, 7, 4, 2]))
    assert list(boxes) == ["Rock", "Bird"]
    assert boxes["Rock"].valid.tolist() == [True, False, False, False]
    assert boxes["Bird"].valid.tolist() == [False, True, False, False]
