"""Solaris' RAM, and the meaning of its values."""

import jax
import jax.numpy as jnp
from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag, low, match

ROM = Rom("solaris", "e72eb8d4410152bdcb69e7fba327b420")

RECORDS = 5  # of flying objects: the one in the ship's sprite, then four from the lowest up


class Picture:  # of `Ram.picture`: eight times a kind, plus a size from 0 to 7 (smallest)
    DARTER = 0x14
    EXPLOSION = 0x38
    RINGED_PLANET = 0x40
    PLANET = 0x48  # the largest of twelve blue ones
    RED_PLANET = 0x54  # the largest of twelve
    NONE = 0x60  # or more: beside the screen, or no object


class Kind:  # of `Ram.kind`, in space; FIGHTER, PIRATE, shots and explosions over planets, too
    FIGHTER = 0
    PIRATE = 1
    WARP = 2  # a darter if at least `Picture.DARTER`
    JUMPER = 3
    KILLER = 4
    BLOCKADER = 5
    ENEMY_MISSILE = 6
    EXPLOSION = 7
    RINGED_PLANET = 8
    PLANETS = (9, 10, 11)  # blue and red ones, which have more than eight sizes


class GroundKind:  # of `Ram.kind`, over planets
    RAIDER = 2
    MAN = 3
    LANDING_ZONE = 4
    TOWER = 5
    CRATER = 8


class ShipPicture:  # of `Ram.ship_picture`; a ship that leaves, lands or crashes has others
    LEVEL = 0xD7
    BANKED_RIGHT = 0xEB
    BANKED_LEFT = 0xFF


# Values of the first frame after power-on. The ROM derives them from the depths, which are there,
# but only after the state that a reset returns ($F6DE of bank 1).
FIRST_SHIP_POINTER = 0xBA
FIRST_SHIP_AT = 0x22
FIRST_PICTURES = (0xE0, 0x40, 0x41, 0x42, 0x46)
FIRST_TARGET = 1
FIRST_Y = (2, 17, 43, 61, 76)


class Sky:  # of `Ram.sky`: what is behind the pictures
    SPACE = 0
    PLANET = 1
    ALARM = 2  # space in red


class Ram(RamMap):
    attacked = flag(10, bit=7)  # enemies attack a planet of the quadrant
    state = byte(13)
    sleeps = bits(13, first=0)  # the joystick did not move for 65,536 frames ($F8DE, bank 1)
    waits = bits(13, first=1)  # play stands still, as after the loss of the ship ($F857, bank 1)
    jumps = bits(13, first=4)  # the ship flies through streaks
    on_chart = bits(13, first=5)
    on_planet = bits(13, first=6)
    is_over = flag(13, bit=7)
    jump_timer = bcd((16,))
    quadrant = low(17)
    frame = byte(30)  # counted on since the frame was drawn
    made_ship_pointer = byte(33)  # 0: the ROM has not derived anything yet
    shot_pointer = byte(34, 35)  # of the shots' pictures, minus `shot_y`
    made_picture = byte(36, 37, 38, 39, 40)
    way_out_picture = byte(41)  # of the point that the ship flies to during a jump
    made_ship_at = byte(42)
    shot_at = byte(43, 44)  # codes of their columns, as in `ship_at`
    x = byte(45, 46, 47, 48, 49)  # of the records
    way_out_x = byte(50)
    ship_y = byte(51)  # lines above the panel, as for all others; 0: no ship
    shot_y = byte(52, 53)
    made_y = byte(54, 55, 56, 57, 58)
    shot_depth = byte(60, 61)
    depth = byte(62, 63, 64, 65, 66)  # of the records
    way_out_depth = byte(67)
    way = byte(78)  # to another sector; 0: none
    announces = bits(77, first=6, count=2)  # "SCANNER" replaces the score ($F5BB)
    ship_x = byte(79)  # moved on since the frame was drawn
    leaving = byte(83)
    heads_out = flag(83, bit=5)  # the ship jumps
    departs = bits(83, first=7)  # the ship leaves, lands or crashes
    lives = low(89)
    made_target = byte(90)
    fuel = byte(91)  # eight per column of the bar
    score = bcd((94, 93, 92))  # tens of points
    sectors = byte(*range(100, 124))  # the chart's symbols from the lower right one, two per byte
    ship_speed = byte(118)  # to the right, eighths of a column
    ship_part = byte(119)  # of a column, in 1/256

    @property
    def starts(self) -> jax.Array:
        """True if the ROM has not derived anything from its records yet."""
        return self.made_ship_pointer == 0

    @property
    def flies(self) -> jax.Array:
        """True if the screen shows space or a planet."""
        return (self.jumps == 0) & (self.on_chart == 0)

    @property
    def sky(self) -> jax.Array:
        """The colour behind the pictures ($F92E of bank 1)."""
        alarm = self.attacked & (self.state == 0) & (self.leaving == 0) & (self.way == 0)
        return match((alarm, Sky.ALARM), (self.on_planet == 1, Sky.PLANET), otherwise=Sky.SPACE)

    @property
    def ship_pointer(self) -> jax.Array:
        """Low byte of the address of the ship's picture, minus `ship_y`."""
        return jnp.where(self.starts, FIRST_SHIP_POINTER, self.made_ship_pointer)

    @property
    def ship_picture(self) -> jax.Array:
        """Low byte of the address of the ship's picture."""
        return self.ship_pointer + self.ship_y & 0xFF

    @property
    def shot_picture(self) -> jax.Array:
        """Low bytes of the addresses of the shots' pictures."""
        return self.shot_pointer + self.shot_y & 0xFF

    @property
    def ship_at(self) -> jax.Array:
        """Code of the ship's column, for `sprite_column`."""
        return jnp.where(self.starts, FIRST_SHIP_AT, self.made_ship_at)

    @property
    def picture(self) -> jax.Array:
        """Pictures of the records."""
        return jnp.where(self.starts, jnp.array(FIRST_PICTURES), self.made_picture)

    @property
    def kind(self) -> jax.Array:
        """Kinds of the records' pictures."""
        return self.picture >> 3

    @property
    def is_darter(self) -> jax.Array:
        """True for records that are darters."""
        darts = (self.kind == Kind.WARP) & (self.picture >= Picture.DARTER)
        return darts & (self.on_planet == 0)

    @property
    def y(self) -> jax.Array:
        """Lines from the panel up to the records' first rows."""
        return jnp.where(self.starts, jnp.array(FIRST_Y), self.made_y)

    @property
    def target(self) -> jax.Array:
        """The record that the scanner shows; another number is the way out of a jump."""
        return jnp.where(self.starts, FIRST_TARGET, self.made_target)
