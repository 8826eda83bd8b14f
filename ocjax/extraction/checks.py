"""`Checks`: how a game differs from what the tests of all games expect."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

__all__ = ["EXCERPTS", "USUAL", "Checks", "LivesAsIcons", "LivesAsNumber"]

EXCERPTS = ("samples", "modes", "last", "lost")  # keys of `Checks.agreement`


@dataclass(frozen=True)
class LivesAsIcons:
    """Categories that show one object for each life, such as houses to defend.

    Args:
        categories: their names; the objects of all of them count together.
        hidden: number of lives without an object; -1 if the last object is no life.
        between_lives: whether the game shows them only before a life begins.
        early: number of samples that show a change of the lives before the emulator counts it.
    """

    categories: tuple[str, ...]
    hidden: int = 0
    between_lives: bool = False
    early: int = 0


@dataclass(frozen=True)
class LivesAsNumber:
    """A category with the value `sign * lives + offset`, such as the number of the ball.

    Args:
        category: its name.
        sign: -1 if the value grows when a life is lost.
        offset: the value without lives.
        early: as for `LivesAsIcons`.
    """

    category: str
    sign: int = 1
    offset: int = 0
    early: int = 0

    @property
    def categories(self) -> tuple[str, ...]:
        """The name of the category."""
        return (self.category,)


@dataclass(frozen=True)
class Checks:
    """How a game differs from what the tests of all games expect.

    A game file states the reason beside each argument.

    Args:
        agreement: least F1 of REM and VEM on a kind of recorded states, if below the usual:
            "samples" (0.99; 0.98 if a category blinks), "modes", "last" (of an episode) and "lost"
            (after a lost life; 0.97 each).
        rare: the categories that the recording in `tests/data/rare` shows.
        at_limits: for each category, its values in the recording in `tests/data/edges`, with 0 for
            no object. A pair holds REM's and VEM's value, if these differ.
        lives: how the game shows the lives, if no category has both their role and their value.
        returns: how the sum of the rewards since the episode began follows from the objects.
            "score": a category with this role shows it. A function takes REM's objects `[B]` and
            gives the sums, int `[B]`. "unknown": it does not follow.
        unscored: number of samples whose screen hides a score that is not 0.
        miscounted: by category, the number of states of all modes whose value differs from the
            score or the lives.
        known: by category, the least fraction of VEM's objects with a known value, if below 0.9; 0
            if VEM never reads the value.
        value_error: by category, the largest difference of VEM's and REM's value.
        moved: largest fraction of boxes that still overlap an object of their category after a
            shift.
        mirrored: by category, the largest fraction of pictures with the orientation of their mirror
            images, if above 0.01; None if no picture and its mirror image are recorded.
        saver_hides: the categories that the screen saver draws in the colour of their background.
        terrain_differs: number of recorded states with different terrain in RAM and pixels, because
            pictures of edited states may show a part of another room.
    """

    agreement: Mapping[str, float] = field(default_factory=dict)
    rare: tuple[str, ...] = ()
    at_limits: Mapping[str, tuple[int | tuple[int, int], ...]] = field(default_factory=dict)
    lives: tuple[LivesAsIcons | LivesAsNumber, ...] = ()
    returns: Callable[[Any], Any] | Literal["score", "unknown"] = "score"
    unscored: int = 0
    miscounted: Mapping[str, int] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)
    value_error: Mapping[str, int] = field(default_factory=dict)
    moved: float = 0.1
    mirrored: Mapping[str, float | None] = field(default_factory=dict)
    saver_hides: tuple[str, ...] = ()
    terrain_differs: int = 0

    @property
    def names(self) -> set[str]:
        """The names of all categories that the arguments mention."""
        by_category = (
            self.at_limits,
            self.miscounted,
            self.known,
            self.value_error,
            self.mirrored,
        )
        shown = (name for part in self.lives for name in part.categories)
        named = (*self.rare, *self.saver_hides)
        return {*named, *shown, *(n for part in by_category for n in part)}


USUAL = Checks()  # of a game without differences
