"""Variations of games in mazes, on roads and on platforms."""

from collections.abc import Mapping
from functools import partial

from ocjax.emulators.variations.mechanism import Variation

ALIEN = {
    "no_alien": Variation(
        "Alien",
        "There are no aliens in the maze.",
        dict.fromkeys(range(42, 45), 0) | dict.fromkeys(range(49, 52), 0),
    )
}

_amidar = partial(Variation, "Amidar")
_MOVERS = range(73, 80)  # bit 32 is set for an enemy, and bit 16 for the second picture
AMIDAR = {
    "change_enemy": _amidar(
        "Enemies have their other picture.",
        replaces={a: {v: v | 16 for v in range(256) if v & 32} for a in _MOVERS},
    ),
    "change_player": _amidar(
        "The player has the other picture.",
        replaces={a: {v: v | 16 for v in range(256) if not v & 32} for a in _MOVERS},
    ),
}

_asterix = partial(Variation, "Asterix")


def _free(lanes: range) -> dict[int, int]:
    """Writes that empty lanes of Asterix."""
    return {73 + i: i + 1 for i in lanes} | {18 - i: 11 for i in lanes}


ASTERIX = {
    "obelix": _asterix("The player is Obelix, as in a later round.", {54: 5}),
    "set_consumable_1": _asterix("What is collected is that of the second round.", {54: 1}),
    "set_consumable_2": _asterix("What is collected is that of the third round.", {54: 2}),
    "unlimited_lives": _asterix("The lives do not run out.", {83: 3}),
    "even_lines_free": _asterix(
        "Every second lane, from the second, is empty.", _free(range(1, 9, 2))
    ),
    "odd_lines_free": _asterix(
        "Every second lane, from the first, is empty.", _free(range(0, 8, 2))
    ),
}

_heist = partial(Variation, "BankHeist")
_BANK, _POLICE = 253, 254  # objects at a place of the maze
BANK_HEIST = {
    "unlimited_gas": _heist("The fuel does not run out.", {86: 0}),
    "no_police": _heist(
        "There are no police cars.", replaces={a: {_POLICE: 0} for a in range(24, 27)}
    ),
    "random_city": _heist("The next city is a random one.", draws={0: range(256)}, changed=(0,)),
    "revisit_city": _heist(
        "The left exit leads to the previous city.",
        keeps=(0,),
        replaces={0: {v: (v - 1) % 256 for v in range(256)}},
        when={28: range(121, 256)},
        before={28: range(16)},
    ),
    "only_police": _heist(
        "Police cars are where banks would be.",
        replaces={a: {_BANK: _POLICE} for a in range(24, 27)},
    ),
}

_kong = partial(Variation, "DonkeyKong")
# Positions of Mario.
_PLACES = (
    (49, 154),
    (110, 154),
    (49, 127),
    (111, 132),
    (111, 99),
    (50, 71),
    (53, 48),
    (111, 43),
    (111, 21),
)
_MARIO = tuple(
    _kong("One place.", {19: x, 27: y}, when={16: (0,)}) for x, y in _PLACES
)  # on the first board
DONKEY_KONG = {
    "random_start": _kong(
        "Each life begins at a random place of the first board.",
        choices=_MARIO,
        frames=range(1),
        parts=(_kong("Another life.", choices=_MARIO, changed=(35,)),),
    ),
    "no_barrel": _kong("There are no barrels.", {25: 255}),
    "unlimited_time": _kong("The bonus does not run out.", {36: 70}),
}

_freeway = partial(Variation, "Freeway")
_WAITS = range(33, 43)  # frames until a car moves
_STOP, _GO = 100, 0
_ONE_CAR = tuple(_freeway("One car.", {a: value}) for a in _WAITS for value in (*[_STOP] * 9, _GO))
_ALL_CARS = tuple(
    _freeway("All cars.", dict.fromkeys(_WAITS, value)) for value in (_GO, _GO, _GO, _STOP, _STOP)
)
FREEWAY = {
    "align_all_cars": _freeway(
        "In each frame either all cars move or all stop, which is random.", choices=_ALL_CARS
    ),
    "stop_random_car": _freeway(
        "In each frame a random car stops, or now and then moves.", choices=_ONE_CAR
    ),
    "stopped_cars": _freeway(
        "The cars stand still on a diagonal, each further to the right than the car in the lane "
        "above.",
        dict(zip(range(108, 118), range(150, 10, -14), strict=True))
        | dict.fromkeys(range(33, 43), 2),  # positions from the bottom, frames to wait
    ),
    "stop_all_cars": _freeway(
        "The cars stand still at the edges of the screen.",
        dict.fromkeys(range(33, 43), 100)
        | dict.fromkeys(range(108, 113), 15)
        | dict.fromkeys(range(113, 118), 150),
    ),
    **{
        f"all_{name}_cars": _freeway(f"All cars are {name}.", dict.fromkeys(range(77, 87), color))
        for name, color in {"black": 0, "white": 15, "red": 66, "green": 210, "blue": 145}.items()
    },
}

_frostbite = partial(Variation, "Frostbite")
_STANDING = {22: 0}
FROSTBITE = {
    "reposition_floes_easy": _frostbite(
        "The floes stand still, below each other.", _STANDING | dict.fromkeys(range(31, 35), 80)
    ),
    "reposition_floes_medium": _frostbite(
        "The floes stand still, each row 30 pixels further to the right.",
        _STANDING | {31 + i: 110 + 30 * i for i in range(4)},
    ),
    "reposition_floes_hard": _frostbite(
        "The floes stand still, each row 20 pixels further to the right.",
        _STANDING | {31 + i: 100 + 20 * i for i in range(4)},
    ),
    **{
        f"ui_color_{name}": _frostbite(
            f"The score, the temperature and the number of lives are {shown}.", {71: color}
        )
        for name, color, shown in (("black", 200, "black"), ("red", 48, "orange"))
    },
    "no_birds": _frostbite(
        "There are no animals between the floes.", dict.fromkeys(range(92, 96), 0)
    ),
    "few_enemies": _frostbite(
        "There are few animals in each row.", dict.fromkeys(range(92, 96), 5)
    ),
    "many_enemies": _frostbite(
        "There are many animals in each row.", dict.fromkeys(range(92, 96), 15)
    ),
}

_kangaroo = partial(Variation, "Kangaroo")
_FLOORS = {  # position of the kangaroo, and no falling coconut
    f"set_kangaroo_position_floor{i}": _kangaroo(
        f"The kangaroo begins the game on the {where} floor.",
        {17: x, 16: y, 33: 255},
        frames=range(1),
    )
    for i, x, y, where in ((1, 65, 12, "second"), (2, 100, 6, "third"))
}
KANGAROO = {
    **_FLOORS,
    "randomize_kangaroo_position": _kangaroo(
        "The kangaroo begins the game on the second or the third floor.",
        choices=tuple(_FLOORS.values()),
    ),
    "disable_monkeys": _kangaroo("There are no monkeys.", dict.fromkeys(range(8, 12), 127)),
    "disable_coconut": _kangaroo("No coconut falls.", {33: 255, 35: 255}),
    "disable_thrown_coconut": _kangaroo("No coconut is thrown.", {25: 255, 28: 255, 31: 0}),
    "unlimited_time": _kangaroo("The time does not run out.", {59: 32}),
    **{
        f"change_level_{i}": _kangaroo(f"The game is in level {i}, counted from 0.", {36: i})
        for i in range(3)
    },
}

_kungfu = partial(Variation, "KungFuMaster")
KUNG_FU_MASTER = {
    "no_damage": _kungfu("The player's energy stays full.", {75: 39}),
    "infinite_time": _kungfu("The time does not run out.", {27: 32, 28: 1}),
    "infinite_lives": _kungfu("The lives do not run out.", {29: 3}),
}

_mspacman = partial(Variation, "MsPacman")
# Positions of the ghosts.
_CAGE = {
    "orange": {6: 93, 12: 80},
    "cyan": {7: 83, 13: 80},
    "pink": {8: 93, 14: 67},
    "red": {9: 83, 15: 67},
}
_PILLS = range(59, 101)  # one bit per pill
_FEW_PILLS = tuple(
    _mspacman(
        "Pills of one byte.",
        dict.fromkeys([other for other in _PILLS if other != a], 0),
        when={a: range(1, 256)},
    )
    for a in _PILLS
)
MS_PACMAN = {
    "caged_ghosts": _mspacman(
        "All ghosts stay in the middle of the maze.",
        {a: v for place in _CAGE.values() for a, v in place.items()},
    ),
    **{
        f"disable_{name}": _mspacman(f"The {name} ghost stays in the middle of the maze.", place)
        for name, place in _CAGE.items()
    },
    **{
        f"set_level_{i}": _mspacman(f"The game is in level {i}, counted from 0.", {0: i})
        for i in range(3)
    },
    "edible_ghosts": _mspacman(
        "The ghosts are blue and take no life.", dict.fromkeys(range(1, 5), 130) | {116: 255}
    ),
    "end_game": _mspacman(
        "Few pills are left, side by side at a random place.", {117: 0}, choices=_FEW_PILLS
    ),
}

_montezuma = partial(Variation, "MontezumaRevenge")
# Positions in the first room.
_ENTRANCES = (
    (77, 235),
    (88, 192),
    (128, 192),
    (133, 148),
    (33, 148),
    (22, 192),
)
MONTEZUMA_REVENGE = {
    "random_position_start": _montezuma(
        "Lives after the first begin at a random place of the first room.",
        choices=tuple(_montezuma("One place.", {42: x, 43: y}) for x, y in _ENTRANCES),
        when={2: (4,), 3: (1,)},  # the life has begun, in the first room
        before={2: (2,)},
    ),
    "full_inventory": _montezuma("The player has the torch, two swords and three keys.", {65: 249}),
    **{
        f"set_level_{i}": _montezuma(f"The game is in level {i}, counted from 0.", {57: i})
        for i in range(3)
    },
}

_name = partial(Variation, "NameThisGame")
NAME_THIS_GAME = {
    "endless_oxygen": _name("The oxygen does not run out.", {113: 255}),
    "quick_start": _name("The game starts at once.", {65: 10}),
    "double_wave_length": _name(
        "The time of a wave does not run out.",
        parts=(
            _name("The low byte.", {114: 128}, masks={114: 128}, when={114: range(1, 128)}),
            _name(
                "The high byte.", {115: 128}, masks={115: 128}, when={114: (0,), 115: range(128)}
            ),
        ),
    ),
    "octopus_start": _name(
        "Six tentacles have their first piece at once, and a piece is beside the octopus.",
        dict.fromkeys(range(9, 50, 10), 64),
    ),
    "octopus_rest": _name("A piece of the left tentacles is never there.", {9: 0}),
}

_venture = partial(Variation, "Venture")
# Colours of enemies, and the places where one more byte is an enemy's colour.
_ENEMIES, _MORE = (range(37, 42), {90: (8, 9)})
_RAINBOW = (0, 12, 48, 113, 200)
VENTURE = {
    **{
        f"enemy_color_{name}": _venture(
            f"All enemies are {name}.",
            dict.fromkeys(_ENEMIES, color),
            parts=(_venture("One.", {36: color}, when=_MORE),),
        )
        for name, color in zip(("black", "white", "red", "blue", "green"), _RAINBOW, strict=True)
    },
    "random_enemy_colors": _venture(
        "Each enemy has a random colour in every frame.",
        draws=dict.fromkeys(_ENEMIES, _RAINBOW),
        parts=(_venture("One.", draws={36: _RAINBOW}, when=_MORE),),
    ),
}

GAMES: Mapping[str, Mapping[str, Variation]] = {
    "Alien": ALIEN,
    "Amidar": AMIDAR,
    "Asterix": ASTERIX,
    "BankHeist": BANK_HEIST,
    "DonkeyKong": DONKEY_KONG,
    "Freeway": FREEWAY,
    "Frostbite": FROSTBITE,
    "Kangaroo": KANGAROO,
    "KungFuMaster": KUNG_FU_MASTER,
    "MontezumaRevenge": MONTEZUMA_REVENGE,
    "MsPacman": MS_PACMAN,
    "NameThisGame": NAME_THIS_GAME,
    "Venture": VENTURE,
}
