"""Variations of games with shots."""

from collections.abc import Iterator, Mapping
from functools import partial

from ocjax.emulators.variations.mechanism import Variation

_SLOT = range(4)  # Atlantis: ships, with a kind from byte 79 and a speed to the right from byte 75
_BOMBER = 80  # the kind of the fast ship


def _at_speed(others: int, bombers: int) -> tuple[Variation, ...]:
    """Ships of Atlantis with a speed; bombers have another one."""
    kinds = ((others, [*range(_BOMBER), *range(_BOMBER + 1, 256)]), (bombers, [_BOMBER]))
    return tuple(
        Variation(
            "Atlantis",
            "One ship.",
            replaces={
                75 + i: dict.fromkeys(range(1, 128), speed)
                | dict.fromkeys(range(128, 256), 256 - speed)
            },
            when={79 + i: kind},
        )
        for i in _SLOT
        for speed, kind in kinds
    )


_FASTER, _SLOWER = {1: 2, 255: 254}, {2: 1, 254: 255}  # new speeds by old ones


def _bombers() -> Iterator[Variation]:
    """Ships of Atlantis that become bombers."""
    for i in _SLOT:
        kinds = range(1, _BOMBER)
        yield Variation(
            "Atlantis",
            "One ship.",
            replaces={75 + i: _FASTER, 79 + i: dict.fromkeys(kinds, _BOMBER)},
            when={79 + i: kinds},
        )


def _random_ships() -> Iterator[Variation]:
    """Ships of Atlantis of random kinds, with the speeds of their kinds."""
    for i in _SLOT:
        yield Variation(
            "Atlantis",
            "One ship.",
            draws={79 + i: (32, 64, _BOMBER)},
            when={79 + i: range(1, _BOMBER + 1)},
        )
        yield Variation(
            "Atlantis", "One ship.", replaces={75 + i: _SLOWER}, when={79 + i: (32, 64)}
        )
        yield Variation(
            "Atlantis", "One ship.", replaces={75 + i: _FASTER}, when={79 + i: (_BOMBER,)}
        )


_atlantis = partial(Variation, "Atlantis")
ATLANTIS = {
    "no_last_line": _atlantis("No ships fly in the lowest lane.", {36: 0}),
    "jets_only": _atlantis("All ships are the fast one.", parts=tuple(_bombers())),
    "random_enemies": _atlantis(
        "Each ship is of a random kind in every frame.", parts=tuple(_random_ships())
    ),
    "speed_mode_slow": _atlantis("All ships are slow.", parts=_at_speed(2, 3)),
    "speed_mode_medium": _atlantis("All ships have a medium speed.", parts=_at_speed(4, 5)),
    "speed_mode_fast": _atlantis("All ships are fast.", parts=_at_speed(6, 7)),
    "speed_mode_ultrafast": _atlantis("All ships are very fast.", parts=_at_speed(8, 9)),
}

_carnival = partial(Variation, "Carnival")
CARNIVAL = {
    "no_flying_ducks": _carnival("Ducks do not leave the lowest row to fly.", {1: 79}),
    "unlimited_ammo": _carnival("The bullets do not run out.", {3: 40}),
    **{
        f"missile_speed_{name}_increase": _carnival(
            f"The player's bullets are faster by {rows} rows a frame.",
            replaces={55: {v: v - rows for v in range(5, 256)}},
        )
        for name, rows in {"small": 1, "medium": 2, "large": 3}.items()
    },
}

_chopper = partial(Variation, "ChopperCommand")
CHOPPER_COMMAND = {
    "no_enemies": _chopper("There are no enemies.", dict.fromkeys(range(6, 13), 0)),
    "no_radar": _chopper("The radar is empty, and the player and the score are darker.", {118: 37}),
    "invisible_player": _chopper(
        "The player's helicopter is not drawn, and the score is darker.", {118: 38}
    ),
    # The byte is an index into a table of colours.
    "color_black": _chopper("The land is black.", {117: 38}),
    "color_white": _chopper("The land is white.", {117: 40}),
    "color_red": _chopper("The land is red.", {117: 23}),
    "color_blue": _chopper("The land is blue.", {117: 86}),
    "color_green": _chopper("The land is olive.", {117: 48}),
}

_demons = partial(Variation, "DemonAttack")
_MISSILES = range(37, 47)  # rows of missiles, the lowest first


def _x(code: int) -> int:
    """The column of a position in the TIA's coding, from the left edge of a demon's half."""
    fine = code >> 4
    return code % 16 * 15 + (28 if fine > 7 else 12) - fine


# Positions of left halves that are not at the right edge.
_LEFT = tuple(code for code in range(256) if _x(code) <= 127)
_RIGHT = tuple(code for code in range(256) if _x(code) >= 33)


def _held_demons() -> Iterator[Variation]:
    """Whole demons of each row, and the diving one, that stay in their column."""
    for i in range(3):
        whole = {47 + i: range(128, 192), 54 + i: range(128)}  # alive, and not split
        yield _demons(
            "One row.",
            keeps=(13 + i, 17 + i),
            when=whole,
            before={13 + i: _LEFT, 17 + i: _RIGHT} | whole,
        )
    dives = {50: range(64, 256), 51: range(1, 256)}
    yield _demons("The diver.", keeps=(20,), when=dives, before=dives)


DEMON_ATTACK = {
    "static_enemies": _demons("Demons stay in their column.", parts=tuple(_held_demons())),
    "one_missile": _demons(
        "Demons drop about one missile at a time.",
        parts=tuple(
            _demons(
                "Missiles from one row on.",
                {a: 4} | dict.fromkeys(range(a + 1, 47), 0),
                when=dict.fromkeys(range(37, a), (0,)) | {a: range(1, 256)},
            )
            for a in _MISSILES
        ),
    ),
}

_riverraid = partial(Variation, "Riverraid")
RIVERRAID = {
    "red_river": _riverraid("The river is red.", {13: 255}),
    "no_fuel": _riverraid(
        "There are no fuel depots, and the tank stays full.",
        {55: 255},
        replaces={a: {10: 0} for a in range(32, 38)},
    ),
}

_seaquest = partial(Variation, "Seaquest")
_LANES = range(44, 48)  # colours of the enemies; their positions are 14 bytes lower
_OUTSIDE = 200  # a position outside the screen
_INSIDE = tuple(x for x in range(256) if x != _OUTSIDE)
SEAQUEST = {
    "disable_enemies": _seaquest(
        "There are no enemies.", dict.fromkeys(range(36, 40), 0) | {60: 0}
    ),  # under water, and at the surface
    # At the surface the game refills the oxygen. It takes a life if the oxygen is not full and no
    # diver is on board.
    "unlimited_oxygen": _seaquest(
        "The oxygen stays full under water.", {102: 63}, when={97: range(20, 256)}
    ),
    "random_color_enemies": _seaquest(
        "The enemies of each lane have a random colour, and another one whenever they enter the "
        "screen.",
        parts=(
            *(
                _seaquest("One lane.", draws={a: range(256)}, when={a - 14: (_OUTSIDE,)})
                for a in _LANES
            ),
            *(_seaquest("One lane.", keeps=(a,), when={a - 14: _INSIDE}) for a in _LANES),
            _seaquest("The first ones.", draws=dict.fromkeys(_LANES, range(256)), frames=range(1)),
        ),
    ),
    "gravity": _seaquest(
        "The player sinks.",
        replaces={97: {v: v + 1 for v in range(105)}},
        when={1: range(0, 256, 4)},
    ),
}

_invaders = partial(Variation, "SpaceInvaders")
SPACE_INVADERS = {
    "no_shields": _invaders("The cannon has no shields.", dict.fromkeys(range(43, 70), 0)),
    "disable_shield_left": _invaders("There is no left shield.", dict.fromkeys(range(43, 52), 0)),
    "disable_shield_middle": _invaders(
        "There is no middle shield.", dict.fromkeys(range(52, 61), 0)
    ),
    "disable_shield_right": _invaders("There is no right shield.", dict.fromkeys(range(61, 70), 0)),
    "relocate_shields_slight_left": _invaders(
        "The shields are slightly further to the left.", {27: 35}
    ),
    "relocate_shields_off_by_one": _invaders(
        "The shields are one column further to the right.", {27: 44}
    ),
    "relocate_shields_right": _invaders("The shields are further to the right.", {27: 53}),
    "controlable_missile": _invaders("The cannon's missile follows the cannon.", copies={87: 28}),
}

YARS_REVENGE = {
    "static": Variation(
        "YarsRevenge", "The enemy and its shield stay at one height.", {26: 37, 42: 90}
    )
}

GAMES: Mapping[str, Mapping[str, Variation]] = {
    "Atlantis": ATLANTIS,
    "Carnival": CARNIVAL,
    "ChopperCommand": CHOPPER_COMMAND,
    "DemonAttack": DEMON_ATTACK,
    "Riverraid": RIVERRAID,
    "Seaquest": SEAQUEST,
    "SpaceInvaders": SPACE_INVADERS,
    "YarsRevenge": YARS_REVENGE,
}
