"""Objects in the slots of OCAtari 2.2.1."""

from collections.abc import Sequence

from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects
from ocjax.layouts import declared_slots, places
from ocjax.transforms.game_objects import GameObject, NoObject, object_class, slots


class SlotTable:
    """The slots of `OCAtari.objects` in one game: OCAtari's, or ocjax's if OCAtari has no table.

    Args:
        game: the game, with its HUD.
        hud: whether display objects are included.

    Attributes:
        counts: the number of slots of each category, in OCAtari's order.
        meaning: the meaning of each slot's numbers in `ns_state`.
    """

    def __init__(self, game: Declaration, hud: bool) -> None:
        self.game, self.hud = game, hud
        self.counts = declared_slots(game, hud) or {
            c.name: c.count for c in game.categories if hud or not c.hud
        }
        classes = [
            object_class(game, name) for name, count in self.counts.items() for _ in range(count)
        ]
        self.meaning = [f"{kind.__name__} ({list(kind.ns_meaning)})" for kind in classes]
        self._classes = classes
        # For each category: its slots in ocjax, its number of slots and its class in OCAtari, and
        # the length of `nsrepr`.
        self._places = []
        for name, place in places(game, self.counts).items():
            kind = object_class(game, name)
            slot_numbers = range(place.start, place.stop)
            self._places.append((slot_numbers, self.counts[name], kind, len(kind().nsrepr)))

    def empty(self) -> list[GameObject]:
        """One object of each slot's class, with zeros."""
        return [kind() for kind in self._classes]

    def arrange(self, now: Objects, before: Objects | None) -> list[GameObject]:
        """The objects of one state in OCAtari's slots, followed by objects without such a slot.

        If OCAtari has enough slots for a category, its objects keep ocjax's slots. Otherwise the
        first present objects fill OCAtari's slots. Objects in OCAtari's slots have OCAtari's names.

        Args:
            before: the objects of the previous step, or None in the first state of an episode.
        """
        own, out, placed = slots(now, before), [], set()
        for place, count, kind, length in self._places:
            chosen = place if len(place) <= count else [i for i in place if own[i]][:count]
            out += [_named(own[i], kind) for i in chosen]
            out += [NoObject(length) for _ in range(count - len(chosen))]
            placed.update(chosen)
        return out + [
            o for i, o in enumerate(own) if o and i not in placed and (self.hud or not o.hud)
        ]

    def ns_state(self, objects: Sequence[GameObject]) -> list[int]:
        """The concatenated numbers of the slots, without the objects that follow."""
        return [number for o in objects[: len(self.meaning)] for number in o.nsrepr]


def _named(own: GameObject, kind: type[GameObject]) -> GameObject:
    return own if not own or type(own) is kind else kind(**vars(own))
