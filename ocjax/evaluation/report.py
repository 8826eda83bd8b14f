"""Evaluate a game on a recording, and make tables of the result.

`ocjax.evaluation.formats` writes them to files.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence

import numpy as np

from ocjax._xla.batches import by_chunks
from ocjax.evaluation import matching, metrics
from ocjax.evaluation.metrics import Agreement
from ocjax.evaluation.ocatari_peer import OcatariMethod
from ocjax.evaluation.tables import Cell, Table, is_number
from ocjax.evaluation.worst_frames import WorstFrame, worst_frames
from ocjax.extraction.categories import with_role
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.recordings import Recording
from ocjax.transforms import tracking

CHUNK = 1024  # samples extracted at a time
SPRITES = 31  # bits of `Recording.shown`: players, missiles and ball
SCORES = ("Precision", "Recall", "F1", "Mean IoU")


@dataclasses.dataclass(frozen=True, eq=False)
class Evaluation:
    """The results of evaluating a recording of one game.

    The last axis of every array follows the columns of `flicker_aware`.

    Args:
        source: origin of the samples, for display.
        episode: int `[frames]`, number of each sample's episode.
        situations: bool `[frames]` by name: the samples at an episode's start or end, or with a
            life just lost, if they are known.
        flicker_aware: REM against VEM, `[frames, categories]`, with the frame before each if
            recorded.
        single_frame: REM against VEM on the frame alone.
        values: fractions of samples with the right score and lives, by category.
        switches: identity switches and transitions, each `[categories]`, or None if samples are not
            successive.
        overflow: objects that VEM detected without a slot for them, `[categories]`.
        coverage: fraction of sprite pixels inside REM's boxes and fraction of boxes with drawn
            pixels, or None without recorded pixels.
        ocatari: results of OCAtari's methods, by "rem" and "vem"; empty if it did not run.
        ocatari_agreement: OCAtari's REM against its VEM if both run, else None.
        worst_frames: pictures of the frames with the most disagreements.
    """

    game: Game
    source: str
    episode: np.ndarray
    situations: dict[str, np.ndarray]
    flicker_aware: Agreement
    single_frame: Agreement
    values: dict[str, float]
    switches: tuple[np.ndarray, np.ndarray] | None
    overflow: np.ndarray
    coverage: tuple[float, float] | None
    ocatari: dict[str, OcatariMethod]
    ocatari_agreement: Agreement | None
    worst_frames: tuple[WorstFrame, ...]


# --------------------------------------------------------------------------------------------------
# measure


def evaluate(
    recording: Recording, source: str, ocatari: dict[str, OcatariMethod] | None = None
) -> Evaluation:
    """Compare REM with VEM on a recording with frames.

    Args:
        recording: the samples. The result omits the evaluations that need missing arrays.
        ocatari: OCAtari's results on the same recording, from `ocatari_peer.run`.
    """
    if recording.screens is None or not len(recording):
        raise ValueError("the recording has no frames: there is nothing to compare REM with")
    game = recording.game
    detect = _counting_vem(game, recording.screens.ndim == 4)
    size = min(CHUNK, len(recording))
    rem: Objects = by_chunks(game.rem, recording.rams, size)
    vem, overflow = by_chunks(detect, recording.screens, size)
    earlier = None if recording.previous is None else by_chunks(detect, recording.previous, size)[0]
    left, right = matching.detections(rem), matching.detections(vem)
    before = None if earlier is None else matching.detections(earlier)
    pairs = matching.match(left, right)
    single_frame = metrics.agreement(left, right, pairs=pairs)
    flicker_aware = (
        single_frame if before is None else metrics.agreement(left, right, before, pairs=pairs)
    )
    return Evaluation(
        game=game,
        source=source,
        episode=recording.episode,
        situations=_situations(recording),
        flicker_aware=flicker_aware,
        single_frame=single_frame,
        values=_values(recording, rem),
        switches=_switches(recording, rem, vem, earlier),
        overflow=overflow.sum(axis=0),
        coverage=_coverage(recording, left),
        ocatari=ocatari or {},
        ocatari_agreement=_ocatari_agreement(ocatari or {}),
        worst_frames=worst_frames(recording, flicker_aware, left, right, before),
    )


def _counting_vem(game: Game, is_rgb: bool) -> Callable[[np.ndarray], tuple[Objects, np.ndarray]]:
    """Return VEM with counts of objects without a slot; for RGB frames the counts are 0."""
    if is_rgb:
        return lambda frames: (game.vem(frames), np.zeros((len(frames), len(game.categories)), int))
    return game.vem_overflow


def _values(recording: Recording, rem: Objects) -> dict[str, float]:
    if recording.rewards is None or recording.lives is None:
        return {}
    return metrics.value_shares(rem, recording.rewards, recording.lives)


def _situations(recording: Recording) -> dict[str, np.ndarray]:
    out = {}
    if recording.resets is not None:
        out["first states"] = recording.resets
    if recording.ends is not None:
        out["last states"] = recording.ends
    if recording.lives is not None and recording.frame_skip is not None:
        fewer = np.diff(recording.lives, prepend=recording.lives[:1]) < 0
        same_episode = np.diff(recording.episode, prepend=recording.episode[:1]) == 0
        out["lost lives"] = fewer & same_episode
    return out


def _switches(
    recording: Recording, rem: Objects, vem: Objects, earlier: Objects | None
) -> tuple[np.ndarray, np.ndarray] | None:
    if recording.frame_skip is None or recording.resets is None:
        return None
    return metrics.identity_switches(
        rem, vem if earlier is None else tracking.merge_frames(earlier, vem), recording.resets
    )


def _coverage(recording: Recording, boxes: matching.Detections) -> tuple[float, float] | None:
    if recording.shown is None:
        return None
    drawn = recording.shown != 0
    if recording.previous_shown is not None:
        drawn = drawn | (recording.previous_shown != 0)
    return metrics.coverage(boxes, (recording.shown & SPRITES) > 0, drawn)


def _ocatari_agreement(methods: dict[str, OcatariMethod]) -> Agreement | None:
    rem, vem = (methods[name].objects if name in methods else None for name in ("rem", "vem"))
    return None if rem is None or vem is None else metrics.agreement(rem, vem)


# --------------------------------------------------------------------------------------------------
# tables

FLICKER = (
    "Many games draw some objects only on every other frame. REM reports such an object on every "
    "frame, and VEM only on frames that draw it. An object of REM therefore counts as found if VEM "
    "finds it on the frame or on the frame before. An object of VEM must be reported by REM on the "
    "same frame. The single-frame F1 compares only the same frame: for an object that is drawn on "
    "every other frame it is about 67 % even if both methods are right. An object that REM reports "
    "while it is hidden for longer, such as a power pill that blinks slowly, lowers the precision "
    "of its category."
)
COLUMNS = {  # explanations of the tables' columns
    "Objects": "the number of objects that REM reports",
    "Precision": "the fraction of REM's objects that VEM finds, on the frame or the frame before",
    "Recall": "the fraction of VEM's objects that REM reports on the same frame",
    "F1": (
        "the harmonic mean of precision and recall; objects match if they have the same category "
        "and their centres are within 5 pixels"
    ),
    "F1 95 % CI": "the 95 % confidence interval of F1, by resampling episodes",
    "Mean IoU": "the mean intersection over union of the boxes of matched objects",
    "Exact boxes": "the fraction of matched objects with identical boxes",
    "Single-frame F1": "F1 without the frame before",
    "ID switches": "the number of times that an object changes its slot in REM",
    "Overflow": "the number of objects without a slot in VEM",
    "Value accuracy": (
        "the fraction of samples in which REM's score equals the sum of rewards, or its lives "
        "the emulator's"
    ),
    "Sprites covered": "the fraction of sprite pixels inside REM's boxes",
    "Boxes with pixels": "the fraction of REM's boxes with drawn pixels",
    "OCAtari F1": (
        "F1 of OCAtari's REM against OCAtari's VEM on the same frames; the other columns of "
        "OCAtari compare the same two methods"
    ),
}


DETAILS = (  # columns that only files have
    "Episodes",
    "Precision",
    "Recall",
    "F1 95 % CI",
    "Single-frame F1",
    "ID switches",
    "Overflow",
    "Sprites covered",
    "Boxes with pixels",
    *(f"OCAtari {name}" for name in SCORES if name != "F1"),
)


def rows_of(game: Game) -> list[tuple[int | None, str]]:
    """The rows of a table by category: index and name of each, then None and "all"."""
    return [*((i, c.name) for i, c in enumerate(game.categories)), (None, "all")]


def of_category(counts: Agreement, category: int | None) -> Agreement:
    """Sum the counts of one category, or of all, over all frames."""
    return counts.sum() if category is None else counts.sum(axis=0).map(lambda a: a[category])


def scores(counts: Agreement) -> list[Cell]:
    """Return precision, recall, F1 and mean IoU of summed counts, in percent (`SCORES`)."""
    return [percent(v) for v in (counts.precision, counts.recall, counts.f1, counts.mean_iou)]


def percent(share: np.ndarray | float) -> float:
    """Convert a fraction to percent."""
    return 100 * float(share)


def value_accuracy(e: Evaluation, names: Sequence[str]) -> Cell:
    """Return the accuracy of the first of these categories that has a value, in percent."""
    return next((percent(share) for name, share in e.values.items() if name in names), None)


def _interval(e: Evaluation, category: int | None) -> Cell:
    """Return the 95 % confidence interval of F1 over episodes."""
    counts = (
        e.flicker_aware.sum(axis=1)
        if category is None
        else e.flicker_aware.map(lambda a: a[:, category])
    )
    low, high = (
        float(np.ravel(v)[0]) for v in metrics.intervals(counts, e.episode, lambda a: a.f1)
    )
    return None if math.isnan(low) else f"{100 * low:.1f}-{100 * high:.1f}"


def _agreement_cells(counts: Agreement, interval: Cell = None) -> dict[str, Cell]:
    precision, recall, f1, mean_iou = scores(counts)
    return {
        "Objects": int(counts.left),
        "Precision": precision,
        "Recall": recall,
        "F1": f1,
        "F1 95 % CI": interval,
        "Mean IoU": mean_iou,
        "Exact boxes": percent(counts.exact_rate),
    }


def _table(title: str, rows: Sequence[dict[str, Cell]]) -> Table:
    """A table of rows with equal columns."""
    header = list(rows[0]) if rows else []
    return Table(title, header, [list(row.values()) for row in rows], DETAILS)


@functools.cache
def by_category(e: Evaluation) -> Table:
    """A table with one row per category of a game and one for all of them together."""
    title = f"{e.game.name}: REM against VEM in percent; {e.source}"
    return _table(title, [_category_row(e, i, name) for i, name in rows_of(e.game)])


def _category_row(e: Evaluation, category: int | None, name: str) -> dict[str, Cell]:
    counts = of_category(e.flicker_aware, category)
    row: dict[str, Cell] = {
        "Category": name,
        **_agreement_cells(counts, _interval(e, category)),
        "Single-frame F1": percent(of_category(e.single_frame, category).f1),
        "ID switches": None if e.switches is None else _count(e.switches[0], category),
        "Overflow": _count(e.overflow, category),
        "Value accuracy": value_accuracy(e, [name]),
    }
    if e.ocatari:
        theirs = e.ocatari_agreement
        found = [None] * len(SCORES) if theirs is None else scores(of_category(theirs, category))
        row |= {f"OCAtari {name}": cell for name, cell in zip(SCORES, found, strict=True)}
    return row


@functools.cache
def by_situation(e: Evaluation) -> Table:
    """A table of samples at starts and ends of episodes and just after lost lives."""
    rows = []
    for name, samples in e.situations.items():
        if samples.any():
            counts, single = (
                a.map(lambda v, samples=samples: v[samples]).sum()
                for a in (e.flicker_aware, e.single_frame)
            )
            row = {"Situation": name, "Samples": int(samples.sum()), **_agreement_cells(counts)}
            rows.append({**row, "Single-frame F1": percent(single.f1)})
    return _table(f"{e.game.name}: first and last states and lost lives, in percent", rows)


def _count(counts: np.ndarray, category: int | None) -> int:
    return int(counts.sum() if category is None else counts[category])


def tables_of(e: Evaluation) -> list[Table]:
    """Return the tables of one game: by category and, if there are situations, by situation."""
    return [t for t in (by_category(e), by_situation(e)) if t.rows]


WITHOUT_MEAN = ("Game", "Samples", "Episodes", "Objects", "F1 95 % CI")


def overview(evaluations: Sequence[Evaluation]) -> Table:
    """A table with one row per game and, for several games, their mean."""
    rows = [_game_row(e) for e in evaluations]
    if len(rows) > 1:
        means = {
            name: None if name in WITHOUT_MEAN else _mean([row[name] for row in rows])
            for name in rows[0]
        }
        rows.append(means | {"Game": "mean"})
    return _table("REM against VEM in percent", rows)


def _game_row(e: Evaluation) -> dict[str, Cell]:
    covered, with_pixels = e.coverage or (None, None)
    theirs = None if e.ocatari_agreement is None else e.ocatari_agreement.sum()
    score, lives = (
        value_accuracy(e, with_role(e.game.categories, role)) for role in ("score", "lives")
    )
    return {
        "Game": e.game.name,
        "Samples": len(e.episode),
        "Episodes": len(np.unique(e.episode)),
        **_agreement_cells(e.flicker_aware.sum(), _interval(e, None)),
        "Score": score,
        "Lives": lives,
        "Sprites covered": None if covered is None else percent(covered),
        "Boxes with pixels": None if with_pixels is None else percent(with_pixels),
        "OCAtari F1": None if theirs is None else percent(theirs.f1),
        "OCAtari Mean IoU": None if theirs is None else percent(theirs.mean_iou),
    }


def _mean(cells: Sequence[Cell]) -> Cell:
    numbers = [c for c in cells if isinstance(c, float) and is_number(c)]
    return sum(numbers) / len(numbers) if numbers else None


def notes(e: Evaluation) -> list[str]:
    """Notes on OCAtari's methods: whether they run, and how long they take."""
    out = []
    for method, m in e.ocatari.items():
        name = f"{e.game.name}: OCAtari's {method.upper()}"
        out.append(
            f"{name} does not run here ({m.error})"
            if m.objects is None
            else f"{name} takes {np.median(m.us):.1f} us per frame"
        )
    return out
