import dataclasses

import numpy as np
import pytest

from ocjax import evaluation
from ocjax.objects import Objects


def objects(boxes):
    """[frames][slots] boxes or None."""
    xywh = np.array([[b or (0, 0, 0, 0) for b in frame] for frame in boxes], np.int16)
    valid = np.array([[b is not None for b in frame] for frame in boxes])
    return Objects(xywh, valid, *(np.zeros(valid.shape, int) for _ in range(2)), np.zeros((*valid.shape, 3)))


def greedy(left, right, category, radius):
    """The plain way, one frame and one pair at a time."""
    out = np.full(left.valid.shape, -1)
    for b in range(len(out)):
        pairs = []
        for i in np.flatnonzero(left.valid[b]):
            for j in np.flatnonzero(right.valid[b]):
                a, c = left.xywh[b, i].astype(np.float32), right.xywh[b, j].astype(np.float32)
                d = np.hypot(*(a[:2] + a[2:] / 2 - c[:2] - c[2:] / 2))
                if category[i] == category[j] and d <= radius:
                    pairs.append((d, i, j))
        used_i, used_j = set(), set()
        for _, i, j in sorted(pairs):
            if i not in used_i and j not in used_j:
                used_i.add(i)
                used_j.add(j)
                out[b, i] = j
    return out


@pytest.mark.parametrize("seed", range(5))
def test_match_is_greedy(seed):
    rng = np.random.default_rng(seed)
    category = np.repeat([0, 1, 2], [6, 3, 1])

    def some():
        xywh = rng.integers([0, 0, 1, 1], [25, 25, 9, 9], (40, 10, 4)).astype(np.int16)
        return dataclasses.replace(objects([[None] * 10] * 40), xywh=xywh, valid=rng.random((40, 10)) < 0.8)

    left, right = some(), some()
    assert np.array_equal(evaluation.match(left, right, category), greedy(left, right, category, 5.0))


def test_iou():
    a, b = np.array([0, 0, 4, 4]), np.array([[0, 0, 4, 4], [2, 0, 4, 4], [9, 9, 1, 1], [0, 0, 0, 0]])
    assert evaluation.iou(a, b).tolist() == [1, 8 / 24, 0, 0]
    assert evaluation.iou(b[3], b[3]) == 0


class OneCategory:
    slot_category = np.zeros(2, int)
    slices = {"A": slice(0, 2)}  # noqa: RUF012


def test_agreement():
    rem = objects([[(10, 10, 4, 4), (50, 50, 4, 4)], [(10, 10, 4, 4), None]])
    vem = objects([[(10, 10, 4, 4), None], [(12, 10, 4, 4), (90, 90, 2, 2)]])
    before = objects([[None, (50, 51, 4, 4)], [None, None]])
    plain = evaluation.total(evaluation.agreement(OneCategory, rem, vem))
    assert (plain.left, plain.right, plain.confirmed, plain.found, plain.exact) == (3, 3, 2, 2, 1)
    assert plain.precision == plain.recall == plain.f1 == pytest.approx(2 / 3)
    assert plain.mean_iou == pytest.approx((1 + 8 / 24) / 2)
    aware = evaluation.total(evaluation.agreement(OneCategory, rem, vem, before))
    assert aware.precision == 1
    assert aware.recall == pytest.approx(2 / 3)


def test_nothing_to_match():
    empty = objects([[None, None]])
    a = evaluation.total(evaluation.agreement(OneCategory, empty, empty))
    assert all(np.isnan(v) for v in (a.precision, a.recall, a.f1, a.mean_iou))
