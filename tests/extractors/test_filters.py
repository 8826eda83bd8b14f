"""Filters and steps of single games."""

import jax
import numpy as np
import pytest

from ocjax.extraction.categories import Category
from ocjax.extraction.detection import detect
from ocjax.extractors.hero import without_dots
from ocjax.extractors.privateeye import AboveCar
from ocjax.extractors.tutankham import CUT_ROWS, VIEW, cut_off
from ocjax.vision.rules import Blobs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Tight

pytestmark = pytest.mark.usefixtures("quick_compilation")


def found(frame, *categories):
    """The boxes of each category."""
    out = jax.jit(lambda frames: detect(categories, frames))(frame[None])
    return [np.stack([f.x, f.y, f.w, f.h], -1)[np.asarray(f.valid)].tolist() for f in out]


def test_a_beam_beside_two_dots():
    rule = Blobs(14, None, Shape(w=(2, 31)), filters=(without_dots,))
    frame = np.zeros((210, 160), np.uint8)
    # The distances between dots and beam are equal.
    frame[20, 30:38] = frame[20, 28] = frame[20, 26] = 14
    # One of the dots touches the beam, across the edge of a word.
    frame[40, 60:68] = frame[40, 68] = frame[40, 70] = 14
    frame[60, 90:98] = frame[61, 91] = 14
    frame[80, 20] = frame[80, 22] = 14  # no beam
    boxes = found(frame, Category("Beam", rule, count=4))
    assert boxes == [[[30, 20, 8, 1], [60, 40, 8, 1], [90, 60, 8, 2]]]


def test_two_dots_alone():
    rule = Blobs(14, None, Shape(w=1, h=1), filters=(without_dots,))
    frame = np.zeros((210, 160), np.uint8)
    frame[20, 30] = frame[20, 32] = 14
    frame[40, 63] = frame[40, 66] = 14  # two blank pixels between them
    boxes = found(frame, Category("Dot", rule, count=4))
    assert boxes == [[[63, 40, 1, 1], [66, 40, 1, 1]]]


def test_objects_that_an_edge_cuts_off():
    end = VIEW[3]
    rule = Blobs(14, VIEW, Shape(w=(1, 8), h=(1, CUT_ROWS)), gap=(1, 0), filters=(cut_off,))
    frame = np.zeros((210, 160), np.uint8)
    frame[[end - 3, end - 2, end - 1], [30, 31, 32]] = 14
    frame[end - 2 : end + 3, 60:68] = 14  # continues below the edge
    frame[end - 5 : end - 1, 100:104] = 14  # ends above the last row
    frame[end - 12 : end, 31] = 14  # higher than an object
    boxes = found(frame, Category("Creature", rule, count=3))
    assert boxes == [[[30, end - 6, 3, 6], [60, end - 2, 8, 2]]]


def test_a_driver_above_a_car():
    frame = np.zeros((210, 160), np.uint8)
    frame[40:50, 30:50] = 20
    frame[32:42, 34:38] = 30  # the driver, in front of a part of the car
    car = Category("Car", Blobs(20, None, Shape(w=(9, 31), h=(9, 32))))
    for steps, driver in (((), [30, 32, 20, 18]), ((AboveCar(), Tight()), [34, 32, 4, 8])):
        rule = Blobs((20, 30), None, Shape(w=(1, 20), h=(1, 18)), first=30, then=steps)
        boxes = found(frame, Category("Driver", rule, count=2), car)
        assert boxes == [[driver], [[30, 40, 20, 10]]]
