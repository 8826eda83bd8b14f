"""Every game against the screen and the emulator's lives and rewards, on excerpts of recorded
play."""

import collections
import dataclasses
import warnings

import numpy as np
import pytest

from ocjax import recordings
from ocjax.evaluation import matching, metrics
from ocjax.extraction import suspicions
from ocjax.extraction.checks import LivesAsIcons
from ocjax.vision.unknown import UNKNOWN_VALUE
from tests.support.record.deciding import in_batches
from tests.support.states import DATA

ON_DRAWN = 0.99  # share of boxes that hold drawn pixels
IN_COLOR = 0.97  # share of boxes that hold pixels of their objects' colours
ON_DETECTED = 0.98  # share of boxes on VEM's detections, which lack partly covered objects
AGREEMENT = {"samples": 0.99, "modes": 0.97, "first": 0.97, "last": 0.97, "lost": 0.97}
BLINKING = 0.98  # of samples, if objects are hidden for longer than the two compared frames
KNOWN = 0.9  # share of VEM's boxes of a category with known values
MIRRORED = 0.01  # share of pictures with the same orientation as their mirror images
UPRIGHT = 0, 8  # orientations that are their own mirror images


def least_f1(game, excerpt):
    """The least F1 of the methods on an excerpt."""
    blinks = excerpt == "samples" and any(c.blinks for c in game.categories)
    return game.checks.agreement.get(excerpt, BLINKING if blinks else AGREEMENT[excerpt])


@pytest.fixture(scope="session")
def detected(game, truth):
    """REM's objects, VEM's, and VEM's on the frame before."""
    sources = (game.rem, truth["rams"]), (game.vem, truth["screens"]), (game.vem, truth["previous"])
    return tuple(in_batches(extract, x) for extract, x in sources)


def steady(game, objects):
    """The objects of categories that are drawn at least on every other frame."""
    blinks = np.array([c.blinks for c in game.categories])[game.slot_category]
    return dataclasses.replace(objects, valid=objects.valid & ~blinks)


def share_on_detections(rem, *vem):
    """Share of REM's boxes that overlap a box of their category in any of VEM's detections."""
    there = rem.label >= 0
    held = np.logical_or.reduce([overlaps(rem, v) for v in vem]) & there
    return np.count_nonzero(held) / np.count_nonzero(there) if there.any() else 1.0


def overlaps(boxes, others):
    """Which boxes have a pixel in common with another one of their category, bool `[n, slots]`."""
    x, y, w, h = np.moveaxis(boxes.xywh[:, :, None].astype(int), -1, 0)
    left, top, width, height = np.moveaxis(others.xywh[:, None].astype(int), -1, 0)
    meet = (x < left + width) & (left < x + w) & (y < top + height) & (top < y + h)
    return (meet & (boxes.label[:, :, None] == others.label[:, None])).any(axis=-1)


def test_methods_agree(game, detected):
    rem, vem, before = detected
    counts = metrics.agreement(*map(matching.detections, (rem, vem, before)))
    whole, each = counts.sum(), counts.sum(axis=0)
    assert whole.f1 >= least_f1(game, "samples"), list(
        zip(game.slices, each.precision.round(3), each.recall.round(3), strict=True)
    )
    assert whole.mean_iou >= 0.95


def test_boxes_hold_drawn_pixels(game, truth, detected):
    """Boxes hold drawn pixels of the frame or the one before. Without a record of drawn pixels, the
    test compares boxes with VEM's boxes on both frames.

    Objects that blink for longer have a counterpart in VEM on the frames that show them
    (`test_methods_agree`).
    """
    rem, vem, before = detected
    boxes = matching.detections(steady(game, rem))
    if "drawn" in truth:
        assert metrics.coverage(boxes, truth["drawn"], truth["drawn"])[1] >= ON_DRAWN
    else:
        assert (
            share_on_detections(boxes, matching.detections(vem), matching.detections(before))
            >= ON_DETECTED
        )


def test_colors_are_drawn(game, truth, detected):
    """The colours are on the frame or the one before, except for blinking objects and for black
    ones whose colour the RAM lacks."""
    objects = steady(game, detected[0])
    lacks = np.array([not c.ram_color for c in game.categories])[game.slot_category]
    assert not objects.rgb[:, lacks].any()
    objects = dataclasses.replace(objects, valid=objects.valid & ~lacks)
    frames = [game.palette[truth[name]] for name in ("screens", "previous")]
    drawn = []
    for n, k in zip(*np.nonzero(objects.valid), strict=True):
        x, y, w, h = objects.xywh[n, k]
        boxes = (frame[n, y : y + h, x : x + w] for frame in frames)
        drawn.append(any((pixels == objects.rgb[n, k]).all(axis=-1).any() for pixels in boxes))
    assert np.mean(drawn) >= IN_COLOR


def test_the_frames_give_no_warning(game, truth, detected):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        suspicions.warn_about_colors(truth["screens"], game)
        suspicions.warn_about_nothing(detected[1].valid[:, ~game.slot_hud], game)


def test_boxes_without_drawn_pixels_are_noticed(game, truth, detected):
    """The check that replaces drawn pixels passes on all recordings, and fails once boxes are moved
    off their objects."""
    rem, vem, before = detected
    boxes, *detections = map(matching.detections, (steady(game, rem), vem, before))
    assert share_on_detections(boxes, *detections) >= ON_DETECTED
    shares = []
    for shift in (
        (80, 60),
        (40, 100),
        (0, 90),
    ):  # one of them moves the boxes away from all objects of their category
        moved = (boxes.xywh + np.array([*shift, 0, 0])) % np.array([160, 200, 999, 999])
        shares.append(share_on_detections(dataclasses.replace(boxes, xywh=moved), *detections))
    assert min(shares) < game.checks.moved, shares


def test_score_and_lives_follow_the_emulator(game, truth, detected):
    shown = shows_score(game, detected[0])
    assert np.count_nonzero(~shown & (truth["rewards"] != 0)) == game.checks.unscored
    shares = metrics.value_shares(
        detected[0][shown], truth["rewards"][shown], truth["lives"][shown]
    )
    assert all(share == 1 for share in shares.values() if share == share), (
        shares
    )  # nan: never shown


def shows_score(game, rem):
    """The states whose screen shows a score, and all states of games without one, bool `[n]`."""
    scores = [c.name for c in game.categories if c.role == "score" and "value" in c.attributes]
    shown = [rem.valid[:, game.slices[name].start] for name in scores]
    return np.logical_or.reduce(shown) if shown else np.ones(len(rem.valid), bool)


def test_rewards_are_checked(game, truth, detected):
    """A category shows the sum of the rewards, or the game computes it from the objects."""
    scores = [c for c in game.categories if c.role == "score" and "value" in c.attributes]
    assert (game.checks.returns == "score") == bool(scores)
    if callable(game.checks.returns):
        displays = [c.name for c in game.categories if c.hud and "value" in c.attributes]
        np.testing.assert_array_equal(
            game.checks.returns(detected[0]), truth["rewards"], f"the return from {displays}"
        )


def test_other_categories_show_the_lives(game, truth, detected):
    """Objects that count as lives and numbers with other names show the lives, too."""
    for shown in game.checks.lives:
        wrong = icons_differ if isinstance(shown, LivesAsIcons) else numbers_differ
        assert np.count_nonzero(wrong(game, detected[0], shown, truth["lives"])) == shown.early


def icons_differ(game, rem, icons, lives):
    """The states in which the number of icons does not follow the lives."""
    shown = sum(rem.of(category).valid.sum(axis=1) for category in icons.categories)
    most = sum(c.count for c in game.categories if c.name in icons.categories)
    differs = shown != np.clip(lives - icons.hidden, 0, most)
    if not icons.between_lives:
        return differs
    assert (shown > 0).any()
    return differs & (shown > 0)


def numbers_differ(game, rem, number, lives):
    """The states in which a number does not follow the lives."""
    own, expected = rem.of(number.category), number.sign * lives[:, None] + number.offset
    return (own.value != expected) & own.valid


def test_lives_are_checked(game, truth):
    """The emulator counts lives in each of these games; in Surround it has a single one."""
    lives = [
        c for c in game.categories if c.role == "lives" and c.count == 1 and "value" in c.attributes
    ]
    assert bool(lives) + bool(game.checks.lives) == bool((truth["lives"] > 1).any())


def test_vem_reads_what_is_shown(game, detected):
    """A rule that reads digits or a gauge gives REM's value, except on the few frames with a
    display that lags behind the RAM.

    A value that VEM cannot read, such as the value of a full gauge, is unknown. This is rare, or
    has a stated reason.
    """
    rem, vem, _ = detected
    valued = [c for c in game.categories if "value" in c.attributes]
    never_known = {name for name, share in game.checks.known.items() if share == 0}
    assert {c.name for c in valued if not c.reads_value} == never_known
    for c in valued:
        known = (
            vem.value[:, game.slices[c.name]][vem.valid[:, game.slices[c.name]]] != UNKNOWN_VALUE
        )
        if c.reads_value and known.size:
            least = game.checks.known.get(c.name, KNOWN)
            assert known.mean() >= least, (c.name, known.mean())
            assert least == KNOWN or known.mean() < KNOWN, f"{c.name} needs no exception"
        if c.reads_value:
            wrong = np.abs(differences_of_values(rem.of(c), vem.of(c)))
            most = game.checks.value_error.get(c.name, 0)
            assert len(wrong) <= 5 or (wrong <= most).mean() >= 0.95, (
                c.name,
                (wrong <= most).mean(),
            )


def differences_of_values(rem, vem):
    """REM's values less VEM's known values.

    Categories with several slots compare slots with equal boxes, because VEM has another order.
    """
    one = rem.valid.shape[1] == 1
    pairs = one | (rem.xywh[:, :, None] == vem.xywh[:, None]).all(axis=-1)
    n, i, j = np.nonzero(
        pairs & rem.valid[:, :, None] & (vem.valid & (vem.value != UNKNOWN_VALUE))[:, None]
    )
    return rem.value[n, i] - vem.value[n, j]


def test_screen_savers(game):
    """The recordings show the screen saver, or a black screen: REM and VEM report the visible
    objects, in the colours of the saver."""
    path = DATA / "savers" / f"{game.name}.npz"
    if not path.exists():
        return
    tape = recordings.read(path, game.name)
    rem, vem, before = extracted(tape)
    alike = np.isin([c.name for c in game.categories], game.checks.saver_hides)[game.slot_category]
    rem = dataclasses.replace(rem, valid=rem.valid & ~alike)
    is_black = not np.any(tape.screens) and not np.any(tape.previous)
    assert (rem.valid.any() or vem.valid.any()) == (not is_black)
    if rem.valid.any():
        counts = metrics.agreement(*map(matching.detections, (rem, vem, before)))
        assert counts.sum().f1 >= 0.98
    both = rem.valid & vem.valid
    has_place = np.array([c.has_places for c in game.categories])[game.slot_category]
    assert np.array_equal(rem.rgb[both & has_place], vem.rgb[both & has_place])


def extracted(tape):
    """REM's objects, VEM's, and VEM's on the frame before."""
    sources = (
        (tape.game.rem, tape.rams),
        (tape.game.vem, tape.screens),
        (tape.game.vem, tape.previous),
    )
    return tuple(in_batches(extract, x) for extract, x in sources)


def agreement_on(tape):
    """Counts of objects and matches by sample and category."""
    return metrics.agreement(*map(matching.detections, extracted(tape)))


def test_rare_objects(game):
    path = DATA / "rare" / f"{game.name}.npz"
    assert path.exists() == bool(game.checks.rare)
    if path.exists():
        f1 = dict(
            zip(
                game.slices,
                agreement_on(recordings.read(path, game.name)).sum(axis=0).f1,
                strict=True,
            )
        )
        assert all(f1[category] >= 0.95 for category in game.checks.rare), f1


def test_states_of_all_modes(game):
    """The methods agree in unusual states, and score and lives are right."""
    tape = recordings.read(DATA / "modes" / f"{game.name}.npz", game.name)
    rem, vem, before = extracted(tape)
    counts = metrics.agreement(*map(matching.detections, (rem, vem, before)))
    by_category = dict(zip(game.slices, counts.sum(axis=0).f1, strict=True))
    assert counts.sum().f1 >= least_f1(game, "modes"), by_category
    alive = (tape.lives > 0) | (
        tape.lives.max() == 0
    )  # after the end, displays may show something else
    shares = metrics.value_shares(rem[alive], tape.rewards[alive], tape.lives[alive])
    wrong = {
        name: round((1 - share) * np.count_nonzero(alive))
        for name, share in shares.items()
        if share < 1
    }
    assert wrong == game.checks.miscounted


def facings(rem, vem, screens, slots):
    """The count of each picture under each orientation.

    Only objects with the same box in REM and VEM count, because nothing covers them.
    """
    seen = collections.defaultdict(collections.Counter)
    for n, k in np.argwhere(rem.valid[:, slots]):
        x, y, w, h = rem.xywh[n, slots][k].astype(int)
        if (vem.xywh[n, slots] == (x, y, w, h)).all(axis=-1).any():
            picture = screens[n, y : y + h, x : x + w]
            seen[picture.shape, picture.tobytes()][int(rem.orientation[n, slots][k])] += 1
    return seen


def mirror(picture):
    shape, pixels = picture
    return shape, np.frombuffer(pixels, np.uint8).reshape(shape)[:, ::-1].tobytes()


def shared_with_mirrors(seen):
    """The number of pictures with a mirror image, and the share of them that has a sideways
    orientation of the mirror image."""
    pairs = [
        (under, seen[mirror(picture)])
        for picture, under in seen.items()
        if picture != mirror(picture) and mirror(picture) in seen
    ]
    shared = sum(
        min(n, other[o]) for under, other in pairs for o, n in under.items() if o not in UPRIGHT
    )
    count = sum(under.total() for under, _ in pairs)
    return count, shared / max(count, 1)


def test_mirrored_pictures_have_other_orientations(game):
    """Mirror images do not face the same side."""
    facing = [c.name for c in game.categories if "orientation" in c.attributes]
    paths = [DATA / folder / f"{game.name}.npz" for folder in ("", "rare", "ends")]
    tapes = [recordings.read(path, game.name) for path in paths if facing and path.exists()]
    found = [(*extracted(tape)[:2], tape.screens) for tape in tapes]
    for category in facing:
        seen = collections.defaultdict(collections.Counter)
        for each in found:
            for picture, under in facings(*each, game.slices[category]).items():
                seen[picture] += under
        count, shared = shared_with_mirrors(seen)
        most = game.checks.mirrored.get(category, MIRRORED)
        assert (count == 0) == (most is None), (category, count)
        assert shared <= (most or 0), (category, count)
        # If all faced the same side, the check would notice.
        alike = {
            picture: collections.Counter({4: under.total()}) for picture, under in seen.items()
        }
        assert count == 0 or shared_with_mirrors(alike)[1] > max(0.07, 1.9 * shared), (
            category,
            count,
        )


def test_displays_at_their_limits(game):
    path = DATA / "edges" / f"{game.name}.npz"
    assert path.exists() == bool(game.checks.at_limits)
    if path.exists():
        tape = recordings.read(path, game.name)
        rem, vem = in_batches(game.rem, tape.rams), in_batches(game.vem, tape.screens)
        for category, values in game.checks.at_limits.items():
            slot = game.slices[category].start
            both = [value if isinstance(value, tuple) else (value, value) for value in values]
            assert list(zip(rem.value[:, slot], vem.value[:, slot], strict=True)) == both
        for c in (c for c in game.categories if c.hud):
            shown = rem.valid[:, game.slices[c.name]]
            boxes = (o.xywh[:, game.slices[c.name]][shown] for o in (rem, vem))
            np.testing.assert_array_equal(vem.valid[:, game.slices[c.name]], shown, c.name)
            np.testing.assert_array_equal(*boxes, c.name)


def test_first_and_last_states_and_lost_lives(game):
    path = DATA / "ends" / f"{game.name}.npz"
    if not path.exists():
        pytest.fail(f"{path} is missing")
    tape = recordings.read(path, game.name)
    counts = agreement_on(tape)
    for situation, samples in {
        "first": tape.resets,
        "last": tape.ends,
        "lost": ~tape.resets & ~tape.ends,
    }.items():
        if samples.any():
            each = counts.map(lambda a, samples=samples: a[samples]).sum(axis=0)
            by_category = dict(zip(game.slices, each.f1, strict=True))
            whole = each.sum()
            nothing = whole.left + whole.right == 0  # such as a title without objects
            assert nothing or whole.f1 >= least_f1(game, situation), (situation, by_category)
