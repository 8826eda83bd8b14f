"""Solaris' RAM."""

import jax
import jax.numpy as jnp
from ocjax.console.ram import RamMap, bcd, bits, byte, low
from ocjax.console.rom import Rom

ROM = Rom("solaris", "e72eb8d4410152bdcb69e7fba327b420")

RECORDS = 5  # of what flies about: one that the ship's sprite shows, then four from the lowest up


class Picture:  # of `Ram.picture`: a kind, and in its three low bits a size, 7 for the smallest one
    DARTER = 0x14
    ENEMY_MISSILE = 0x30
    RINGED_PLANET = 0x40
    PLANET = 0x48
    RED_PLANET = 0x54
    END = 0x60  # from here on: away from the screen, or nothing


class Kind:  # of `Ram.picture`, in eights
    FIGHTER = 0
    PIRATE = 1
    WARP = 2  # or a darter; on planets, a raider
    JUMPER = 3  # on planets, a man
    KILLER = 4  # on planets, a landing zone
    BLOCKADER = 5  # on planets, a tower
    ENEMY_MISSILE = 6
    EXPLOSION = 7
    RINGED_PLANET = 8  # on planets, a crater
    PLANETS = (9, 10, 11)


class Target:  # of `Ram.target`: a record, or
    WAY_OUT = 5  # the point for which the ship heads while it jumps


class ShipPicture:  # low bytes of addresses of its pictures but the usual one
    TILTED = 0xD7
    WIDE = 0xEB


# What the first frame after power-on shows. The ROM derives it only after the state that a reset
# returns ($F6DE): from depths, which are there.
FIRST_SHIP_PICTURE = 0xBA
FIRST_SHIP_AT = 0x22
FIRST_PICTURES = (0xE0, 0x40, 0x41, 0x42, 0x46)
FIRST_TARGET = 1
FIRST_Y = (2, 17, 43, 61, 76)


class Ram(RamMap):
    cursor = byte(8)
    sleeps = bits(13, first=0)
    waits = bits(13, first=1)
    jumps = bits(13, first=4)
    on_chart = bits(13, first=5)
    on_planet = bits(13, first=6)
    is_over = bits(13, first=7)
    jump_timer = bcd((16,))
    quadrant = low(17)
    frame = byte(30)  # counted on since the frame was drawn
    made_ship_picture = byte(33)  # less `ship_y`; 0: nothing has been derived yet
    shot_picture = byte(34, 35)  # less `shot_y`
    made_picture = byte(36, 37, 38, 39, 40)
    way_out_picture = byte(41)
    made_ship_at = byte(42)  # code of its position
    shot_at = byte(43, 44)  # likewise
    x = byte(45, 46, 47, 48, 49)
    way_out_x = byte(50)
    ship_y = byte(51)  # lines above the panel, as of all others; 0: there is no ship
    shot_y = byte(52, 53)
    made_y = byte(54, 55, 56, 57, 58)
    shot_depth = byte(60, 61)
    depth = byte(62, 63, 64, 65, 66)
    way_out_depth = byte(67)
    announces = bits(77, first=6, count=2)  # "SCANNER" is in the place of the score ($F5BB)
    ship_x = byte(79)  # moved on since the frame was drawn
    heads_out = bits(83, first=5)  # the ship jumps
    departs = bits(83, first=7)  # the ship leaves, lands or crashes
    lives = low(89)
    made_target = byte(90)
    fuel = byte(91)
    score = bcd((94, 93, 92))  # tens of points
    ship_speed = byte(118)  # to the right, eighths of a column
    ship_part = byte(119)  # 256 a column
    sectors = byte(*range(100, 124))  # the chart's symbols from the lower right one on, two a byte

    @property
    def starts(self) -> jax.Array:
        """Whether the ROM has not derived anything from its records yet."""
        return self.made_ship_picture == 0

    @property
    def ship_picture(self) -> jax.Array:
        """Low byte of the address of the ship's picture, less `ship_y`."""
        return jnp.where(self.starts, FIRST_SHIP_PICTURE, self.made_ship_picture)

    @property
    def ship_at(self) -> jax.Array:
        """Code of the ship's position."""
        return jnp.where(self.starts, FIRST_SHIP_AT, self.made_ship_at)

    @property
    def picture(self) -> jax.Array:
        """Pictures of the records."""
        return jnp.where(self.starts, jnp.array(FIRST_PICTURES), self.made_picture)

    @property
    def y(self) -> jax.Array:
        """Lines above the panel of the records' first rows."""
        return jnp.where(self.starts, jnp.array(FIRST_Y), self.made_y)

    @property
    def target(self) -> jax.Array:
        """The record that the scanner shows."""
        return jnp.where(self.starts, FIRST_TARGET, self.made_target)
