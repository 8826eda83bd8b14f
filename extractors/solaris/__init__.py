"""Solaris: a ship that jumps from sector to sector, flies in space and over planets.

Picture: docs/games/Solaris.png

Screen: space, a planet, or the chart of a quadrant's 48 sectors. Flames of the ship, stars, hills,
lines of the ground, the planet in a planet's sky, the chart's grid, words, and the streaks during a
jump are scenery.

Files: `ram` has the RAM and the meaning of its values. `ship`, `records` (all flying objects),
`chart` and `scanner` give the boxes of REM; `records` looks pictures up in the table of `pictures`.
`screens` and `vision` belong to VEM: the screen of a frame, and the colours and shapes on it.

RAM: a kernel of bank 2 ($F000-$F2C9) draws space, a kernel of bank 3 ($F000-$F283) planets. Another
part of bank 3 ($F484) draws the chart. One sprite shows four records that do not overlap in height,
from the top down. The other sprite shows the fifth record, the two shots and the ship.

Alarm: space is red while enemies attack a planet of the quadrant. Rows in that red are invisible.

Warp: a hyper jumper arrives as two lights, one from each side. They fly to each other in the same
row and become the jumper where they meet ($F267 and $F92E of bank 0).

Shots: the two shots are drawn with random dots: $F066 of bank 2 masks each row with bytes from an
address that depends on the duration of the last frame ($F73D of bank 1 reads the timer). The RAM
does not keep it until the frame ends, so REM has the box of a shot's complete picture, and VEM the
box of its visible dots. A far shot is a single dot, and hidden on most frames.

Covered: random play in space, over planets and on the chart, lost lives, the end of a game. Warp,
Blockader, Raider and Tower did not appear in it; their pictures and colours are the ROM's.

Not exact: parts hidden behind another picture. In the state that a reset returns, the ROM has not
derived anything from its records yet; `Ram` then has the values of the first frame. At the end of a
game, all records already belong to the next game, while the frame is the last one of the old game.

VEM: it sees overlapping pictures as one, cannot distinguish blockaders of one dot from stars, and
misses black rows of craters on the ground's black lines. It takes the blue part of some jumpers for
a planet, and the red part of a jumper that the view's edge cuts off.
"""

import functools

from ocjax.authoring import (
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Gauge,
    IconRow,
    NumberDisplay,
    box,
    display,
)
from ocjax.extractors.solaris import chart, scanner, vision
from ocjax.extractors.solaris.pictures import BLUE_COLOR_ROW
from ocjax.extractors.solaris.ram import RECORDS, ROM, Ram
from ocjax.extractors.solaris.records import flying
from ocjax.extractors.solaris.scanner import FONT, scanned
from ocjax.extractors.solaris.ship import COLOR_ROW, ship_box, shot_boxes

SCORE = NumberDisplay(FONT, right=105, top=5, digits=6)
LIVES = IconRow(left=24, top=192, width=3, height=5, pitch=-4)
LIVES_AREA = (12, 192, 28, 197)  # of four icons; the ship in flight has none
FUEL_LEFT = 120
FUEL_RIGHT = 156  # of a full bar
FUEL_TOP = 192
FUEL_HEIGHT = 5
EMPTY_BAR = 5  # columns


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": ship_box(m),
        "PlayerMissile": shot_boxes(m),
        **flying(m),
        "ChartSymbol": chart.symbol_boxes(m),
        "JumpTimer": chart.timer_box(m),
        **_displays(m),
    }


def _displays(m: Ram) -> dict[str, Box]:
    """The score above the view, and the panel below it."""
    panel = ~m.is_over
    return {
        "Score": SCORE.box(10 * m.score, valid=m.announces == 0),
        "Lives": LIVES.box(m.lives - 1, panel, value=m.lives),
        "Fuel": _fuel_box(m).where(panel),
        **scanned(m, panel),
    }


def _fuel_box(m: Ram) -> Box:
    """The fuel bar, which grows to the right; it disappears without fuel."""
    columns = m.fuel >> 3
    width = EMPTY_BAR + columns
    return box(FUEL_LEFT, FUEL_TOP, width, FUEL_HEIGHT, m.fuel > 0, value=columns)


LIVES_RULE = LIVES.rule(142, LIVES_AREA, single=2)
FUEL_AREA = (FUEL_LEFT, FUEL_TOP, FUEL_RIGHT, FUEL_TOP + FUEL_HEIGHT)
FUEL_RULE = Bounds(26, FUEL_AREA, value=Gauge(1, EMPTY_BAR, 0))

of_records = functools.partial(Category, count=RECORDS)
hud = functools.partial(display, attributes=())
valued = functools.partial(Category, attributes=("value",))
GAME = Game(
    name="Solaris",
    rom=ROM,
    ram=Ram,
    decode=decode,
    backdrop=(8, 158),
    checks=Checks(
        # On the last frame, all records belong to the next game. When a life is lost, fuel, ships
        # left and the target belong to the next one.
        agreement={"last": 0.3, "lost": 0.96},
        rare=("Darter", "HyperJumper"),  # during an alarm
        # Symbols differ in their pictures alone, and a grid's cells have no pictures.
        known={"ChartSymbol": 0},
    ),
    categories=(
        Category(
            "Player",
            vision.SHIP,
            otherwise=vision.GROUND_SHIP,
            colors=vision.PLAYER_COLORS,
            color_row=COLOR_ROW,
            role="player",
            doc="the ship, without its flames",
        ),
        Category(
            "PlayerMissile",
            vision.SHOTS,
            count=2,
            blinks=True,
            doc="two shots, nearer and farther; random dots of them are left out",
        ),
        of_records("Fighter", vision.FIGHTERS, doc="Zylon fighters, in space and on planets"),
        of_records(
            "Pirate",
            vision.PIRATES,
            colors=vision.ALL_PIRATE_COLORS,
            doc="pirate ships, in space and on planets",
        ),
        of_records("Warp", vision.WARPS, doc="two lights that meet and become a hyper jumper"),
        of_records("Darter", vision.DARTERS, doc="small red things that come at the ship"),
        of_records("HyperJumper", vision.JUMPERS, doc="saucers in three colours"),
        of_records("PlanetKiller", vision.KILLERS, doc="the largest enemies in space, pale blue"),
        of_records("Blockader", vision.BLOCKADERS, doc="upright enemies that turn, green and blue"),
        of_records("Raider", vision.RAIDERS, doc="upright enemies on planets, red or blue"),
        of_records("Man", vision.MEN, doc="what moves over the ground, with arms and legs"),
        of_records("LandingZone", vision.ZONES, doc="the pink field on planets"),
        of_records("Tower", vision.TOWERS, doc="violet things on planets"),
        of_records(
            "EnemyMissile",
            vision.ENEMY_SHOTS,
            colors=(110, 126, 142, 158),
            doc="shots of the enemies",
        ),
        of_records("Explosion", vision.EXPLOSIONS, doc="what is left of what the ship hit"),
        of_records("RingedPlanet", vision.RINGS, doc="rings, with the planet inside"),
        of_records(
            "BluePlanet",
            vision.BLUE_PLANETS,
            color_row=BLUE_COLOR_ROW,
            colors=tuple(range(128, 144, 2)),
            doc="blue planets, from afar and near",
        ),
        of_records("RedPlanet", vision.RED_PLANETS, doc="red planets, from afar and near"),
        of_records("Crater", vision.CRATERS, doc="craters of planets"),
        valued(
            "ChartSymbol",
            chart.SYMBOL_RULE,
            count=chart.SECTORS,
            needs=("JumpTimer",),
            doc="what is in the chart's sectors, by symbol",
        ),
        valued("JumpTimer", chart.TIMER_RULE, doc="time left to choose a sector"),
        display("Score", SCORE.rule(30), role="score", doc="points"),
        display("Lives", LIVES_RULE, role="lives", doc="ships, this one included"),
        display("Fuel", FUEL_RULE, doc="fuel, in columns of its bar"),
        hud(
            "Scanner",
            scanner.WINDOW_RULE,
            colors=(0, 14),  # its lines and marks; the rest is the window's background
            doc="its window; the colour tells the target's kind",
        ),
        hud("ScannerTarget", scanner.TARGET_RULE, doc="what the scanner shows"),
        hud(
            "ScannerArrow",
            scanner.ARROW_RULE,
            count=2,
            doc="left: to a side or a cross; right: up or down",
        ),
        display("Distance", scanner.DISTANCE_RULE, doc="of the scanner's target"),
    ),
)
