import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ocjax
from ocjax.evaluation import matching, metrics
from ocjax.evaluation.metrics import Agreement, Detections
from tests.support.states import excerpt


def detections(boxes, label=None, categories=("A",), score=None):
    """Detections from one list of boxes per frame; an empty place is None."""
    xywh = np.array([[b or (0, 0, 0, 0) for b in frame] for frame in boxes], float).reshape(
        len(boxes), -1, 4
    )
    there = np.array([[b is not None for b in frame] for frame in boxes]).reshape(len(boxes), -1)
    return Detections(xywh, np.where(there, 0 if label is None else label, -1), categories, score)


def greedy(left, right, radius):
    """Greedy matching in plain Python, one frame and one pair at a time."""
    out = np.full(left.label.shape, -1)
    for b in range(len(out)):
        pairs = []
        for i in np.flatnonzero(left.label[b] >= 0):
            for j in np.flatnonzero(right.label[b] >= 0):
                a, c = left.xywh[b, i].astype(np.float32), right.xywh[b, j].astype(np.float32)
                d = np.hypot(*(a[:2] + a[2:] / 2 - c[:2] - c[2:] / 2))
                if left.label[b, i] == right.label[b, j] and d <= radius:
                    pairs.append((d, i, j))
        used_i, used_j = set(), set()
        for _, i, j in sorted(pairs):
            if i not in used_i and j not in used_j:
                used_i.add(i)
                used_j.add(j)
                out[b, i] = j
    return out


def some(rng, frames=40, boxes=10, categories=3):
    xywh = rng.integers([0, 0, 1, 1], [25, 25, 9, 9], (frames, boxes, 4))
    return Detections(
        xywh, rng.integers(-1, categories, (frames, boxes)), tuple("ABC"[:categories])
    )


@pytest.mark.parametrize("seed", range(5))
def test_match_is_greedy(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    left, right = some(rng), some(rng, boxes=13)
    assert np.array_equal(matching.match(left, right), greedy(left, right, 5.0))
    monkeypatch.setattr(matching, "PAIRS_AT_ONCE", 100)  # frame by frame
    assert np.array_equal(matching.match(left, right), greedy(left, right, 5.0))


def test_labels_are_matched_by_name():
    left = detections([[(0, 0, 2, 2), (9, 9, 2, 2)]], [[0, 1]], ("A", "B"))
    right = detections([[(9, 9, 2, 2), (0, 0, 2, 2)]], [[0, 1]], ("B", "C"))
    assert matching.match(left, right).tolist() == [[-1, 0]]


def test_iou():
    a, b = (
        np.array([0, 0, 4, 4]),
        np.array([[0, 0, 4, 4], [2, 0, 4, 4], [9, 9, 1, 1], [0, 0, 0, 0]]),
    )
    assert matching.iou(a, b).tolist() == [1, 8 / 24, 0, 0]
    assert matching.iou(b[3], b[3]) == 0


def test_agreement():
    rem = detections([[(10, 10, 4, 4), (50, 50, 4, 4)], [(10, 10, 4, 4), None]])
    vem = detections([[(10, 10, 4, 4), None], [(12, 10, 4, 4), (90, 90, 2, 2)]])
    before = detections([[None, (50, 51, 4, 4)], [None, None]])
    counts = metrics.agreement(rem, vem)
    assert counts.left.tolist() == [[2], [1]]
    plain = counts.sum()
    assert (plain.left, plain.right, plain.confirmed, plain.found, plain.exact) == (3, 3, 2, 2, 1)
    assert plain.precision == plain.recall == plain.f1 == pytest.approx(2 / 3)
    assert plain.mean_iou == pytest.approx((1 + 8 / 24) / 2)
    aware = metrics.agreement(rem, vem, before).sum()
    assert aware.precision == 1
    assert aware.recall == pytest.approx(2 / 3)


def test_nothing_to_match():
    a = metrics.agreement(detections([[None, None]]), detections([[]])).sum()
    assert all(np.isnan(v) for v in (a.precision, a.recall, a.f1, a.mean_iou))
    nothing_right = Agreement(*(np.array(v) for v in (3, 3, 0, 0, 0, 0)))
    assert nothing_right.f1 == 0


def test_f1_of_a_category_that_one_method_does_not_find():
    """The F1 is 0 and enters the mean over categories; a category without any detection does not
    count."""
    box, names = (10, 10, 4, 4), ("A", "B", "C", "D")
    rem, vem = (
        Detections(np.array([[box] * 2]), np.array([labels]), names) for labels in ([0, 1], [0, 2])
    )
    for one, other, lacking in ((rem, vem, "precision"), (vem, rem, "recall")):
        counts = metrics.agreement(one, other).sum(axis=0)
        np.testing.assert_array_equal(counts.f1, [1, 0, 0, np.nan])
        assert np.nanmean(counts.f1) == pytest.approx(1 / 3)
        assert np.isnan(getattr(counts, lacking)).sum() == 2
    everything = metrics.agreement(rem, vem).sum()
    assert everything.f1 == pytest.approx(
        2 * everything.precision * everything.recall / (everything.precision + everything.recall)
    )


@given(st.lists(st.integers(0, 9), min_size=4, max_size=4))
def test_f1_is_a_harmonic_mean(numbers):
    left, right, confirmed, found = map(np.array, numbers)
    counts = Agreement(
        left, right, np.minimum(confirmed, left), np.minimum(found, right), found * 0, found * 0
    )
    if left and right and counts.precision and counts.recall:
        assert counts.f1 == pytest.approx(2 / (1 / counts.precision + 1 / counts.recall))
    else:
        assert np.isnan(counts.f1) if not (left or right) else counts.f1 == 0


def test_intervals_are_over_episodes():
    """Every episode is entirely right or entirely wrong, so the interval equals the interval of 40
    coin tosses, for any number of frames."""
    episode = np.repeat(np.arange(40), 25)
    right = (episode % 2 == 0).astype(float)[:, None]
    counts = Agreement(np.ones((1000, 1)), np.ones((1000, 1)), right, right, right, right)
    low, high = (v[0] for v in metrics.intervals(counts, episode, lambda a: a.f1))
    assert low == pytest.approx(0.5 - 1.96 * 0.5 / 40**0.5, abs=0.03)
    assert high == pytest.approx(0.5 + 1.96 * 0.5 / 40**0.5, abs=0.03)
    assert all(
        np.isnan(v).all() for v in metrics.intervals(counts, np.zeros(1000, int), lambda a: a.f1)
    )


def test_average_precision():
    """There are three objects; 0.9 hits, 0.8 misses and 0.7 hits: precision is 1 up to recall 1/3,
    2/3 up to recall 2/3, then 0."""
    truth = detections([[(0, 0, 4, 4), (20, 0, 4, 4), (40, 0, 4, 4)]])
    mine = detections(
        [[(60, 0, 4, 4), (20, 0, 4, 4), (0, 0, 4, 4)]], score=np.array([[0.8, 0.7, 0.9]])
    )
    (found,) = metrics.average_precision(mine, truth, [0.5])
    assert found == pytest.approx((34 + 33 * 2 / 3) / 101)
    level = dataclasses.replace(
        mine, score=None
    )  # all boxes enter together: precision 2/3 up to recall 2/3
    assert metrics.average_precision(level, truth, [0.5]) == pytest.approx(67 * 2 / 3 / 101)
    assert metrics.average_precision(truth, truth).tolist() == [[1] * 10]
    nothing = detections([[None]], categories=("A", "B"))
    assert (
        metrics.average_precision(nothing, dataclasses.replace(truth, categories=("A", "B")))[
            0
        ].tolist()
        == [0] * 10
    )
    assert np.isnan(metrics.average_precision(truth, nothing)).all()


def test_average_precision_takes_each_object_once():
    truth = detections([[(0, 0, 10, 10), None]])
    mine = detections([[(0, 0, 10, 10), (0, 0, 10, 8)]], score=np.array([[0.5, 0.9]]))
    half, most = metrics.average_precision(mine, truth, [0.5, 0.9])[0]
    assert half == pytest.approx(1)  # the second box is a false detection, after full recall
    assert most == pytest.approx(0.5)


def test_records():
    game = ocjax.load("Pong")
    d = matching.from_records(
        [[("Ball", 1, 2, 3, 4)], [("Ghost", 5, 6, 7, 8), ("Player", 0, 0, 1, 1)]], game
    )
    assert d.categories == (*(c.name for c in game.categories), "Ghost")
    assert [[d.categories[k] for k in row if k >= 0] for row in d.label] == [
        ["Ball"],
        ["Ghost", "Player"],
    ]
    assert d.xywh[1, 0].tolist() == [5, 6, 7, 8]
    assert matching.from_records([[("Ball", 1, 2, 3, 4, 0.25)]], game).score.tolist() == [[0.25]]


@pytest.mark.parametrize(
    "record",
    [
        (),
        ("Ball", 1, 2, 3),
        ("Ball", 1, 2, 3, 4, 0.5, 6),
        ("Ball", 1, 2, 3, "4"),
        ("Ball", 1, 2, 3, None),
        ("Ball", 1, 2, 3, [4]),
        ("Ball", 1, 2, 3, 4j),
        ("Ball", 1, float("nan"), 3, 4),
        ("Ball", 1, 2, float("inf"), 4),
        ("Ball", 1, 2, -3, 4),
        ("Ball", 10**400, 2, 3, 4),
        ("Ball", 1, 2, 3, 4, float("nan")),
        (7, 1, 2, 3, 4),
        (None, 1, 2, 3, 4),
        ("Ball", (1, 2, 3, 4)),
        {"category": "Ball", "x": 1, "y": 2, "w": 3, "h": 4},
        "Ball1",
        5,
        None,
    ],
)
def test_malformed_records(record):
    good = ("Ball", 1, 2, 3, 4)
    with pytest.raises(
        ValueError, match=r"^frame 1, record 2 must be \(category, x, y, w, h\) or "
    ):
        matching.from_records([[good], [good, list(good), record]], ocjax.load("Pong"))


@pytest.mark.parametrize("frame", [None, 5, "Ball"])
def test_malformed_frames(frame):
    with pytest.raises(ValueError, match=r"^frame 1 must be a list of records, got "):
        matching.from_records([[], frame], ocjax.load("Pong"))


def test_detections_of_objects():
    game, data = ocjax.load("Pong"), excerpt("Pong")
    objects = game.rem(data["rams"])
    d = matching.detections(objects)
    assert np.array_equal(d.label >= 0, np.asarray(objects.valid))
    assert np.array_equal(
        matching.match(d, d), np.where(d.label >= 0, np.arange(d.label.shape[1]), -1)
    )
    with pytest.raises(ValueError, match="have no reference to their game"):
        matching.detections(dataclasses.replace(objects, game=None))


def test_wrong_detections():
    good = detections([[(0, 0, 1, 1)]])
    for change, error, message in (
        ({"xywh": np.zeros((1, 1, 3))}, ValueError, "xywh must have shape"),
        ({"label": np.zeros((2, 1), int)}, ValueError, "label must have shape"),
        ({"label": np.zeros((1, 1))}, TypeError, "label must be integers"),
        ({"label": np.ones((1, 1), int)}, ValueError, "label must be -1 to 0"),
        ({"score": np.ones((1, 2))}, ValueError, "score must have shape"),
    ):
        with pytest.raises(error, match=message):
            dataclasses.replace(good, **change)
    with pytest.raises(ValueError, match="same frames"):
        matching.match(good, detections([[None], [None]]))


def test_coverage():
    sprites = np.zeros((1, 210, 160), bool)
    sprites[0, 10:14, 10:14] = True  # 16 pixels, half of them in a box
    drawn = sprites.copy()
    drawn[0, 50, 50] = True
    boxes = detections([[(10, 10, 2, 4), (9, 10, 3, 4), (50, 50, 1, 1), (100, 100, 9, 9)]])
    assert metrics.coverage(boxes, sprites, drawn) == (0.5, 0.75)


def test_identity_switches():
    """Two cars swap their slots in REM once."""
    game = ocjax.load("Freeway")
    car = game.slices["Car"].start
    xywh = np.zeros((6, game.num_slots, 4), np.int16)
    valid = np.zeros((6, game.num_slots), bool)
    valid[:, car : car + 2] = True
    xywh[:, car] = [[20 + t, 27, 8, 10] for t in range(6)]
    xywh[:, car + 1] = [[90 + t, 27, 8, 10] for t in range(6)]
    still = game.rem(np.zeros((6, 128), np.uint8))
    vem = dataclasses.replace(still, xywh=xywh, valid=valid)
    swapped = xywh.copy()
    swapped[3:, [car, car + 1]] = xywh[3:, [car + 1, car]]
    rem = dataclasses.replace(vem, xywh=swapped)
    resets = np.zeros(6, bool)
    for objects, starts, want in (
        (vem, resets, (0, 10)),
        (rem, resets, (2, 10)),
        (rem, np.arange(6) == 3, (0, 8)),
    ):
        moved, on = metrics.identity_switches(objects, vem, starts)
        index = [c.name for c in game.categories].index("Car")
        assert (moved[index], on[index], moved.sum()) == (*want, want[0])


def test_value_shares():
    data = excerpt("SpaceInvaders")
    objects = ocjax.load("SpaceInvaders").rem(data["rams"])
    assert metrics.value_shares(objects, data["rewards"], data["lives"]) == {
        "P1Score": 1.0,
        "Lives": 1.0,
    }
    wrong = metrics.value_shares(
        objects, data["rewards"] + (np.arange(len(data["rewards"])) % 2), data["lives"]
    )
    assert wrong["P1Score"] == pytest.approx(0.5, abs=0.05)


def test_of_several_scores_the_first_is_the_agents():
    game = ocjax.load("Freeway")
    objects = game.rem(excerpt("Freeway")["rams"])
    first = np.asarray(objects.value)[:, game.slices["Score"].start]
    none = np.zeros(len(first))
    assert metrics.value_shares(objects, first, none)["Score"] == 1
    assert metrics.value_shares(objects, first + 1, none)["Score"] == 0


def test_an_opponents_score_is_subtracted():
    game = ocjax.load("FishingDerby")
    objects = game.rem(excerpt("FishingDerby")["rams"])
    own, other = (
        np.asarray(objects.value)[:, game.slices[name].start]
        for name in ("ScorePlayerOne", "ScorePlayerTwo")
    )
    shares = metrics.value_shares(objects, own - other, np.zeros(len(own)))
    assert shares == {"ScorePlayerOne": 1}


def test_average_precision_is_that_of_pycocotools():
    """Random boxes with distinct confidences; some hit. pycocotools ranks equal confidences in
    input order."""
    coco = pytest.importorskip("pycocotools.coco")
    cocoeval = pytest.importorskip("pycocotools.cocoeval")
    rng = np.random.default_rng(5)
    frames, boxes, names = 40, 12, ("A", "B", "C")
    true_boxes = np.concatenate(
        [rng.uniform(0, 140, (frames, boxes, 2)), rng.uniform(4, 20, (frames, boxes, 2))], axis=2
    )
    label = rng.integers(-1, 3, (frames, boxes))
    truth = Detections(true_boxes, label, names)
    found_label = np.where(rng.random(label.shape) < 0.8, label, rng.integers(-1, 3, label.shape))
    score = rng.permutation(label.size).reshape(label.shape) / label.size
    mine = Detections(true_boxes + rng.normal(0, 1.5, true_boxes.shape), found_label, names, score)

    def annotations(d):
        for number, (i, k) in enumerate(np.argwhere(d.label >= 0), 1):
            x, y, w, h = d.xywh[i, k].tolist()
            one = {
                "id": number,
                "image_id": int(i) + 1,
                "category_id": int(d.label[i, k]) + 1,
                "bbox": [x, y, w, h],
                "area": w * h,
            }
            yield one | ({"iscrowd": 0} if d.score is None else {"score": float(d.score[i, k])})

    known = coco.COCO()
    images = [{"id": i + 1} for i in range(frames)]
    categories = [{"id": i + 1, "name": name} for i, name in enumerate(names)]
    known.dataset = {
        "info": {},
        "images": images,
        "categories": categories,
        "annotations": list(annotations(truth)),
    }
    known.createIndex()
    run = cocoeval.COCOeval(known, known.loadRes(list(annotations(mine))), "bbox")
    run.params.maxDets = [1, 10, 1000]
    run.evaluate()
    run.accumulate()
    expected = run.eval["precision"][:, :, :, 0, -1].mean(axis=1).T
    assert 0.05 < expected.mean() < 0.95
    assert np.allclose(metrics.average_precision(mine, truth), expected, atol=1e-12)


def test_reprs_are_short():
    left = detections([[(0, 0, 2, 4), None], [None, None]])
    right = detections([[(0, 0, 2, 4), None], [(90, 90, 4, 4), None]])
    assert repr(right) == "Detections of 2 boxes in 2 frames"
    counts = metrics.agreement(left, right)
    assert repr(counts) == "Agreement of 1 and 2 objects, shape [2, 1]: F1 0.667"
    assert repr(counts.sum()) == "Agreement of 1 and 2 objects, shape []: F1 0.667"
