"""Beam Rider: a ship on five beams; saucers and other enemies come down the beams.

Screen: the beams' lines and dots and the maker's name are scenery. The sentinel passes above the
beams at the end of a sector.

Slots: the game keeps eight records: three for saucers, four for other enemies, one for the player's
shot. Each category has a slot for every record that may hold one of its objects. A hit object
becomes an Explosion, then Sparks.

RAM: ALE's source (score, lives), OCAtari 2.2 (records), and the ROM's code. Every second frame the
game copies the records to a display list and moves the records afterwards, so the screen shows
their positions one step earlier. That step follows from the record's state, its speed or script,
and the frame counter. A table gives the screen line for a record's depth. A product of line and
lane gives the column. State and depth give the picture.

Covered: sectors 1 to 20, all enemies, deaths, game over, the sentinel.

Not exact: the step of a record on a change of state; the choice between two near objects when the
game moves one by a few lines or skips it on a frame; enemies other than saucers on the frame of the
hit; the last frame of a torpedo.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Digits,
    Game,
    LivesAsIcons,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    ShortRuns,
    among,
    bcd,
    bits,
    box,
    byte,
    choose,
    display,
    lookup,
    match,
    packed_position,
    pick,
    reached,
    signed_nibble,
    when,
)

ROM = Rom("beam_rider", "79ab4123a83dc11d468fb2108ea09e2e")
FONT = ROM.font(0x3, rows=8)
NARROW_FONT = ROM.font(0x3, rows=8, dots=6, shift=1, pitch=6)  # the same without margins

# States of a record; they are also the numbers of its pictures.
DEBRIS = range(1, 2)
ENEMY_SHOT = range(2, 4)
BLOCKER = range(4, 6)
BLOCKER_ASIDE = 4
BLOCKER_FALLING = 5
BURST_STATES = range(6, 12)
EXPLOSION = range(6, 10)
SPARKS = range(10, 12)
CHARGER = range(12, 16)
CHARGER_WAITING = 15
REJUVENATOR = range(16, 20)
JUMPER = range(20, 24)
ROCK = range(24, 28)
SIZED = range(CHARGER.start, ROCK.stop)  # four pictures each, by nearness
CHIRPER = range(28, 32)
CHIRPER_TURNED = range(30, 32)
CRAFT = range(32, 35)
CRAFT_ASIDE = 32
CRAFT_FALLING = 33
CRAFT_RISING = 34
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

COLORS = ROM.bytes(0x1D8E, CRAFT.stop)  # by picture
JUST_HIT = 8  # timer of a burst on the frame of the hit, which still shows the target
STRUCK_SHOT = 192  # the player's shot on that frame
SHIP_EXPLODES = 19  # picture of the ship
FRESH_LISTS = (0, 255)  # `half` while the list is new
LOST = 255  # `ship_lost`
NEGATIVE = 128  # least value of a counter below 0: no spare ships, no enemies
MIDDLE = 128  # lane

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
LINE_SCALE = 0xC6  # of the distance from the middle, at line 0, in 128ths
# Least depths of the next larger picture.
SAUCER_GROWS = (0x30, 0x50, 0x70, 0x90, 0xB8)
ENEMY_GROWS = (0x68, 0x90, 0xB0)
TORPEDO_GROWS = (0x4E, 0x80)
# A laser shot that has left the beams stays in the list, at one of these lines.
LASER_LEAVES = (101, 104)
LASER_LEFT = 102  # its depth then

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
SHOTS = Blobs((104, 86), FIELD, Shape(w=(2, 4), h=(2, 6), pixels=(8, 12)))
ENEMIES = {  # states, rule, doc
    "Rejuvenator": (REJUVENATOR, Blobs(24, FIELD, Shape(w=(3, 5), h=(2, 7))), "a life"),
    "Debris": (DEBRIS, Blobs(52, FIELD, Shape(w=(1, 7), h=(1, 7)), gap=(1, 1)), "of Rejuvenator"),
    "Rock": (ROCK, Blobs(20, FIELD, Shape(w=(1, 8), h=(1, 6))), "brown"),
    "Chriper": (CHIRPER, Blobs(26, FIELD, Shape(w=8, h=7)), "yellow, crosses"),
    "Blocker": (BLOCKER, Blobs(216, FIELD, Shape(w=(1, 8), h=(1, 7)), gap=(1, 1)), "green"),
    "Bouncecraft": (CRAFT, Blobs(218, FIELD, Shape(w=(1, 8), h=(1, 7))), "withstands the laser"),
    "Charger": (CHARGER, Blobs(202, FIELD, Shape(w=(1, 8), h=(1, 7))), "fast"),
    "Jumper": (JUMPER, Blobs(40, FIELD, Shape(w=(1, 7), h=(1, 6))), "orange"),
    "Enemy_Projectile": (ENEMY_SHOT, SHOTS, "shots at the ship"),
}


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
    follows = bits(*range(42, 49), first=6)  # moves sideways with the saucers
    back = bits(*range(42, 49), first=7)  # on its way back
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
        **{name: drawn[OTHERS].where(among(kind, e[0])) for name, e in ENEMIES.items()},
        "Enemy_Projectile": colored[OTHERS].where(among(kind, ENEMY_SHOT)),
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
    place = np.arange(3)
    return box(128 + 8 * place, 32, 4, 8, place >= 3 - m.torpedoes)


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
    burst = _bursting(m)[SAUCERS]
    op = lookup(SCRIPT_OPS, m.script_at)
    speed = lookup(SCRIPT_PACES, m.script_at)
    forth = _step(m, speed)
    back = _step(m, -speed)
    scripted = among(state, SAUCER_SCRIPTED) | _is_just_hit(m)[SAUCERS]
    aside = jnp.where((op ^ state) & 1 == 1, forth, back)
    ahead = match((op == FALL, forth), (op == RISE, back), otherwise=_step(m, m.drift))
    dx = match(
        (burst, 0),
        (scripted, when(op < RISE, aside)),
        (state == SAUCER_LEFT, -1),
        (state == SAUCER_RIGHT, 1),
        otherwise=0,
    )
    leaving = when(state == SAUCER_LEAVING, _step(m, Speed.SAUCER_LEAVES))
    return dx, match((burst, -2), (scripted, ahead), otherwise=leaving)


def _other_steps(m: Ram) -> tuple[jax.Array, jax.Array]:
    kind = m.state[OTHERS]
    new = _list_is_new(m)
    always_aside = (kind == BLOCKER_ASIDE) | among(kind, CHIRPER) | (kind == CRAFT_ASIDE)
    aside = always_aside | among(kind, JUMPER) & (m.back[OTHERS] == 1)
    ahead = jnp.where(among(kind, BURST_STATES), -2, _step(m, _other_speeds(m)))
    dx = when(new & aside, _step(m, m.timer[OTHERS]))
    dy = when(new & ~aside, ahead)
    return dx, dy + when(m.follows[OTHERS] == 1, _step(m, m.drift))


def _other_speeds(m: Ram) -> jax.Array:
    """Speed along the beams of the records other than the saucers."""
    kind = m.state[OTHERS]
    timer = m.timer[OTHERS]
    back = m.back[OTHERS] == 1
    waits = (kind == CHARGER_WAITING) & (timer < 128)
    return match(
        (kind == CRAFT_RISING, Speed.CRAFT_RISES - m.speed),
        (kind == CRAFT_FALLING, m.speed + Speed.CRAFT_FALLS),
        (among(kind, ROCK), m.speed + Speed.ROCK),
        (among(kind, REJUVENATOR), (m.speed >> 1) + Speed.ENEMY),
        (among(kind, CHARGER) & back, Speed.CHARGER_RETURNS),
        (waits, jnp.where(timer > 0, 0, Speed.CHARGER_STARTS)),
        (among(kind, DEBRIS), m.speed + Speed.DEBRIS),
        (kind < BLOCKER.start, m.speed),
        (kind == BLOCKER_FALLING, m.speed + Speed.BLOCKER_FALLS),
        otherwise=m.speed + Speed.ENEMY,
    )


def _drawn_pictures(m: Ram, y: jax.Array) -> jax.Array:
    """Pictures of the seven records in the frame."""
    state = m.state
    new = _list_is_new(m)
    odd = when(new | (np.arange(7) < 3), m.clock & 1)
    turned = jnp.where(state == CHIRPER.start, state + 1, state - 1)
    turned_back = jnp.where(among(state, CHIRPER_TURNED), state ^ 1, state + 1)
    return match(
        (_is_saucer(m), DISK + reached(y, SAUCER_GROWS)),
        (_bursting(m), jnp.maximum(state - odd, BURST_STATES.start)),
        (among(state, ENEMY_SHOT), state ^ odd),
        (among(state, SIZED), (state & ~3) + reached(y, ENEMY_GROWS)),
        (among(state, CHIRPER) & new, jnp.where(m.back == 1, turned_back, turned)),
        otherwise=state,
    )


def _shot_as_drawn(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Depth and picture of the player's shot as drawn; True if it is the laser's."""
    new = _list_is_new(m)
    struck = m.shot == STRUCK_SHOT
    target = jnp.max(jnp.where(_is_just_hit(m), m.y + 1, 0))
    ended = jnp.cumsum(m.list_line == 0) > 0  # the rest of the list is old
    listed = among(m.list_line, LASER_LEAVES) & (m.list_color == LASER_COLOR) & ~ended
    gone = new & (m.shot & 63 == 0) & jnp.any(listed)
    y = match((struck, (target & ~7) + 14), (gone, LASER_LEFT), otherwise=m.shot_y + when(new, 8))
    laser = (m.shot == LASER_SHOT) | struck & (target > 0) | gone
    return y, jnp.where(laser, LASER_SHOT, TORPEDO.start + reached(y, TORPEDO_GROWS)), laser


def _picture_box(x: jax.Array, y: jax.Array, picture: jax.Array) -> Box:
    """Pictures at a lane and a depth; only valid on the beams."""
    line = lookup(LINES, y)
    left = 80 + _scaled(x - MIDDLE, LINE_SCALE - line + (line >> 4) + (line >> 3 & 1))
    on_beams = (y >= HORIZON) & (y < NEAREST) & (left < 158)
    return PICTURES.box(picture, left, GROUND - line + 1, valid=on_beams)


def _scaled(side: jax.Array, scale: jax.Array | int) -> jax.Array:
    """Scale a distance from the middle by scale / 128, rounded towards the middle."""
    return jnp.where(side >= 0, side * scale >> 7, -(-side * scale >> 7))


def _saucer_boxes(m: Ram, drawn: Box, x: jax.Array, y: jax.Array) -> Box:
    """The saucers on the beams; beyond the horizon they are dots."""
    saucer = _is_saucer(m)[SAUCERS]
    own_x = x[SAUCERS]
    own_y = y[SAUCERS]
    far = saucer & (own_y < HORIZON)
    i = np.arange(3)
    other = own_y[None]
    own = own_y[:, None]
    before = (other < own) | (other == own) & (i[None] > i[:, None])
    third = jnp.sum(jnp.where(before & far[None], 1, 0), axis=1) == 2  # another sprite draws it
    dot_x = jnp.where(third, 84, 80) + _scaled(own_x - jnp.where(third, MIDDLE, 123), 84)
    nearer = when(own_y >= NEAR, 1)
    boxes = choose(far, box(dot_x, 43, 1, 1), drawn[SAUCERS].where(saucer))
    return replace(boxes, color=pick(nearer, DISK_COLORS))


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
SPARE_TORPEDOES = Cells(98, (128, 136, 144), (32,) * 3, 4, 8)
SPARE_SHIPS = Blobs(YELLOW, (0, 182, 160, 194), Shape(w=(1, 5), h=(1, 7)))
AMOUNT = Bounds(212, (15, 30, 40, 43), value=Digits(NARROW_FONT, (6, 19, 25), 32))
SECTOR = Bounds(42, (56, 20, 110, 30), value=Digits(FONT, (92, 100), 21))

GAME = Game(
    name="BeamRider",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Torpedos", "Player_Projectile"),
        lives=(LivesAsIcons(("Life",), hidden=1, early=2),),
    ),
    categories=(
        Category("Player", SHIP, color_row=-1, role="player", doc="the ship"),
        Category("Saucer", SAUCERS_SHOWN, count=3, doc="white; dots at the horizon"),
        *(Category(name, e[1], count=4, doc=e[2]) for name, e in ENEMIES.items()),
        Category("Explosion", EXPLOSIONS, count=7, doc="what was hit"),
        Category("Sparks", ENDS, count=7, doc="the end of an explosion"),
        Category("Player_Projectile", LASERS, doc="the laser"),
        Category("Torpedos", TORPEDOES, doc="flying"),
        Category("Sentinel", PASSING, doc="passes above when no enemies are left"),
        display("Torpedos_Available", SPARE_TORPEDOES, count=3, attributes=(), doc="left"),
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
