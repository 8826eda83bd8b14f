"""Variations of sports and ball games."""

from collections.abc import Mapping
from functools import partial

from ocjax.emulators.variations.mechanism import Variation

_BLACK, _WHITE, _RED, _BLUE, _GREEN = 0, 12, 48, 113, 200  # colours of the console
_COLORS = {"black": _BLACK, "white": _WHITE, "red": _RED, "blue": _BLUE, "green": _GREEN}
_EVERY_8 = range(0, 256, 8)  # values of a frame counter
_EVERY_4 = range(0, 256, 4)


def _moved(by: int, values: range) -> dict[int, int]:
    return {v: v + by for v in values}


_boxing = partial(Variation, "Boxing")
_CLOSE = 14  # columns from the player to an enemy that it touches
_STEPS = (  # of the boxer: to the right unless the enemy is in the way, to the left, up, down
    _boxing(
        "A step to the right.",
        parts=tuple(
            _boxing(
                "A step to the right.",
                {32: x + 1},
                when={32: (x,), 33: [e for e in range(256) if e != x + _CLOSE]},
            )
            for x in reversed(range(1, 109))
        ),
    ),
    _boxing("A step to the left.", replaces={32: _moved(-1, range(1, 109))}),
    _boxing("A step up.", replaces={34: _moved(-1, range(1, 87))}),
    _boxing("A step down.", replaces={34: _moved(1, range(1, 87))}),
)
BOXING = {
    **{
        f"color_player_{name}": _boxing(f"The player is {name}.", {1: color})
        for name, color in _COLORS.items()
    },
    **{
        f"color_enemy_{name}": _boxing(f"The enemy is {name}.", {2: color})
        for name, color in _COLORS.items()
    },
    "drunken_boxing": _boxing(
        "The player also takes a step in a random direction in every frame.", choices=_STEPS
    ),
    "switch_positions": _boxing(
        "Player and enemy begin in each other's corner.",
        {32: 105, 33: 30, 34: 85, 35: 4},
        frames=range(2),
    ),
    "one_armed": _boxing("The player cannot hit with the right arm.", {101: 128}),
    "gravity": _boxing(
        "The player is drawn to the bottom of the ring.",
        replaces={34: _moved(1, range(87))},
        when={0: _EVERY_4},
    ),
}

_breakout = partial(Variation, "Breakout")
BREAKOUT = {
    **{
        f"color_all_blocks_{name}": _breakout(
            f"All blocks are {name}.", dict.fromkeys(range(64, 70), color)
        )
        for name, color in _COLORS.items()
    },
    **{
        f"color_player_and_ball_{name}": _breakout(f"Player and ball are {name}.", {62: color})
        for name, color in _COLORS.items()
    },
    "right_drift": _breakout(
        "The ball drifts to the right.",
        replaces={99: _moved(2, range(55, 198))},
        when={101: range(188), 90: _EVERY_8},
    ),
    "left_drift": _breakout(
        "The ball drifts to the left.",
        replaces={99: _moved(-2, range(59, 202))},
        when={101: range(188), 90: _EVERY_8},
    ),
    "gravity": _breakout(
        "The ball is drawn downwards.",
        replaces={101: _moved(2, range(88, 164))},
        when={90: _EVERY_8},
    ),
    "inverse_gravity": _breakout(
        "The ball is drawn upwards.",
        replaces={101: _moved(-2, range(92, 183))},
        when={90: _EVERY_8},
    ),
}

_dunk = partial(Variation, "DoubleDunk")
_SHIRTS = ("white", "green", "red", "yellow", "purple", "blue")
DOUBLE_DUNK = {
    **{
        f"player_color_{name}": _dunk(f"The player's team is {name}.", {94: i})
        for i, name in enumerate(_SHIRTS)
    },
    **{
        f"enemy_color_{name}": _dunk(f"The enemy's team is {name}.", {95: i})
        for i, name in enumerate(_SHIRTS)
    },
}

_derby = partial(Variation, "FishingDerby")
_FISH = range(69, 75)  # positions of fish
FISHING_DERBY = {
    "shark_no_movement_easy": _derby("The shark stays in the opponent's half.", {75: 105}),
    "shark_no_movement_hard": _derby("The shark stays in the player's half.", {75: 25}),
    "shark_teleport": _derby(
        "The shark jumps from one side of the water to the other.",
        replaces={75: {100: 25, 30: 105}},
    ),
    "shark_speed_mode": _derby(
        "The shark swims fast and to the right.",
        replaces={75: _moved(5, range(120)) | dict.fromkeys(range(121, 256), 1)},
    ),
    "fish_on_player_side": _derby(
        "The fish stay in the player's half.",
        replaces={a: dict.fromkeys(range(87, 256), 44) for a in _FISH},
    ),
    "fish_in_middle": _derby(
        "Fish stay between the two anglers.",
        replaces={
            a: dict.fromkeys(range(70), 86) | dict.fromkeys(range(87, 256), 70) for a in _FISH
        },
    ),
}

_pong = partial(Variation, "Pong")
_IN_PLAY = range(1, 256)  # positions of a visible ball
PONG = {
    "lazy_enemy": _pong(
        "The enemy stays in the middle of the court.", {21: 127}
    ),  # the position that it moves to
    "parallel_enemy": _pong("The enemy is at the player's height.", copies={21: 60}),
    "up_drift": _pong(
        "The ball drifts upwards.", replaces={54: _moved(-1, _IN_PLAY)}, when={8: _EVERY_4}
    ),
    "down_drift": _pong(
        "The ball drifts downwards.", replaces={54: _moved(1, _IN_PLAY[:-1])}, when={8: _EVERY_4}
    ),
    "right_drift": _pong(
        "The ball drifts to the right.", replaces={49: _moved(1, _IN_PLAY[:-1])}, when={8: _EVERY_4}
    ),
    "left_drift": _pong(
        "The ball drifts to the left.", replaces={49: _moved(-1, _IN_PLAY)}, when={8: _EVERY_4}
    ),
}

SKIING = {
    "invert_flags": Variation(
        "Skiing",
        "The flags of the gates have another colour.",
        parts=tuple(
            Variation("Skiing", "One object.", {78 + i: 4}, when={70 + i: (2,)}) for i in range(8)
        ),  # an object of kind 2 is a gate
    )
}

_tennis = partial(Variation, "Tennis")
_CALM = _tennis("No gust.")
_WIND = _tennis(
    "A gust.",
    replaces={
        16: _moved(1, range(3, 155)),
        54: _moved(1, range(50, 179)),
        55: _moved(1, range(255)),
    },  # ball, and its shadow
    when={15: range(11, 140), 16: range(3, 155), 54: range(50, 179)},
)
TENNIS = {
    "wind_effect": _tennis(
        "A wind from the lower left moves the ball in every second frame, at random.",
        choices=(_WIND, _CALM),
    ),
    "always_lower_player": _tennis(
        "The player plays in the lower half of the court in all games.", {80: 1}
    ),
    "always_upper_player": _tennis(
        "The player plays in the upper half of the court in all games.", {80: 0}
    ),
    "always_lower_pitches": _tennis(
        "The lower player serves in all games.", {15: 7, 74: 1}, when={15: (142,)}
    ),
    "always_upper_pitches": _tennis(
        "The upper player serves in all games.", {15: 142, 74: 0}, when={15: (7,)}
    ),
}

GAMES: Mapping[str, Mapping[str, Variation]] = {
    "Boxing": BOXING,
    "Breakout": BREAKOUT,
    "DoubleDunk": DOUBLE_DUNK,
    "FishingDerby": FISHING_DERBY,
    "Pong": PONG,
    "Skiing": SKIING,
    "Tennis": TENNIS,
}
