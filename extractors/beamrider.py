"""Beam Rider: a ship on five beams; saucers and other enemies come down the beams.

Picture: docs/games/BeamRider.png

Screen: the beams' lines and dots and the maker's name are scenery. The sentinel passes above the
beams at the end of a sector.

Slots: the game keeps eight records: three for saucers, four for other enemies, one for the player's
shot. Each category has a slot for every record that may hold one of its objects. A hit object
becomes an Explosion, then Sparks.

RAM: ALE's source (score, lives), OCAtari 2.2 (records), and the ROM's code. A table gives the
screen line for a record's depth. A product of line and lane gives the column. State and depth give
the picture.

Timeline of the display list, by `Ram.half`:
    0 or 255     the list is new: a copy of the records, which have made a step since; `decode`
                 reverts that step by the record's state, its speed or script, and the counter of
                 steps
    other        the list is drawn: only the saucers, and records that follow them sideways, have
                 made a step since

Covered: sectors 1 to 20, all enemies, deaths, game over, the sentinel.

Not exact: the step of a record on a change of state; the choice between two near objects when the
game moves one by a few lines or skips it on a frame; enemies other than saucers on the frame of the
hit; the last frame of a torpedo.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    Icons,
    KindEntry,
    Kinds,
    LivesAsIcons,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    ShortRuns,
    Variants,
    among,
    bcd,
    bits,
    box,
    byte,
    choose,
    display,
    flag,
    lookup,
    match,
    packed_position,
    reached,
    signed_nibble,
    when,
)

ROM = Rom("beam_rider", "79ab4123a83dc11d468fb2108ea09e2e")
FONT = ROM.font(0x3, rows=8)
NARROW_FONT = ROM.font(0x3, rows=8, dots=6, shift=1, pitch=6)  # the same without margins

# States of a record; they are also the numbers of its pictures. `ENEMIES` has the enemies' states.
BLOCKER_ASIDE = 4
BLOCKER_FALLING = 5
BURST_STATES = range(6, 12)
EXPLOSION = range(6, 10)
SPARKS = range(10, 12)
CHARGER_WAITING = 15
PER_SIZE = 4  # pictures of an enemy that grows, by nearness
CHIRPER_FIRST = 28
CHIRPER_TURNED = range(30, 32)
CRAFT_ASIDE = 32
CRAFT_FALLING = 33
CRAFT_RISING = 34
ENEMY_STATES = 35  # the first state after the enemies' states
LASER_SHOT = 35
TORPEDO = range(36, 39)
DISK = 39  # a distant saucer
PICTURE_COUNT = 45  # five larger ones follow
# In the records of the saucers, the first states have other meanings.
SAUCER_STATES = range(1, 6)
SAUCER_SCRIPTED = range(4, 6)
SAUCER_LEAVING = 1
SAUCER_LEFT = 2
SAUCER_RIGHT = 3

COLORS = ROM.bytes(0x1D8E, ENEMY_STATES)  # by picture
JUST_HIT = 8  # timer of a burst on the frame of the hit, which still shows the target
STRUCK_SHOT = 192  # the player's shot on that frame
SHIP_EXPLODES = 19  # picture of the ship
FRESH_LISTS = (0, 255)  # `half` while the list is new
LOST = 255  # `ship_lost`
NEGATIVE = 128  # least value of a counter below 0: no spare ships, no enemies
MIDDLE = 128  # lane
BURST_STEP = -2  # of a burst, along the beams

# Ranges of the records.
SAUCERS = slice(0, 3)
OTHERS = slice(3, 7)
SEVEN = slice(0, 7)
SHOT_RECORD = 7

# The saucers' script: operation and speed. Operations 0 and 1 move to the side.
SCRIPT_OPS = ROM.bytes(0xD96, 216) & 7
SCRIPT_PACES = ROM.bytes(0xE6E, 216)
RISE = 2
FALL = 3


class Speed:  # signed nibble of pixels per step, then a nibble of sixteenths
    SAUCER_LEAVES = 0xB3
    CHARGER_STARTS = 0x08
    CHARGER_RETURNS = 0x8D
    CRAFT_RISES = 0xE0  # minus the sector's speed
    # added to the sector's speed
    ROCK = 0x0C
    BLOCKER_FALLS = 0x0E
    ENEMY = 0x13
    DEBRIS = 0x2D
    CRAFT_FALLS = 0xFB


HORIZON = 32  # depth at which the beams begin
NEAREST = 210  # depth at which they end
GROUND = 164  # row of line 0
LINES = ROM.bytes(0x1EEF, 256) + 2  # by depth
DOT_SCALE = 84  # of the distance from the middle, at the horizon, in 128ths
LINE_SCALE = 0xC6  # of the distance from the middle, at line 0, in 128ths
# Least depths of the next larger picture.
SAUCER_GROWS = (0x30, 0x50, 0x70, 0x90, 0xB8)
ENEMY_GROWS = (0x68, 0x90, 0xB0)
TORPEDO_GROWS = (0x4E, 0x80)
# A laser shot that has left the beams stays in the list, at one of these lines.
LASER_LEAVES = (101, 104)
LASER_LEFT = 102  # its depth then
LASER_STEP = 8  # of the player's shots, also of torpedoes

# Tables of pages and low bytes. The top row is 2 bytes before that, the other 7 before it.
PAGES = ROM.bytes(0x1CE8, PICTURE_COUNT) & 15
LOW_BYTES = ROM.bytes(0x11D8, PICTURE_COUNT)
PICTURES = ROM.pictures((PAGES << 8 | LOW_BYTES - 2 - 7).tolist(), 8)

YELLOW = 26
LASER_COLOR = 54
FIELD = (0, 44, 160, 164)
SCORE = NumberDisplay(FONT, right=108, top=10, digits=6, leading_zeros=True)
ENEMIES_LEFT = NumberDisplay(NARROW_FONT, right=31, top=32, digits=2)
WRECK = 70  # an exploding ship
DISK_COLORS = (8, 14)  # far and near saucers
NEAR = 94  # least depth of a saucer in the second colour
TORPEDOES_LEFT = Icons(left=128, top=32, size=(4, 8), pitch=8, count=3)


class Ram(RamMap):
    sector = bcd(0)
    sector_ones = bits(0, count=4)  # its last digit
    clock = bits(1, count=4)  # steps
    drift = byte(4)  # speed of the saucers
    speed = byte(7)  # of the other enemies
    spare_ships = byte(5)  # 128 or more: none
    score = bcd((11, 10, 9))
    ship = bits(14, first=3, count=5)  # picture
    ship_position = byte(15)  # as HMP0 and the positioning loop take it
    script_at = byte(17, 18, 19)  # the saucers' places in the script
    y = byte(*range(25, 32))  # depth: 0 horizon, 255 none
    shot_y = byte(32)  # depth
    x = byte(*range(33, 40))  # lane, 128 in the middle
    shot_x = byte(40)  # lane
    state = bits(*range(42, 49), count=6)
    follows = flag(*range(42, 49), bit=6)  # moves sideways with the saucers
    back = flag(*range(42, 49), bit=7)  # on its way back
    shot = byte(49)  # state of the player's shot
    timer = byte(*range(50, 57))  # frames, or speed to the side
    sentinel_x = byte(52)
    torpedoes = byte(83)
    enemies = byte(84)  # left in this sector; 255 while the sentinel passes
    list_color = byte(*range(85, 92))
    list_line = byte(*range(93, 100))
    half = byte(101)  # 0 or 255: the list is new, and not drawn yet
    ship_lost = byte(103)  # 255 on the frame that replaces the ship by a spare one


def decode(m: Ram) -> dict[str, Box]:
    x, y = _drawn_places(m)
    picture = _drawn_pictures(m, y)
    shot_y, shot_picture, laser = _shot_as_drawn(m)
    all_x = jnp.append(x, m.shot_x)
    all_y = jnp.append(y, shot_y)
    # Many categories share this. Without it REM takes 0.18 instead of 0.16 us a state.
    drawn = _picture_box(all_x, all_y, jnp.append(picture, shot_picture))
    colored = replace(drawn[SEVEN], color=lookup(COLORS, picture))
    shot = drawn[SHOT_RECORD].where(shot_y < NEAREST - 3)
    kind = m.state[OTHERS]
    burst = colored.where(_bursting(m))
    return {
        "Player": _player(m),
        "Saucer": _saucer_boxes(m, drawn, x, y),
        **ENEMIES.split(drawn[OTHERS], kind),
        "Enemy_Projectile": colored[OTHERS].where(among(kind, ENEMY_SHOTS.values)),
        "Explosion": burst.where(among(picture, EXPLOSION)),
        "Sparks": burst.where(among(picture, SPARKS)),
        "Player_Projectile": shot.where(laser),
        "Torpedos": shot.where(among(m.shot, TORPEDO)),
        "Sentinel": _sentinel(m),
        "Torpedos_Available": _spare_torpedo_boxes(m),
        "Enemy_Amount": ENEMIES_LEFT.box(m.enemies, valid=m.enemies < NEGATIVE),
        "Score": SCORE.box(m.score),
        "Sector": box(60, 21, jnp.where(m.sector_ones == 1, 46, 47), 8, value=m.sector),
        "Life": _spare_ship_boxes(m),
    }


def _player(m: Ram) -> Box:
    wrecked = m.ship == SHIP_EXPLODES
    sunk = when(wrecked, 4)
    color = jnp.where(wrecked, WRECK, YELLOW)
    return box(packed_position(m.ship_position) + 9, 164 + sunk, 15, 16 - sunk, color=color)


def _sentinel(m: Ram) -> Box:
    way = m.sentinel_x - 7
    x = 9 + (way + (way >> 2) + (way >> 1 & 1) >> 1)
    return box(x, 37, 16, 7, m.enemies >= NEGATIVE)


def _spare_torpedo_boxes(m: Ram) -> Box:
    """The left icon disappears first."""
    used = TORPEDOES_LEFT.count - m.torpedoes
    return TORPEDOES_LEFT.boxes(np.arange(TORPEDOES_LEFT.count) >= used)


def _spare_ship_boxes(m: Ram) -> Box:
    place = np.arange(13)
    ships = when(m.spare_ships < NEGATIVE, m.spare_ships) + when(m.ship_lost == LOST, 1)
    return box(32 + 9 * place, 183, 5, 7, place < ships)


def _is_just_hit(m: Ram) -> jax.Array:
    return (m.state == BURST_STATES.start) & (m.timer == JUST_HIT)


def _bursting(m: Ram) -> jax.Array:
    return among(m.state, BURST_STATES) & ~_is_just_hit(m)


def _is_saucer(m: Ram) -> jax.Array:
    return (among(m.state, SAUCER_STATES) | _is_just_hit(m)) & (np.arange(7) < 3)


def _list_is_new(m: Ram) -> jax.Array:
    """True if the records other than the saucers have moved since the list was made."""
    return among(m.half, FRESH_LISTS)


def _step(m: Ram, speed: jax.Array | int) -> jax.Array:
    """Pixels that a speed (signed nibble, nibble of sixteenths) moves a record in this step."""
    bit = np.arange(4)
    tick = jnp.sum((m.clock >> bit & 1) << 3 - bit) + 1
    sixteenths = jnp.asarray(speed, jnp.int32) & 255
    return signed_nibble(sixteenths >> 4) + when((sixteenths & 15) >= tick, 1)


def _drawn_places(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Lane and depth of the seven records before their last step."""
    saucer_dx, saucer_dy = _saucer_steps(m)
    other_dx, other_dy = _other_steps(m)
    x = m.x - jnp.concatenate((saucer_dx, other_dx))
    y = m.y - jnp.concatenate((saucer_dy, other_dy))
    return x, jnp.where(m.y == 0, 0, y)


def _saucer_steps(m: Ram) -> tuple[jax.Array, jax.Array]:
    state = m.state[SAUCERS]
    bursts = _bursting(m)[SAUCERS]
    scripted = among(state, SAUCER_SCRIPTED) | _is_just_hit(m)[SAUCERS]
    op = lookup(SCRIPT_OPS, m.script_at)
    pace = lookup(SCRIPT_PACES, m.script_at)
    forth = _step(m, pace)
    back = _step(m, -pace)
    goes_forth = (op ^ state) & 1 == 1
    aside = when(op < RISE, jnp.where(goes_forth, forth, back))
    ahead = match((op == FALL, forth), (op == RISE, back), otherwise=_step(m, m.drift))
    dx = match(
        (bursts, 0),
        (scripted, aside),
        (state == SAUCER_LEFT, -1),
        (state == SAUCER_RIGHT, 1),
        otherwise=0,
    )
    leaves = when(state == SAUCER_LEAVING, _step(m, Speed.SAUCER_LEAVES))
    return dx, match((bursts, BURST_STEP), (scripted, ahead), otherwise=leaves)


def _other_steps(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Steps of the records other than the saucers, if the list is new."""
    kind = m.state[OTHERS]
    new = _list_is_new(m)
    aside = jnp.any(
        jnp.stack([among(kind, enemy.values) & enemy.aside(m) for enemy in ENEMIES.entries]), axis=0
    )
    speed = match(
        *((among(kind, enemy.values), enemy.speed(m)) for enemy in ENEMIES.entries), otherwise=0
    )
    ahead = jnp.where(among(kind, BURST_STATES), BURST_STEP, _step(m, speed))
    dx = when(new & aside, _step(m, m.timer[OTHERS]))
    dy = when(new & ~aside, ahead)
    return dx, dy + when(m.follows[OTHERS], _step(m, m.drift))


def _charger_speed(m: Ram) -> jax.Array:
    timer = m.timer[OTHERS]
    waits = (m.state[OTHERS] == CHARGER_WAITING) & (timer < 128)
    starts = when(timer == 0, Speed.CHARGER_STARTS)
    return match(
        (m.back[OTHERS], Speed.CHARGER_RETURNS), (waits, starts), otherwise=_usual_speed(m)
    )


def _craft_speed(m: Ram) -> jax.Array:
    kind = m.state[OTHERS]
    return match(
        (kind == CRAFT_RISING, Speed.CRAFT_RISES - m.speed),
        (kind == CRAFT_FALLING, m.speed + Speed.CRAFT_FALLS),
        otherwise=_usual_speed(m),
    )


def _blocker_speed(m: Ram) -> jax.Array:
    falls = m.state[OTHERS] == BLOCKER_FALLING
    return m.speed + jnp.where(falls, Speed.BLOCKER_FALLS, Speed.ENEMY)


def _usual_speed(m: Ram) -> jax.Array:
    return m.speed + Speed.ENEMY


def _never(m: Ram) -> jax.Array:
    return jnp.zeros_like(m.back[OTHERS])


def _always(m: Ram) -> jax.Array:
    return jnp.ones_like(m.back[OTHERS])


def _drawn_pictures(m: Ram, y: jax.Array) -> jax.Array:
    """Pictures of the seven records in the frame."""
    odd_step = m.clock & 1
    of_saucer = np.arange(7) < 3
    odd = when(_list_is_new(m) | of_saucer, odd_step)
    in_order = [
        (among(m.state, enemy.values), enemy.look(m, y)) for enemy in ENEMIES.entries if enemy.look
    ]
    return match(
        (_is_saucer(m), DISK + reached(y, SAUCER_GROWS)),
        (_bursting(m), jnp.maximum(m.state - odd, BURST_STATES.start)),
        (among(m.state, ENEMY_SHOTS.values), m.state ^ odd),
        *in_order,
        otherwise=m.state,
    )


def _by_depth(m: Ram, y: jax.Array) -> jax.Array:
    """The picture of an enemy that grows as it comes nearer."""
    return (m.state & -PER_SIZE) + reached(y, ENEMY_GROWS)


def _chirper_look(m: Ram, _: jax.Array) -> jax.Array:
    """The picture before the one in the record, if the list is new."""
    is_turned = among(m.state, CHIRPER_TURNED)
    forth = jnp.where(m.state == CHIRPER_FIRST, m.state + 1, m.state - 1)
    back = jnp.where(is_turned, m.state ^ 1, m.state + 1)
    return jnp.where(_list_is_new(m), jnp.where(m.back, back, forth), m.state)


def _shot_as_drawn(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Depth and picture of the player's shot as drawn; True if it is the laser's."""
    new = _list_is_new(m)
    struck = m.shot == STRUCK_SHOT
    target = jnp.max(when(_is_just_hit(m), m.y + 1))  # its depth + 1; 0: none
    ended = jnp.cumsum(m.list_line == 0) > 0  # the rest of the list is old
    listed = among(m.list_line, LASER_LEAVES) & (m.list_color == LASER_COLOR) & ~ended
    has_no_shot = m.shot & 63 == 0
    left = new & has_no_shot & jnp.any(listed)
    before_step = m.shot_y + when(new, LASER_STEP)
    at_target = (target & ~7) + 14
    y = match((struck, at_target), (left, LASER_LEFT), otherwise=before_step)
    laser = (m.shot == LASER_SHOT) | (struck & (target > 0)) | left
    shot_picture = TORPEDO.start + reached(y, TORPEDO_GROWS)
    return y, jnp.where(laser, LASER_SHOT, shot_picture), laser


def _picture_box(x: jax.Array, y: jax.Array, picture: jax.Array) -> Box:
    """Pictures at a lane and a depth; only valid on the beams."""
    line = lookup(LINES, y)
    left = 80 + _scaled(x - MIDDLE, LINE_SCALE - line + (line >> 4) + (line >> 3 & 1))
    is_shown = (y >= HORIZON) & (y < NEAREST) & (left < 158)
    return PICTURES.box(picture, left, GROUND - line + 1, valid=is_shown)


def _scaled(side: jax.Array, scale: jax.Array | int) -> jax.Array:
    """Scale a distance from the middle by scale / 128, rounded towards the middle."""
    return jnp.where(side >= 0, side * scale >> 7, -(-side * scale >> 7))


def _saucer_boxes(m: Ram, drawn: Box, x: jax.Array, y: jax.Array) -> Box:
    """The saucers on the beams; beyond the horizon they are dots."""
    saucer = _is_saucer(m)[SAUCERS]
    own_x = x[SAUCERS]
    own_y = y[SAUCERS]
    far = saucer & (own_y < HORIZON)
    third = _is_third(far, own_y)  # another sprite draws it
    from_lane = jnp.where(third, MIDDLE, MIDDLE - 5)
    dot_x = jnp.where(third, 84, 80) + _scaled(own_x - from_lane, DOT_SCALE)
    boxes = choose(far, box(dot_x, 43, 1, 1), drawn[SAUCERS].where(saucer))
    return replace(boxes, color=jnp.where(own_y >= NEAR, DISK_COLORS[1], DISK_COLORS[0]))


def _is_third(far: jax.Array, y: jax.Array) -> jax.Array:
    """True for the nearest saucer if all three are far; of equally near ones, the first."""
    number = np.arange(3)
    farther = y[None] < y[:, None]
    later = (y[None] == y[:, None]) & (number[None] > number[:, None])
    return jnp.sum(when((farther | later) & far[None], 1), axis=1) == 2


SHIP_COLORS = (*range(64, 112, 2), YELLOW)
SHIP = Blobs(SHIP_COLORS, (0, 164, 160, 180), Shape(w=(9, 15), h=(9, 16)), gap=(4, 2))
DOTS = Shape(w=(1, 3), h=1, split=(1, 1))  # saucers at the horizon
SAUCER_SHAPES = (Shape(w=(1, 8), h=(2, 6)), DOTS)
SAUCERS_SHOWN = Blobs(DISK_COLORS, (0, 43, 160, 164), SAUCER_SHAPES)
EXPLOSIONS = Blobs((26, 24, 22, 14), FIELD, Shape(w=(7, 8), h=(7, 8), pixels=(17, 25)))
ENDS = Blobs((38, 86), FIELD, Shape(w=(7, 8), h=5), gap=(2, 1))
LASERS = Blobs(LASER_COLOR, FIELD, Shape(w=(1, 8), h=(1, 5)))
TORPEDOES = Blobs(104, FIELD, Shape(w=(1, 5), h=(1, 5)), filters=(ShortRuns(1),))
PASSING = Blobs((140, 66, 68, 218, 58), (0, 37, 160, 44), Shape(w=(8, 16), h=(4, 7)))
SPARE_SHIPS = Blobs(YELLOW, (0, 182, 160, 194), Shape(w=(1, 5), h=(1, 7)))
AMOUNT = Bounds(212, (15, 30, 40, 43), value=Digits(NARROW_FONT, (6, 19, 25), 32))
SECTOR = Bounds(42, (56, 20, 110, 30), value=Digits(FONT, (92, 100), 21))


@dataclass(frozen=True)
class Enemy(KindEntry):
    """A kind of enemy in the records other than the saucers'; `values` are its states.

    Args:
        speed: along the beams; see `Speed`.
        aside: True for records that move sideways instead.
        look: the picture as drawn, from the depth; None: the state.
    """

    speed: Callable[[Ram], jax.Array] = _usual_speed
    aside: Callable[[Ram], jax.Array] = _never
    look: Callable[[Ram, jax.Array], jax.Array] | None = None


four = functools.partial(Category, count=4)
on_beams = functools.partial(Blobs, region=FIELD)
ENEMIES = Kinds(
    Enemy(
        four("Rejuvenator", on_beams(24, shapes=Shape(w=(3, 5), h=(2, 7))), doc="a life"),
        range(16, 20),
        speed=lambda m: (m.speed >> 1) + Speed.ENEMY,
        look=_by_depth,
    ),
    Enemy(
        four(
            "Debris",
            on_beams(52, shapes=Shape(w=(1, 7), h=(1, 7)), gap=(1, 1)),
            doc="of Rejuvenator",
        ),
        range(1, 2),
        speed=lambda m: m.speed + Speed.DEBRIS,
    ),
    Enemy(
        four("Rock", on_beams(20, shapes=Shape(w=(1, 8), h=(1, 6))), doc="brown"),
        range(24, 28),
        speed=lambda m: m.speed + Speed.ROCK,
        look=_by_depth,
    ),
    Enemy(
        four("Chriper", on_beams(26, shapes=Shape(w=8, h=7)), doc="yellow, crosses"),
        range(CHIRPER_FIRST, CHIRPER_TURNED.stop),
        aside=_always,
        look=_chirper_look,
    ),
    Enemy(
        four("Blocker", on_beams(216, shapes=Shape(w=(1, 8), h=(1, 7)), gap=(1, 1)), doc="green"),
        (BLOCKER_ASIDE, BLOCKER_FALLING),
        speed=_blocker_speed,
        aside=lambda m: m.state[OTHERS] == BLOCKER_ASIDE,
    ),
    Enemy(
        four(
            "Bouncecraft",
            on_beams(218, shapes=Shape(w=(1, 8), h=(1, 7))),
            doc="withstands the laser",
        ),
        range(CRAFT_ASIDE, CRAFT_RISING + 1),
        speed=_craft_speed,
        aside=lambda m: m.state[OTHERS] == CRAFT_ASIDE,
    ),
    Enemy(
        four("Charger", on_beams(202, shapes=Shape(w=(1, 8), h=(1, 7))), doc="fast"),
        range(12, CHARGER_WAITING + 1),
        speed=_charger_speed,
        look=_by_depth,
    ),
    Enemy(
        four("Jumper", on_beams(40, shapes=Shape(w=(1, 7), h=(1, 6))), doc="orange"),
        range(20, 24),
        aside=lambda m: m.back[OTHERS],
        look=_by_depth,
    ),
    Enemy(
        four(
            "Enemy_Projectile",
            on_beams((104, 86), shapes=Shape(w=(2, 4), h=(2, 6), pixels=(8, 12))),
            doc="shots at the ship",
        ),
        range(2, 4),
        speed=lambda m: m.speed,
    ),
)
ENEMY_SHOTS = ENEMIES.entries[-1]

GAME = Game(
    name="BeamRider",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Torpedos", "Player_Projectile"),
        lives=(LivesAsIcons(("Life",), hidden=1, early=2),),
    ),
    variants=Variants(
        difficulties={
            0: "starts in sector 1",
            1: "starts in sector 8",
        },
        source="play of all difficulties in the emulator",
    ),
    categories=(
        Category("Player", SHIP, color_row=-1, role="player", doc="the ship"),
        Category("Saucer", SAUCERS_SHOWN, count=3, doc="white; dots at the horizon"),
        *ENEMIES.categories,
        Category("Explosion", EXPLOSIONS, count=7, doc="what was hit"),
        Category("Sparks", ENDS, count=7, doc="the end of an explosion"),
        Category("Player_Projectile", LASERS, doc="the laser"),
        Category("Torpedos", TORPEDOES, doc="flying"),
        Category("Sentinel", PASSING, doc="passes above when no enemies are left"),
        display(
            "Torpedos_Available",
            TORPEDOES_LEFT.rule(98, whole=True),
            count=TORPEDOES_LEFT.count,
            attributes=(),
            doc="left",
        ),
        display("Enemy_Amount", AMOUNT, doc="enemies left in this sector"),
        display(
            "Score",
            SCORE.rule(42, (56, 8, 110, 19)),
            role="score",
            doc="the score",
            aliases=("HUD",),
        ),
        display("Sector", SECTOR, doc="the sector's number"),
        display("Life", SPARE_SHIPS, count=13, attributes=(), role="lives", doc="spare ships"),
    ),
)
