"""The vision kernels against scipy.ndimage."""

import dataclasses
import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from ocjax.extractors.krull.lines import Lines
from ocjax.vision import bitmap
from ocjax.vision.bounds import tight_boxes
from ocjax.vision.components import MAX_FRAMES, components
from ocjax.vision.components import candidates as stages
from ocjax.vision.components.fill import fill
from ocjax.vision.components.search import MAX_PARTS, Search, words_across
from ocjax.vision.filters import NoLines
from ocjax.vision.pictures import PICTURE_WIDTH, picture
from ocjax.vision.shapes import Shape, limits
from tests.support.marks import slow_but
from tests.support.states import excerpt

pytestmark = pytest.mark.usefixtures("quick_compilation")

H, W = 24, 160


def reference(mask, search):
    """Boxes in raster order of the components' first pixels, by label and find_objects; with the
    column of that pixel."""
    dx, dy = search.gap
    wide = np.zeros((mask.shape[0] + dy, mask.shape[1] + dx), bool)
    for i in range(dx + 1):
        for j in range(dy + 1):
            wide[j : j + mask.shape[0], i : i + mask.shape[1]] |= mask
    labels, _ = ndimage.label(wide, np.ones((3, 3)) if search.connectivity == 8 else None)
    out = []
    for label, (rows, columns) in enumerate(ndimage.find_objects(labels), start=1):
        first = int(np.flatnonzero(labels[rows.start] == label)[0])
        w, h = columns.stop - columns.start - dx, rows.stop - rows.start - dy
        size = next(
            (
                s.split or (256, 256)
                for s in search.shapes
                if meets(s, w, h, (labels == label).sum())
            ),
            None,
        )
        if size is not None:
            boxes = parts(columns.start, rows.start, w, h, size)
            if w > PICTURE_WIDTH or h > max(map(len, search.pictures), default=256):
                boxes = by_picture(labels == label, first, rows.start, search) or boxes
            out.append((rows.start, first, boxes))
    return [(*box, first) for y, first, boxes in sorted(out) for box in boxes]


def meets(shape, w, h, pixels):
    limit = shape.max_size
    least, most = (1, W * 256) if shape.pixels is None else limits(shape.pixels)
    return (
        shape.min_size[0] <= w <= limit[0]
        and shape.min_size[1] <= h <= limit[1]
        and least <= pixels <= most
    )


def parts(x, y, w, h, size):
    """A component as objects of a size: evenly spaced from edge to edge."""
    across = min(-(-w // size[0]), MAX_PARTS)
    down = min(-(-h // size[1]), MAX_PARTS // across)
    part_w, part_h = size[0] if across > 1 else w, size[1] if down > 1 else h
    places = [
        (i * (w - part_w) // max(across - 1, 1), j * (h - part_h) // max(down - 1, 1))
        for j in range(down)
        for i in range(across)
    ]
    return [(x + i, y + j, part_w, part_h) for i, j in places]


def by_picture(component, x, y, search):
    """The boxes of the first picture that fits at a component's first pixel, and of the remaining
    pixels; empty without both."""
    for bits in search.pictures:
        rows, columns = np.nonzero(np.array(bits)[:, None] >> np.arange(PICTURE_WIDTH)[::-1] & 1)
        at = {
            (y + j, x + i - columns[0])
            for j, i in zip(rows.tolist(), columns.tolist(), strict=True)
        }
        at = {
            (j, i)
            for j, i in at
            if j < component.shape[0] and search.columns[0] <= i < search.columns[1]
        }
        if all(component[j, i] for j, i in at):
            rest = {(j, i) for j, i in np.argwhere(component).tolist()} - at
            return [bounding_box(at), bounding_box(rest)] if rest else []
    return []


def bounding_box(pixels):
    ys, xs = np.array(sorted(pixels)).T
    return int(xs.min()), int(ys.min()), int(np.ptp(xs)) + 1, int(np.ptp(ys)) + 1


def packed_bits(mask):
    """A mask of one frame, bool `[H, W]`, as a bitmap."""
    return bitmap.planes(2 * jnp.asarray(mask, jnp.uint8)[None])[0]


@functools.cache
def compiled(searches):
    @jax.jit
    def run(frames):
        planes = bitmap.planes(frames)
        return components(
            [bitmap.color_mask(planes, (2 * i + 2,)) for i in range(len(searches))],
            searches,
            heads=True,
        )

    return run


def check(masks, searches):
    """Several masks of one frame (disjoint), several frames at once."""
    frames = np.zeros(masks[0].shape, np.uint8)
    for i, m in enumerate(masks):
        frames[m] = 2 * i + 2
    masks = [frames == 2 * i + 2 for i in range(len(masks))]
    found = jax.tree.map(np.asarray, compiled(searches)(jnp.asarray(frames)))
    for mask, search, boxes in zip(masks, searches, found, strict=True):
        for b in range(len(frames)):
            want = reference(mask[b], search)
            assert (boxes.head is None) == search.splits
            fields = [
                field
                for field in (boxes.x, boxes.y, boxes.w, boxes.h, boxes.head)
                if field is not None
            ]
            got = [
                tuple(int(v[k, b]) for v in fields)
                for k in range(search.count)
                if boxes.valid[k, b]
            ]
            assert got == [box[: len(fields)] for box in want[: search.count]]
            assert boxes.overflow[b] == max(len(want) - search.count, 0)
            assert not boxes.valid[len(want) :, b].any()


def test_searches_of_one_mask_find_what_each_finds_alone():
    searches = (
        Search(6, (Shape((1, 4), (1, 4)),)),
        Search(2, (Shape((1, 9), (1, 9), pixels=(3, 30)), Shape(1, 1))),
        Search(5, (Shape((2, 12), (1, 8)),), gap=(2, 1)),
        Search(3, (Shape((1, 20), (1, 20), split=(4, 4)),)),
    )

    @jax.jit
    def both(frames):
        masks = [bitmap.color_mask(bitmap.planes(frames), (2,)) for _ in searches]
        return components(masks[:1] * len(searches), searches), components(masks, searches)

    mask = (
        np.random.default_rng(3).random((5, H, W))
        < np.array([0, 0.02, 0.1, 0.3, 0.5])[:, None, None]
    )
    together, alone = both(jnp.asarray(2 * mask, jnp.uint8))
    assert jax.tree.all(jax.tree.map(lambda a, b: bool((a == b).all()), together, alone))
    assert all(boxes.valid.any() for boxes in together)


def spiral(step):
    mask = np.zeros((H, W), bool)
    top, left, bottom, right = 0, 0, H - 1, W - 1
    while top <= bottom and left <= right:
        mask[top, left : right + 1] = True
        mask[top : bottom + 1, right] = True
        mask[bottom, left : right + 1] = True
        mask[min(top + step, bottom) : bottom + 1, left] = True
        mask[min(top + step, bottom), left : left + step] = True
        top, left, bottom, right = top + step, left + step, bottom - step, right - step
    return mask


def comb():
    mask = np.zeros((H, W), bool)
    mask[:, ::2] = True
    mask[-1] = True
    return mask


def snake():
    mask = np.zeros((H, W), bool)
    mask[::4] = True
    mask[2::8, -1] = mask[1::8, -1] = mask[3::8, -1] = True
    mask[6::8, 0] = mask[5::8, 0] = mask[7::8, 0] = True
    return mask


checkerboard = np.indices((H, W)).sum(0) % 2 == 0
WORST = {
    "empty": np.zeros((H, W), bool),
    "full": np.ones((H, W), bool),
    "checkerboard": checkerboard,
    "comb": comb(),
    "comb, teeth down": comb()[::-1],
    "spiral": spiral(2),
    "snake": snake(),
    "stripes": np.arange(W)[None].repeat(H, 0) % 3 == 0,
    "rows": np.arange(H)[:, None].repeat(W, 1) % 2 == 0,
    "frame": np.pad(np.zeros((H - 2, W - 2), bool), 1, constant_values=True),
    "corners": np.pad(np.zeros((H - 2, W - 2), bool), 1, constant_values=True) & checkerboard,
    "diagonal": np.indices((H, W))[1] // 6 == np.indices((H, W))[0],
}
PICTURES = (  # a disc, a wedge and a spot
    picture(
        np.hypot(*np.indices((9, 16)) - np.array([4, 7.5])[:, None, None] * np.ones((2, 1, 1))) < 5
    ),
    picture(np.indices((6, 9)).sum(0) > 5),
    picture(np.ones((3, 2))),
)
SEARCHES = {
    "up to a window": Search(12),
    "small": Search(700, (Shape(w=(1, 8), h=(1, 10)),)),
    "wide": Search(40, (Shape(w=(2, 40), h=(2, 12)),)),
    "as wide as a word allows": Search(700, (Shape(w=(1, 16), h=(1, 10)),)),
    "joined": Search(30, (Shape(w=(1, 20), h=(1, 10)),), gap=(3, 1)),
    "split": Search(40, (Shape(w=(1, 30), h=(1, 20), split=(8, 7)),)),
    "joined, up to a window": Search(30, gap=(2, 5)),
    "4-connected": Search(700, (Shape(w=(1, 8), h=(1, 10)),), connectivity=4),
    "4-connected, up to a window": Search(12, connectivity=4),
    "two sizes": Search(
        700, (Shape(w=(1, 8), h=(1, 2), pixels=(3, 9)), Shape(w=(1, 5), h=(3, 10), split=(3, 4)))
    ),
    "two sizes, one of them large": Search(30, (Shape(w=(1, 4), h=(1, 4)), Shape(w=(9, 60)))),
    "pictures": Search(60, (Shape(w=(1, 30), h=(1, 20), split=(16, 9)),), pictures=PICTURES),
    "pictures in wide windows": Search(60, (Shape(w=(1, 60), h=(1, 20)),), pictures=PICTURES),
    "so many pixels": Search(60, (Shape(w=(1, 20), h=(1, 10), pixels=(5, 40)),), gap=(1, 0)),
}
# These searches have all features: a gap, both connectivities, several sizes, parts, numbers of
# pixels, and pictures.
FEATURES = ("up to a window", "joined", "4-connected", "two sizes", "pictures")


@pytest.mark.parametrize("search", slow_but(FEATURES, SEARCHES))
def test_worst_cases(search):
    check([np.stack(list(WORST.values()))], (SEARCHES[search],))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "colors"),
    [
        ("SpaceInvaders", (20,)),
        ("MsPacman", (38, 184, 88, 70, 42)),
        ("Skiing", (198, 212, 214, 218)),
    ],
)
@pytest.mark.parametrize("search", SEARCHES)
def test_real_frames(search, name, colors):
    check([np.isin(excerpt(name)["screens"][::4], colors)], (SEARCHES[search],))


@pytest.mark.parametrize(
    ("most", "connectivity"),
    slow_but([(17, 4), (32, 8)], list(itertools.product([15, 16, 17, 31, 32, 33], [4, 8]))),
)
def test_widest_objects(most, connectivity):
    """Components of the greatest width and one column wider that begin at their right, left or
    middle, on every column of the screen."""
    masks = []
    for width in (most, most + 1):
        for first in (0, width // 2, width - 1):
            for diagonal in (0, 1):
                figure = np.zeros((3, width + 2 * diagonal), bool)
                figure[0, first + diagonal] = figure[1, diagonal : width + diagonal] = True
                figure[2, [0, -1]] = True  # beside the row above, or below its ends
                masks += [
                    np.pad(figure, ((5, H - 8), (x, W - x - figure.shape[1])))
                    for x in range(W - figure.shape[1] + 1)
                ]
    check(
        [np.stack(masks)], (Search(5, (Shape(w=(1, most), h=(1, 10)),), connectivity=connectivity),)
    )


@st.composite
def masks(draw):
    """Noise of any density, and rectangles."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    out = rng.random((len(WORST), H, W)) < draw(st.sampled_from([0.003, 0.02, 0.1, 0.3, 0.5, 0.8]))
    for m in out:
        for _ in range(draw(st.integers(0, 6))):
            x, y, w, h = rng.integers([0, 0, 1, 1], [W, H, 40, 14])
            m[y : y + h, x : x + w] = rng.random() < 0.7
    return out


@pytest.mark.parametrize("search", slow_but(FEATURES, SEARCHES))
@settings(max_examples=25)
@given(mask=masks())
def test_random_masks(search, mask):
    check([mask], (SEARCHES[search],))


@pytest.mark.slow
@settings(max_examples=25)
@given(first=masks(), second=masks(), third=masks())
def test_several_masks_at_once(first, second, third):
    check(
        [first, second, third],
        (SEARCHES["small"], SEARCHES["joined"], SEARCHES["4-connected, up to a window"]),
    )


@pytest.mark.parametrize(
    ("search", "columns"),
    [("pictures", (0, W)), ("pictures", (5, 131)), ("pictures in wide windows", (0, W))],
)
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_pictures_that_touch(seed, search, columns):
    """Pairs of pictures, also across the edges of the searched area."""
    rng = np.random.default_rng(seed)
    frames = np.zeros((len(WORST), H + 9, W + 64), bool)
    for frame in frames:
        for x in rng.choice(
            [24, 30, 60, 90, 120, columns[1] + 20, columns[1] + 26], 4, replace=False
        ):
            for offset, rows in zip(
                (0, rng.integers(-9, 17)), rng.choice(np.array(PICTURES, object), 2), strict=True
            ):
                ink = np.array(rows)[:, None] >> np.arange(PICTURE_WIDTH)[::-1] & 1
                y = rng.integers(0, H)
                frame[y : y + len(ink), x + offset : x + offset + PICTURE_WIDTH] |= ink.astype(bool)
    frames = frames[:, :H, 32 : W + 32]
    frames[..., : columns[0]] = frames[..., columns[1] :] = False
    check([frames], (dataclasses.replace(SEARCHES[search], columns=columns),))


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 31), words=st.integers(1, 6))
def test_shifts_and_fills(seed, n, words):
    rng = np.random.default_rng(seed)
    pixels = rng.random((4, 32 * words, 3)) < 0.6
    touched = pixels & (rng.random(pixels.shape) < 0.1)

    def pack(p):
        return jnp.asarray(
            np.packbits(p, axis=1)
            .reshape(4, words, 4, 3)
            .transpose(1, 0, 3, 2)
            .copy()
            .view(">u4")[..., 0]
            .astype(np.uint32)
        )

    def unpack(words_):
        stacked = np.stack([np.asarray(w) for w in words_]).astype(">u4")[..., None].view(np.uint8)
        return np.unpackbits(stacked.transpose(1, 0, 3, 2).reshape(4, -1, 3), axis=1).astype(bool)

    assert np.array_equal(unpack(pack(pixels)), pixels)
    moved = np.zeros_like(pixels)
    moved[:, : pixels.shape[1] - n] = pixels[:, n:]
    assert np.array_equal(unpack(bitmap.shift_left(pack(pixels), n)), moved)
    moved = np.zeros_like(pixels)
    moved[:, n:] = pixels[:, : pixels.shape[1] - n]
    assert np.array_equal(unpack(bitmap.shift_right(pack(pixels), n)), moved)
    rows = ndimage.label(pixels, np.array([[[0] * 3] * 3, [[0, 1, 0]] * 3, [[0] * 3] * 3]))[0]
    filled = np.isin(rows, np.unique(rows[touched])) & pixels
    assert np.array_equal(unpack(bitmap.fill_rows(pack(pixels), pack(touched))), filled)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), margin=st.integers(0, 15), words=st.integers(1, 6))
def test_windows_hold_what_moves(seed, margin, words):
    """Spreading within windows, column by column, equals spreading across the words of the
    bitmap."""
    rng = np.random.default_rng(seed)
    pixels = jnp.asarray(
        rng.integers(0, 2**32, (words, 4, 3), np.uint32)
        & rng.integers(0, 2**32, (words, 4, 3), np.uint32)
    )
    inside, across = bitmap.windows(pixels, margin), pixels
    for _ in range(margin):
        inside, across = inside | (inside << 1) | (inside >> 1), bitmap.spread(across)
    assert np.array_equal(bitmap.from_windows(inside, margin, words), across)


@pytest.mark.parametrize("most", [3, 4, 20])
def test_lines_are_left_out(most):
    """A fish on a slanting line of 20 rows, and a line of 4 rows beside it."""
    fish = np.zeros((H, W), bool)
    fish[20:23, 35:41] = True
    slanting, short = np.zeros_like(fish), np.zeros_like(fish)
    slanting[np.arange(20), 30 + np.arange(20) // 3] = True
    short[4:8, 60] = True
    packed = packed_bits(fish | slanting | short)
    kept = fish | (slanting if most >= 20 else False) | (short if most >= 4 else False)
    expected = packed_bits(kept)
    assert np.array_equal(NoLines(most)(packed, packed), expected)


@pytest.mark.parametrize("most", [1, 2, 4, 7, 8, 9, 20])
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), density=st.floats(0.3, 0.8))
def test_no_pixel_of_a_long_line_is_left(most, seed, density):
    """The result equals the steps row by row, on lines that slant at random, branch and cross each
    other."""
    y, x = np.indices((H, W))
    pixels = (np.random.default_rng(seed).random((H, W)) < density) & ((x + y) % 2 == 0)
    padded = np.pad(pixels, 1)
    line = padded
    for _ in range(most):
        line = padded & _beside(np.roll(line, -1, 0))
    for _ in range(most):
        line = line | (padded & _beside(np.roll(line, 1, 0)))
    packed = packed_bits(pixels)
    assert np.array_equal(NoLines(most)(packed, packed), packed_bits((padded & ~line)[1:-1, 1:-1]))


def _beside(pixels):
    """Each pixel and its neighbours left and right; the outermost columns are blank."""
    return pixels | np.roll(pixels, 1, 1) | np.roll(pixels, -1, 1)


@pytest.mark.parametrize("least", [2, 5, 6, 31])
def test_only_lines_of_one_colour_are_left(least):
    """Lines of 31 rows upright and slanting both ways, across words and over each other; one that
    changes its colour, and a spot."""
    height, rows = 70, np.arange(31)
    frame = np.zeros((height, W), np.uint8)
    frame[2 + rows, 31], frame[3 + rows, 20 + rows], frame[4 + rows, 80 - rows] = 2, 4, 6
    frame[40:45, 5], frame[45:50, 5] = 8, 10
    frame[60, 60] = 12
    expected = np.zeros((height, W), bool)
    for slope in (-1, 0, 1):
        for y, x in np.argwhere(frame):
            columns = x + slope * np.arange(least)
            if y + least <= height and (frame[y + np.arange(least), columns] == frame[y, x]).all():
                expected[y + np.arange(least), columns] = True
    planes = bitmap.planes(jnp.asarray(frame)[None])
    colored = bitmap.color_mask(planes, range(2, 14, 2))
    found = jax.jit(Lines(least, (0, height)))(colored, planes)
    assert np.array_equal(found, packed_bits(expected))
    inner = jax.jit(Lines(least, (1, 60)))(colored, planes[:3])
    assert np.array_equal(
        inner[:, 1:60], found[:, 1:60]
    )  # no line ends outside of these rows, and these bits distinguish the colours
    assert not inner[:, :1].any()
    assert not inner[:, 60:].any()


@pytest.mark.slow
@settings(deadline=None, max_examples=5)
@given(st.randoms(use_true_random=False))
def test_tight_boxes(random):
    """The bounds and first pixels of regions in several masks: high and low regions, some of one
    mask, some overlapping."""
    height, n_frames = 90, 6
    rng = np.random.default_rng(random.getrandbits(32))
    pixels = rng.random((2, n_frames, height, W)) < rng.choice(
        [0, 0.0005, 0.01, 1], (2, n_frames, 1, 1)
    )
    masks = [bitmap.color_mask(bitmap.planes(2 * jnp.asarray(m, jnp.uint8)), (2,)) for m in pixels]
    which, regions = (
        [0, 1, 1, 1],
        [(0, 0, W, height), (0, height - 1, W, height), (3, 70, 90, height), (31, 0, 33, 1)],
    )
    for _ in range(7):
        (left, right), (top, bottom) = (
            sorted(random.sample(range(size + 1), 2)) for size in (W, height)
        )
        which.append(random.randrange(2))
        regions.append((left, top, right, bottom))
    found = np.array(tight_boxes([masks[i] for i in which], regions))
    for k, (i, (left, top, right, bottom)) in enumerate(zip(which, regions, strict=True)):
        for b in range(n_frames):
            ys, xs = np.nonzero(pixels[i, b, top:bottom, left:right])
            x, y, w, h, head = found[:, k, b]
            if len(ys) == 0:
                assert w <= 0
                assert h <= 0
                continue
            assert (x, y, w, h) == (left + xs.min(), top + ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1)
            assert head == left + xs[ys == ys.min()].min()


@pytest.mark.parametrize("row", range(5))
def test_tight_boxes_of_rows_of_regions(row):
    """A pixel in any row of several regions of one mask, whose rows are gathered together."""
    pixels = np.zeros((1, H, W), np.uint8)
    regions = [(left, top, left + 9, top + 5) for left, top in ((0, 0), (40, 9), (80, 19))]
    for left, top, _, _ in regions:
        pixels[0, top + row, left + 3] = 2
    mask = bitmap.color_mask(bitmap.planes(jnp.asarray(pixels)), (2,))
    found = np.array(tight_boxes([mask] * 3, regions))[..., 0].T
    assert found.tolist() == [[left + 3, top + row, 1, 1, left + 3] for left, top, _, _ in regions]


@pytest.mark.parametrize("reach", [1, 16, 17, 32, 33, 160])
def test_windows_hold_a_component_on_both_sides_of_its_first_pixel(reach):
    words = words_across(reach)
    assert 32 * (words - 1) < 2 * reach <= 32 * words


@pytest.mark.parametrize("height", [1, 31, 32, 33, 40, 150])
def test_rows_and_columns(height):
    """First and last set rows and columns of bitmaps with a few pixels, or none."""
    rng = np.random.default_rng(height)
    pixels = rng.random((height, 160, 20)) < rng.choice([0, 0.0005, 0.5], 20)
    words = jnp.asarray(
        np.packbits(pixels, axis=1)
        .reshape(height, 5, 4, 20)
        .transpose(1, 0, 3, 2)
        .copy()
        .view(">u4")[..., 0]
        .astype("u4")
    )
    for used, (first, last) in (
        (pixels.any(axis=1), _edges(lambda w: bitmap.rows(bitmap.any_of(w)), words)),
        (pixels.any(axis=0), _edges(lambda w: bitmap.columns(bitmap.or_rows(w)), words)),
    ):
        for lane in range(20):
            where = np.flatnonzero(used[:, lane])
            assert int(last[lane]) == (where[-1] if len(where) else -1)
            assert (
                int(first[lane]) == where[0] if len(where) else int(first[lane]) > int(last[lane])
            )


def _edges(method, words):
    return map(np.asarray, jax.jit(method)(words))


def test_more_frames_than_objects_can_be_numbered_are_refused():
    masks = [jax.ShapeDtypeStruct((5, 8, MAX_FRAMES + 1), bitmap.U)]
    searches = [Search(1, (Shape(w=1, h=1),))]
    with pytest.raises(ValueError, match=f"at most {MAX_FRAMES} frames, got {MAX_FRAMES + 1}"):
        jax.eval_shape(lambda *own: components(own, searches), *masks)


def test_stage_last_at_most():
    table = jnp.array([0, 0, 3, 3, 7, 12])
    got = stages._last_at_most(lambda i: table[i], 5, jnp.arange(10, dtype=jnp.int32))
    assert got.tolist() == [1, 1, 1, 3, 3, 3, 3, 4, 4, 4]


def test_stage_locate():
    counts = jnp.array([[2, 0], [0, 1], [3, 4]])
    index, rest = stages._locate(counts, jnp.array([4, 1]))
    assert (index.tolist(), rest.tolist()) == ([2, 2], [2, 0])


def test_stage_nth_bit():
    word = jnp.full(4, 0b1001_0000_0000_0000_0000_0000_0000_0011, jnp.uint32)
    assert bitmap.nth_bit(word, jnp.arange(4)).tolist() == [0, 3, 30, 31]


def test_stage_starts():
    """First pixels of runs without a pixel above; each word is tested alone."""
    rows = np.zeros((4, 32), np.uint8)
    rows[1, 3:6] = rows[2, 6] = rows[2, 10] = rows[3, 9:12] = 1
    board = jnp.asarray(np.packbits(rows, axis=1).view(">u4").astype(np.uint32))[None]
    for corners, want in (
        (bitmap.ALL, [(1, 3), (2, 10)]),
        (~bitmap.ALL, [(1, 3), (2, 6), (2, 10)]),
    ):
        starts = np.asarray(stages.starts(list(board[:, 1:]), list(board[:, :-1]), corners))[
            0, :, 0
        ]
        found = np.unpackbits(starts.astype(">u4")[:, None].view(np.uint8), axis=1)
        assert [(y + 1, x) for y, x in np.argwhere(found).tolist()] == want


@pytest.mark.parametrize("corners", [bitmap.ALL, ~bitmap.ALL])
def test_stage_fill(corners):
    rng = np.random.default_rng(1)
    mask = rng.random((12, 64)) < 0.55
    words = (
        np.packbits(mask, axis=1).reshape(12, 2, 4).view(">u4")[..., 0].astype(np.uint32)[..., None]
    )
    labels, _ = ndimage.label(mask, np.ones((3, 3)) if corners.all() else None)
    y, x = (int(v) for v in np.argwhere(mask)[40])
    seed = np.zeros_like(words)
    seed[y, x // 32] = 1 << (31 - x % 32)
    filled = np.asarray(fill(jnp.asarray(words), jnp.asarray(seed), corners))[..., 0]
    found = np.unpackbits(
        filled.astype(">u4")[..., None].view(np.uint8).reshape(12, 8), axis=1
    ).astype(bool)
    assert np.array_equal(found, labels == labels[y, x])
