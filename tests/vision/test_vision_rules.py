"""VEM's rules for changing colours, for objects side by side, and for covered cells."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ocjax.extraction.categories import Category
from ocjax.extraction.detection import detect
from ocjax.extractors.krull.lines import Lines
from ocjax.vision.bitmap import color_mask
from ocjax.vision.blobs import _boards
from ocjax.vision.components.search import Search, window_words
from ocjax.vision.detected import boxes
from ocjax.vision.filters import Searched, ShortRuns
from ocjax.vision.pictures import picture
from ocjax.vision.rules import Blobs, Bounds, Cells
from ocjax.vision.scene import Scene
from ocjax.vision.shades import Shades
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Raised, SideBySide, Step

pytestmark = pytest.mark.usefixtures("quick_compilation")

SHADES = Shades((0, 0), (8, 10), ((20, 30), (30, 40)))


def found(categories, frame, shades=None):
    """The boxes of each category and their colours."""
    out = jax.jit(lambda f: detect(categories, f, shades))(frame[None])
    boxes = [np.stack([f.x, f.y, f.w, f.h], -1)[np.asarray(f.valid)].tolist() for f in out]
    colors = [
        None if f.color is None else np.asarray(f.color)[np.asarray(f.valid)].tolist() for f in out
    ]
    return boxes, colors, out


@pytest.mark.parametrize(("key", "color"), [(8, 20), (10, 30), (12, 20)])
def test_colours_follow_the_level(key, color):
    frame = np.zeros((210, 160), np.uint8)
    frame[0, 0] = key
    for i, c in enumerate((20, 30, 40, 50)):
        frame[50 : 50 + 4, 20 * i : 20 * i + 4] = c
    categories = (
        Category("A", Blobs(20, (0, 10, 160, 100), Shape(w=(1, 9), h=(1, 9)))),
        Category("B", Bounds((20, 50), (0, 10, 160, 100))),
    )
    boxes, colors, _ = found(categories, frame, SHADES)
    x = 0 if color == 20 else 20
    assert boxes == [[[x, 50, 4, 4]], [[x, 50, 64 - x, 4]]]
    assert colors == [[color], [color]]


def test_objects_side_by_side():
    frame = np.zeros((210, 160), np.uint8)
    frame[10:14, 30:42] = frame[30:34, 8:14] = 20
    rule = Bounds(20, ((0, 0, 160, 20), (0, 20, 160, 40)), then=(SideBySide(4),))
    for count, overflow in ((6, 0), (4, 1)):
        boxes, _, (detected,) = found((Category("A", rule, count=count),), frame)
        expected = [[30, 10, 4, 4], [34, 10, 4, 4], [38, 10, 4, 4], [8, 30, 4, 4], [12, 30, 2, 4]]
        assert boxes[0] == expected[:count]
        assert np.asarray(detected.overflow).tolist() == [overflow]


def test_cells_under_other_objects():
    frame = np.zeros((210, 160), np.uint8)
    frame[20:24, 20:24] = frame[20:30, 40:50] = 20
    player = Category("Player", Blobs(20, None, Shape(w=(9, 20), h=(9, 20))))
    for exclude, expected in (
        ((), [[20, 20, 4, 4], [42, 22, 4, 4]]),
        (("Player",), [[20, 20, 4, 4]]),
    ):
        cells = Cells(20, (20, 42), (20, 22), 4, 4, exclude=exclude)
        boxes, _, _ = found((player, Category("Pebble", cells, count=2)), frame)
        assert boxes[1] == expected


def test_only_some_colours_in_a_part_of_the_screen():
    frame = np.zeros((210, 160), np.uint8)
    frame[20:22, 10:14] = frame[20:22, 100:104] = 20
    frame[60:62, 10:14] = frame[60:62, 100:104] = 30
    inside = Blobs(30, (90, 0, 160, 210))
    rule = Blobs((20, 30), ignore=((90, 0, 160, 210),), also=(inside,))
    boxes, _, _ = found((Category("Shot", rule, count=4),), frame)
    assert boxes == [[[10, 20, 4, 2], [10, 60, 4, 2], [100, 60, 4, 2]]]


def test_heads_of_another_colour():
    frame = np.zeros((210, 160), np.uint8)
    frame[40:50, 30:36] = 20
    frame[2:8, 60:66] = 20  # less than the head's rows below the top of the screen
    rule = Blobs(20, None, Shape(w=6, h=(6, 10)), then=(Raised(4),))
    boxes, _, _ = found((Category("Player", rule, count=2),), frame)
    assert boxes == [[[60, 0, 6, 8], [30, 36, 6, 14]]]


class FromHead(Step):
    """Boxes that begin at the column of their first pixel."""

    def __call__(self, found, context):
        """The objects after the step."""
        w = found.x + found.w - found.head
        return found._replace(box=boxes(found.head, found.y, w, found.h, found.valid))


@pytest.mark.parametrize("rgb", [None, (1, 2, 3)])
@pytest.mark.parametrize("colors", [20, (20, 30)])
@pytest.mark.parametrize(
    "rule",
    [
        lambda colors: Blobs(colors, then=(FromHead(),)),
        lambda colors: Bounds(colors, (20, 30, 60, 60), then=(FromHead(),)),
    ],
    ids=["blobs", "bounds"],
)
def test_steps_know_the_first_pixel(rule, colors, rgb):
    """They know it whether or not any category's colour is read from the frame."""
    frame = np.zeros((210, 160), np.uint8)
    frame[40, 33:36] = frame[41:50, 30:36] = 20
    found_boxes, _, _ = found((Category("A", rule(colors), rgb=rgb),), frame)
    assert found_boxes == [[[33, 40, 3, 10]]]


def test_other_colours_where_the_first_are_missing():
    small = Shape(w=(1, 20), h=(1, 20))
    frames = np.zeros((2, 210, 160), np.uint8)
    frames[0, 20:30, 10:20] = 20
    frames[:, 60:66, 50:54] = 30  # another object on the first frame
    blobs = Category("Bird", Blobs(20, None, small), otherwise=Blobs(30, None, small))
    bounds = Category("Box", Bounds(20, (0, 0, 160, 210)), otherwise=Bounds(30, (0, 0, 160, 210)))
    first, _, _ = found((blobs, bounds), frames[0])
    second, _, _ = found((blobs, bounds), frames[1])
    assert first == [[[10, 20, 10, 10]]] * 2
    assert second == [[[50, 60, 4, 6]]] * 2


@pytest.mark.parametrize("down", [0, 7, 60])
def test_cells_of_a_grid_that_moves(down):
    frame = np.zeros((210, 160), np.uint8)
    frame[down : down + 3, 124:132] = frame[down + 7 : down + 11, 128:132] = (
        20  # the first row of cells lacks its first row
    )
    frame[150, 90] = 20  # not in a column of the grid
    cells = Cells(
        20, (124, 128) * 4, (0, 0, 4, 4, 8, 8, 12, 12), 4, 4, whole=False, floats=(20, 16)
    )
    category = Category("Brick", cells, count=8)
    boxes, _, _ = found((category,), frame)
    assert boxes == [[[124, down, 4, 3], [128, down, 4, 3], [128, down + 7, 4, 4]]]
    assert not category.has_places
    assert found((category,), np.zeros((210, 160), np.uint8))[0] == [[]]


@pytest.mark.parametrize("down", [0, 9, 60])
def test_cells_of_a_grid_that_moves_with_something_that_stays_whole(down):
    frame = np.zeros((210, 160), np.uint8)
    frame[down + 2 : down + 5, 124:128] = 40
    frame[down + 6 : down + 10, 128:132] = 20  # the last row of cells is gone
    frame[150, 90] = 40  # not in a column of the grid
    cells = Cells(20, (124, 128) * 3, (6, 6, 10, 10, 14, 14), 4, 4, floats=(40, 5))
    boxes, _, _ = found((Category("Brick", cells, count=6),), frame)
    assert boxes == [[[128, down + 6, 4, 4]]]


def test_wrong_declarations():
    with pytest.raises(ValueError, match="each level needs a key"):
        Shades((0, 0), (8,), ((20, 30), (30, 40)))


def test_objects_of_known_pictures_that_overlap():
    """A triangle that overlaps a wide bar; the bar's edges cut it, so its visible part is 12
    columns wide."""
    triangle, bar = np.tri(8, 8, dtype=int), np.ones((3, 16), int)
    frame = np.zeros((210, 160), np.uint8)
    frame[20:28, 40:48][triangle > 0] = 20
    frame[26:29, 44:56] = 20
    shapes = Shape(w=(1, 16), h=(1, 8)), Shape(w=(1, 32), h=(1, 32), split=(16, 8))
    rule = Blobs(20, (0, 10, 56, 100), shapes, pictures=(picture(triangle), picture(bar)))
    assert found((Category("A", rule, count=4),), frame)[0] == [[[40, 20, 8, 8], [44, 26, 12, 3]]]
    frame[20:23, 40:44] = 0  # the triangle's first pixel is not where it should be
    assert found((Category("A", rule, count=4),), frame)[0] == [[[40, 23, 16, 6]]]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pictures": ((1, 0),)}, "pictures must be rows of 16 bits"),
        ({"pictures": ((),)}, "pictures must be rows of 16 bits"),
        ({"pictures": ((1 << 16,),)}, "pictures must be rows of 16 bits"),
        (
            {"pictures": ((1,),), "shapes": Shape(w=(1, 15), h=(1, 9))},
            r"pictures need no gap, and a shape of up to \(16, 1\) or more",
        ),
        ({"pictures": ((1,) * 10,)}, r"a shape of up to \(16, 10\) or more"),
        ({"pictures": ((1,),), "gap": (1, 0)}, "pictures need no gap"),
    ],
)
def test_pictures_are_checked(options, message):
    with pytest.raises(ValueError, match=message):
        Blobs(20, **{"shapes": Shape(w=(1, 16), h=(1, 9)), **options})


def test_a_picture_is_at_most_16_columns_wide():
    assert picture(np.array([[0, 1], [1, 1]])) == (1 << 14, 3 << 14)
    with pytest.raises(ValueError, match=r"at most 16 columns, got shape \(2, 17\)"):
        picture(np.ones((2, 17)))


def test_rules_of_different_screens_share_their_pixels():
    def is_dark(planes):
        return planes[5, 0, 0] >> 31 == 0  # bit 6 of the first pixel's colour

    both = Searched(
        lambda planes: color_mask(planes, (20, 30)), lambda _, pixels: pixels, whole=True
    )
    small, large = Shape((1, 4), (1, 4)), Shape((1, 8), (1, 8))
    categories = (
        Category("Dark", Blobs(20, shapes=small, filters=(both,), frames=is_dark), count=2),
        Category(
            "Light",
            Blobs(30, shapes=large, filters=(both,), frames=lambda planes: ~is_dark(planes)),
            count=2,
        ),
    )
    frame = np.zeros((210, 160), np.uint8)
    frame[20:24, 20:24], frame[50:58, 20:28] = 30, 20
    assert found(categories, frame)[0] == [[[20, 20, 4, 4]], []]
    frame[0, 0] = 64
    assert found(categories, frame)[0] == [[], [[20, 20, 4, 4], [20, 50, 8, 8]]]


SMALL = Shape((1, 4), (1, 4))


@pytest.mark.parametrize(
    ("rule", "rows"),
    [
        (Blobs(20, (0, 0, 160, 50), SMALL), 50),
        (Blobs(20, (0, 0, 160, 50), SMALL, also=(Blobs(30, (0, 0, 160, 70), SMALL),)), 70),
        (Blobs(20, shapes=SMALL), 210),
        (Blobs(20, (0, 0, 160, 50), SMALL, frames=lambda planes: planes[0, 0, 0] > 0), 210),
        (Blobs(20, (0, 0, 160, 50), SMALL, filters=(Lines(5, rows=(20, 60)),)), 60),
        (Blobs(20, (0, 0, 160, 50), SMALL, filters=(ShortRuns(4),)), 210),
        (Bounds(20, (0, 0, 160, 40)), 40),
        (Cells(20, (8, 16), (30, 30), 4, 8), 38),
        (Cells(20, (8, 16), (30, 30), 4, 8, margin=(0, 3)), 41),
        (Cells(20, (8, 16), (30, 30), 4, 8, floats=(20, 38)), 210),
    ],
)
def test_rows_below_what_rules_look_at_are_left_out(rule, rows):
    assert Scene({"Thing": rule}, jnp.zeros((1, 210, 160), jnp.uint8), None).height == rows


def test_large_windows_have_a_board_of_their_own():
    searches = [
        Search(1, (Shape(w=(1, w), h=(1, h)),))
        for w, h in ((4, 4), (8, 8), (40, 60), (8, 9), (20, 20))
    ]
    assert [window_words([s.reach]) for s in searches] == [5, 9, 183, 10, 42]
    assert _boards(searches) == [[0, 1, 3, 4], [2]]  # 4 * 42 + 183 words
    assert _boards(searches[:2]) == [[0, 1]]
    assert _boards(searches[2:3] * 3) == [[0, 1, 2]]
    assert _boards([searches[4], searches[4], searches[2]]) == [[0, 1], [2]]
    tall_and_wide = [
        Search(1, (Shape(w=(1, w), h=(1, h)),)) for w, h in ((1, 40), (17, 7), (17, 7))
    ]
    assert window_words([s.reach for s in tall_and_wide]) == 82
    assert _boards(tall_and_wide) == [[0], [1, 2]]
    gap = Search(1, (Shape(w=(1, 14), h=(1, 8)),), gap=(3, 2))
    assert window_words([gap.reach]) == 2 * 11
