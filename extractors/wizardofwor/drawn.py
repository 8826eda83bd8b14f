"""Wizard of Wor's screen as it was drawn, before the step that follows the drawing."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import among, match, when
from ocjax.extractors.wizardofwor.ram import Hunt, Kind, Ram, Stage, Way

SLOTS = np.arange(6)
KINDS = range(Kind.BURWOR, Kind.WIZARD + 1)
TUNNEL_CELL = 32  # at the right
TUNNEL_ENDS = (19, 139)  # `monster_x`
END_UPRIGHT = 10  # `step` at the end of a way up or down
END_ACROSS = 12
DOORS_OPEN = 128  # least `frame`
NO_MISSILE = 128  # least `missile_y` without a drawn shot


@dataclass(frozen=True)
class Drawn:
    """Values of the frame for which the RAM has newer ones."""

    frame: jax.Array
    level: jax.Array
    x: jax.Array  # of the monsters' pictures
    y: jax.Array
    step: jax.Array
    missile_x: jax.Array
    missile_y: jax.Array
    missile: jax.Array  # whether it is drawn


def as_drawn(m: Ram) -> Drawn:
    """Undo the game's moves since it drew the frame."""
    moved = _has_moved(m)
    across = among(m.way, (Way.LEFT, Way.RIGHT))
    last_step = match(
        (~moved, m.step),
        (m.step == 2, jnp.where(across, END_ACROSS, END_UPRIGHT)),
        otherwise=m.step - 2,
    )
    dx, dy = _direction(m.way)
    other_end = jnp.where(m.cell == TUNNEL_CELL, *TUNNEL_ENDS)
    tunnelled = moved & (m.step == 0)
    x = jnp.where(tunnelled, other_end, m.monster_x - when(moved, 2 * dx)) - 3
    y = 142 - m.monster_y - when(moved & ~tunnelled, 4 * dy)
    missile_dx, missile_dy = _direction(m.missile_way)
    begins = (m.stage == Stage.MUSIC) & (m.music == 1) & (m.level > 0)
    return Drawn(
        frame=m.frame - 1 & 255,
        level=m.level - when(begins, 1),
        x=x,
        y=y,
        step=last_step,
        missile_x=m.missile_x - 4 - missile_dx,
        missile_y=138 - m.missile_y - 2 * missile_dy,
        missile=_missile_flies(m, moved, x, y),
    )


def _direction(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    """One pixel in a direction, to the right and down."""
    dx = match((way == Way.LEFT, -1), (way == Way.RIGHT, 1), otherwise=0)
    return dx, match((way == Way.UP, -1), (way == Way.DOWN, 1), otherwise=0)


def _has_moved(m: Ram) -> jax.Array:
    """True for monsters that have moved since the frame was drawn."""
    hunts = m.hunt != Hunt.NONE
    wizard_rests = (m.hunt == Hunt.WIZARD) & ((m.frame & 7) == 0)
    on_turn = jnp.where(hunts, when(wizard_rests, 2), m.turn - 1)
    on_frame = jnp.where(hunts, (m.frame & 3) == 0, among(m.turn, range(1, 4)))
    moving = on_frame & (m.stage == Stage.PLAY) & (m.over == 0)
    walks = among(m.kind, KINDS) & among(m.way, (Way.UP, Way.DOWN, Way.LEFT, Way.RIGHT))
    return moving & walks & ((on_turn == SLOTS) | (on_turn + 3 == SLOTS))


def _missile_flies(m: Ram, moved: jax.Array, x: jax.Array, y: jax.Array) -> jax.Array:
    """True if a monster's shot is drawn; a shot that has just left the monster is not."""
    there = (m.missile_x == x + 8) & (m.missile_y == 131 - y)
    leaves = jnp.any((m.shooter == SLOTS) & moved & there)
    flies = (m.missile_way > 0) & (m.missile_y < NO_MISSILE)
    return flies & ~leaves & (m.stage == Stage.PLAY)
