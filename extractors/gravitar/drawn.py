"""Gravitar's saucers, enemies, shots and pictures when the frame was drawn.

After the drawing the game moves saucers (f886 on the map, f9bd on planets, fc93 in an attack) and
enemies' shots (fa64), changes the pictures of explosions (f8a4, f8cd), and sets up new screens.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Pictures, among, lookup, match, only, when
from ocjax.extractors.gravitar.ram import ROM, Ground, Page, Ram, Screen, Sky

OBJECT_ROWS = 7
ATTACK_ZONES = 2  # `zones` after an attack's frame
SAUCER_COLOR = 38  # on planets
LAST_LINE = 0xA5  # of the drawing loop's counter
FRESH_TIME = 255  # `lives_time` just after a screen was set up
SHIP_TOP = 28  # row of the screen at which the drawing loop's counter begins
PLANET_TOP = 24
REACTOR_TOP = 42
SAUCER_ZONE = 8  # rows of the counter in a saucer's zone on planets
HALF_WIDTH = 18  # `saucer_x` less columns

NO_PICTURE = -1

SKY_PICTURES = (*Sky.EXPLOSIONS, Sky.SAUCER, Sky.REACTOR, Sky.SUN, Sky.RING, *Sky.PLANETS)
GROUND_PICTURES = (Ground.SAUCER, *Ground.BUNKERS, *Ground.TANKS, *Ground.EXPLOSIONS)
BEFORE = {0x54: 0x46, 0x70: 0x62, 0x7E: 0x70, 0xA8: 0x9A, 0xB6: 0xA8}  # of pictures on planets
SKY_HEIGHT = 15
GROUND_HEIGHT = 6  # of two rows each


def _pictures_of_objects() -> Pictures:
    """Extents of the pictures of rows by low byte, planets' pictures last."""
    sky = ROM.rows(list(range(0xC00, 0xD00)), SKY_HEIGHT, top_first=True)
    ground = ROM.rows(list(range(0xB00, 0xC00)), GROUND_HEIGHT, top_first=True)
    blank = np.zeros(1, int)
    in_sky = [sky[p] if p in SKY_PICTURES else blank for p in range(256)]
    on_planet = [np.repeat(ground[p], 2) if p in GROUND_PICTURES else blank for p in range(256)]
    return Pictures.of([*in_sky, *on_planet], planet=2, picture=256)


OBJECT_PICTURES = _pictures_of_objects()


class Shown(NamedTuple):
    """The screen that was drawn."""

    is_map: jax.Array
    planet: jax.Array
    attack: jax.Array
    reactor: jax.Array
    top: jax.Array  # row of the screen at which the drawing loop's counter begins
    fresh: jax.Array  # the game has set up a screen since
    over: jax.Array  # the game has ended, so it has not moved objects since
    lost: jax.Array  # a life was lost since
    on: jax.Array  # not the title


class Saucer(NamedTuple):
    """The saucer when it was drawn."""

    picture: jax.Array  # `NO_PICTURE` without a saucer
    color: jax.Array
    x: jax.Array
    line: jax.Array


class Drawn(NamedTuple):
    """The drawn state of all objects that have changed since."""

    shown: Shown
    pictures: jax.Array  # of rows
    lines: jax.Array  # counter of their first rows
    saucer: Saucer


def as_drawn(m: Ram) -> Drawn:
    """The state when the frame was drawn."""
    shown = _what_is_shown(m)
    pictures = _drawn_pictures(m, shown)
    row = match((shown.planet, 0), (shown.attack, 1), otherwise=m.saucer_row)
    chosen = np.arange(OBJECT_ROWS) == row
    return Drawn(
        shown=shown,
        pictures=jnp.where(shown.is_map & chosen, Sky.REACTOR, pictures),
        lines=jnp.where(shown.planet, _ground_lines(m), m.top),
        saucer=_drawn_saucer(m, shown, pictures, chosen),
    )


def _what_is_shown(m: Ram) -> Shown:
    fresh = m.lives_time == FRESH_TIME
    over = m.screen == Screen.OVER
    entered = fresh & (m.screen == Screen.PLANET) & (jnp.max(m.color) == 0)
    leaves = fresh & (m.screen == Screen.MAP) & ~m.dies
    planet = (m.page == Page.PLANET) & ~entered
    attack = jnp.where(over, m.zones == ATTACK_ZONES, ~fresh & (m.screen == Screen.ATTACK))
    in_reactor = jnp.where(over, m.zones == 0, ~fresh & (m.screen == Screen.REACTOR))
    is_map = among(m.screen, (Screen.MAP, Screen.OVER))
    died = (m.screen == Screen.PLANET) | ((m.screen == Screen.MAP) & m.dies)
    reactor = in_reactor & ~planet
    return Shown(
        is_map=is_map & ~planet & (~(fresh | over) | (m.zones == OBJECT_ROWS)),
        planet=planet,
        attack=attack & ~planet,
        reactor=reactor,
        top=match((planet | leaves, PLANET_TOP), (reactor, REACTOR_TOP), otherwise=SHIP_TOP),
        fresh=fresh,
        over=over,
        lost=fresh & died & ~entered,
        on=m.drawn_end > 0,
    )


def _drawn_saucer(m: Ram, shown: Shown, pictures: jax.Array, chosen: jax.Array) -> Saucer:
    """The saucer, given the pictures of rows and the saucer's row."""
    moved = _saucer_moved(m, shown)
    top = only(chosen, m.top)
    return Saucer(
        picture=match(
            (shown.is_map, _map_saucer(m, shown)),
            (shown.planet, _planet_saucer(m, shown, pictures[0])),
            otherwise=pictures[1],
        ),
        color=only(chosen, m.color),
        x=m.saucer_x - HALF_WIDTH - when(moved, _saucer_step(m, shown)),
        line=match(
            (shown.planet, _ground_line(_height_before(m, moved))),
            (shown.attack, _attack_height_before(m, top, moved)),
            otherwise=top,
        ),
    )


def _ground_line(top: jax.Array) -> jax.Array:
    """The first line of an object on a planet: only every second line starts objects."""
    return ((top + 1) & ~1) - 1


def _ground_lines(m: Ram) -> jax.Array:
    """Lines of rows on planets; the loop needs some lines to place the next row's object."""
    free = jnp.concatenate([jnp.zeros(1, jnp.int32), (m.zone_end[:-1] | 3) + 4])
    return jnp.maximum(_ground_line(m.top), free)


def _drawn_pictures(m: Ram, shown: Shown) -> jax.Array:
    """Pictures of rows; explosions take a step every 8 or 16 frames."""
    p = m.picture
    ground = match(*((p == after, earlier) for after, earlier in BEFORE.items()), otherwise=p)
    sky = p + when(among(p, Sky.EXPLOSIONS[:2]), 0x10)
    stepped = (m.clock & jnp.where(shown.planet, 7, 15)) == 0
    return jnp.where(stepped & ~shown.fresh, jnp.where(shown.planet, ground, sky), p)


def _map_saucer(m: Ram, shown: Shown) -> jax.Array:
    """The picture of the saucer on the map."""
    p = m.saucer_picture
    there = (m.saucer > 0) | (shown.fresh & (p <= Sky.SAUCER))
    stepped = ((m.clock & 15) == 0) & (p < Sky.EXPLOSIONS[-1]) & ~shown.fresh
    return jnp.where(there, p + when(stepped, 0x10), NO_PICTURE)


def _planet_saucer(m: Ram, shown: Shown, picture: jax.Array) -> jax.Array:
    """The picture of the saucer on a planet, which is away after the loss of a life."""
    gone = shown.fresh & (m.color[0] == SAUCER_COLOR)
    return jnp.where(m.saucer > 0, jnp.where(gone, Ground.SAUCER, picture), NO_PICTURE)


def _saucer_moved(m: Ram, shown: Shown) -> jax.Array:
    """True if the saucer took a step after the drawing: its pace, a sum, overflowed."""
    least = match((shown.planet, 0x31), (shown.is_map, 0x98), otherwise=0x38)
    odd = (m.clock & 1) == 1
    moves = match((shown.planet, True), (shown.is_map, odd), otherwise=m.heading < 16)
    stays = shown.over | (shown.fresh & shown.is_map)
    return moves & ~stays & (m.saucer_pace < least)


def _saucer_step(m: Ram, shown: Shown) -> jax.Array:
    """Columns to the right that the saucer moves; off a planet, towards the ship."""
    away = m.x - (m.saucer_x - HALF_WIDTH)
    return jnp.where(shown.planet, jnp.where(m.saucer == 1, 1, -1), jnp.sign(away))


def _height_before(m: Ram, moved: jax.Array) -> jax.Array:
    """The saucer's `top` on a planet, where it stays above the ground and the ship."""
    top = m.top[0]
    highest = jnp.minimum(m.top[1] - 6, m.ceiling - 1)
    goal = jnp.minimum(highest, m.y + 11) - SAUCER_ZONE
    down = (top == goal) | (top < goal - 1)
    return top - when(moved, jnp.where(down, 1, -1))


def _attack_height_before(m: Ram, top: jax.Array, moved: jax.Array) -> jax.Array:
    """The saucer's `top` in an attack, where it flies towards the ship."""
    away = m.y - top - 5
    toward = jnp.where(jnp.abs(away) == 1, -away, jnp.sign(away))  # it oscillates at the end
    return top - when(moved, 2 * toward)


# Steps of shots by heading.
STEP_DOWN = ((ROM.bytes(0x1DC4, 16) ^ 128) - 128).tolist()
STEP_RIGHT = ((ROM.bytes(0x1DD4, 16) ^ 128) - 128).tolist()
SLOTS = np.arange(2)  # of shots


class Shots(NamedTuple):
    """The last drawn shots, a slot each; on the map the ship has one."""

    x: jax.Array
    row: jax.Array
    there: jax.Array
    now: jax.Array  # on this frame


def ship_shots_drawn(m: Ram, shown: Shown) -> Shots:
    """The ship's shots: the game has moved and drawn one, and drew the other one before."""
    turn = jnp.where(shown.over, m.shot_y == m.shot_row, (m.clock & 1) == SLOTS)
    now = turn & ~shown.is_map | (shown.is_map & (SLOTS == 0))
    alive = (m.shot_heading < 16) & ~shown.is_map
    row = jnp.where(now, m.shot_row, m.shot_y)
    return Shots(m.shot_x - 1, row, (now | alive) & (row < LAST_LINE), now)


def enemy_shots_drawn(m: Ram, shown: Shown) -> Shots:
    """Enemies' shots: the game has drawn one, and moved the other one for the next frame."""
    now = ((m.clock & 1) != SLOTS) | shown.over
    heading = m.enemy_heading
    first_heading = (m.clock ^ m.y ^ m.fuel_low ^ m.spare_lives ^ m.pace) & 15
    in_space = among(m.screen, (Screen.MAP, Screen.ATTACK))
    time = jnp.where(in_space, m.pace, m.clock ^ m.pace ^ m.x ^ m.y) & 15
    new = ~now & (heading == first_heading) & (m.enemy_time == (16 | time))
    moved = ~now & ~shown.fresh
    x = m.enemy_x - 1 - when(moved, lookup(STEP_RIGHT, heading))
    y = m.enemy_y - when(moved, lookup(STEP_DOWN, heading))
    alive = jnp.where(shown.fresh, m.enemy_time > 0, (heading < 16) & ~new)
    return Shots(x, y, alive & shown.on & (y < LAST_LINE), now)
