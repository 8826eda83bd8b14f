"""Up'n Down's sprites as drawn.

The game moves everything between the drawing of the frame and the end of the vertical sync
(f173-f5ef of bank 1). `as_drawn` undoes this. Cars take a step if their speed reaches a limit that
the frame counter sets (f3a9). Their columns follow from the road's table (f454), and the road
scrolls by the player's last step but one (f275).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import among, match, mirrored, when
from ocjax.extractors.upndown.lost import drawn_records
from ocjax.extractors.upndown.ram import BACKWARD, GROUND, Attract, Jump, Pause, Ram
from ocjax.extractors.upndown.road import column_near, course_at

FASTEST = 255  # minus twice the forward speed: this has to reach the limit
QUICK_ROWS = 3  # per frame of the fall of a jump within a road


class Drawn(NamedTuple):
    """The sprites as drawn, the player's first.

    Their rows decide which sprites give way to others (`sprites`), so an error in one row also
    affects the boxes of its neighbours. An error in one kind's boxes alone does not.
    """

    kind: jax.Array
    x: jax.Array
    y: jax.Array  # 16 less than the first row of the picture on the screen
    fine: jax.Array  # rows that the road had come down


def as_drawn(m: Ram) -> Drawn:
    """The sprites before the last move; on the frame of a lost life, the old ones."""
    scroll = when(m.pause == Pause.RUNNING, _steps(m.speed, _players_limit(m)))
    step = when(m.pause == Pause.RUNNING, _steps(m.speeds, m.limit))
    lost = life_lost(m)
    old = drawn_records(m)
    kinds = jnp.where(lost, old.kind, m.kinds)
    rows = jnp.where(lost, old.y, m.y - step + scroll)
    return Drawn(
        kind=jnp.concatenate([m.kind[None], kinds]),
        x=jnp.concatenate([m.player_x[None], _columns(m, step)]),
        y=jnp.concatenate([_player_row(m)[None], rows]),
        fine=jnp.where(lost, old.fine, m.fine - scroll),
    )


def life_lost(m: Ram) -> jax.Array:
    """True if a life was lost on this frame: the RAM has the new start, the screen the old one."""
    return (m.pause == Pause.DYING) & among(m.attract, Attract.LIFE_TAKEN)


def _players_limit(m: Ram) -> jax.Array:
    """The limit for the player's speed: the last frame's count with its bits in reverse order."""
    return mirrored((m.counter - 1) & 255) & 255


def _steps(speed: jax.Array, limit: jax.Array) -> jax.Array:
    """Rows that a car moves on a frame: -1, 0 or 1."""
    is_back = speed >= BACKWARD
    twice = 2 * (speed & 127)
    amount = jnp.where(is_back, twice, FASTEST - twice)
    return when((amount > 0) & (amount >= limit), jnp.where(is_back, -1, 1))


def _columns(m: Ram, step: jax.Array) -> jax.Array:
    """The records' columns before their last step."""
    course = course_at(m, m.y + 4 * m.coarse + m.fine - step)
    return jnp.where(step == 0, m.x, column_near(course, m.x))


def _player_row(m: Ram) -> jax.Array:
    """The player's row before his last move."""
    is_landing = (m.jump == Jump.LANDED) & (m.player_y == GROUND)
    jump = jnp.where((m.jump == Jump.LANDED) & ~is_landing, Jump.SINKS - 2, m.jump)
    is_quick = among(jump, range(Jump.LOW, Jump.SINKS)) & (m.flight == 0)
    before = match(
        (is_landing, Jump.LANDS),
        (is_quick, jnp.minimum(jump + QUICK_ROWS, Jump.SINKS)),
        otherwise=jump + 1,
    )
    is_in_air = among(jump, range(Jump.LOW, Jump.TAKEOFF)) | is_landing
    row = GROUND + when(is_in_air, _height(before))
    return jnp.where(m.pause == Pause.RUNNING, row, m.player_y)


def _height(jump: jax.Array) -> jax.Array:
    """Rows of the player below the road, negative in a jump."""
    up = jnp.where(jump >= Jump.RISES, jump - 256, Jump.LOW - 1 - jump)
    return when(jump >= Jump.LOW, up + (up >> 1))
