"""The variations of each game."""

from collections.abc import Iterator, Mapping
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
    "Atlantis": ATLANTIS,
    "BankHeist": BANK_HEIST,
    "Boxing": BOXING,
    "Breakout": BREAKOUT,
    "Carnival": CARNIVAL,
    "ChopperCommand": CHOPPER_COMMAND,
    "DemonAttack": DEMON_ATTACK,
    "DonkeyKong": DONKEY_KONG,
    "DoubleDunk": DOUBLE_DUNK,
    "FishingDerby": FISHING_DERBY,
    "Freeway": FREEWAY,
    "Frostbite": FROSTBITE,
    "Kangaroo": KANGAROO,
    "KungFuMaster": KUNG_FU_MASTER,
    "MontezumaRevenge": MONTEZUMA_REVENGE,
    "MsPacman": MS_PACMAN,
    "NameThisGame": NAME_THIS_GAME,
    "Pong": PONG,
    "Riverraid": RIVERRAID,
    "Seaquest": SEAQUEST,
    "Skiing": SKIING,
    "SpaceInvaders": SPACE_INVADERS,
    "Tennis": TENNIS,
    "Venture": VENTURE,
    "YarsRevenge": YARS_REVENGE,
}
