"""Walk planned paths in the emulator, to test that a game's terrain tells where the player can go.

    python benchmarks/walks.py [GAME ...] [--walks 100] [--seed 0]

Each walk begins in a state of random play. A path on the terrain leads from the player to a random
reachable place at least 40 pixels away, and the joystick follows it. After a death the walk begins
again, at most three times. Columns, in percent of all walks: `arrived` within four pixels of the
place, `blocked` (the player pressed on for two seconds and did not move), `died` (four times) and
`late` (did not arrive in time). `length` is the mean length of the paths in pixels.

The rows are written to benchmarks/README.md.

The planner is a recipe: nodes are positions of the player's body, and SciPy finds the shortest
paths.
"""

import argparse
import collections
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import ale_py
import numpy as np
from _page import PageTable
from rich.progress import track
from scipy import ndimage, sparse
from scipy.sparse import csgraph

import ocjax
from ocjax.console.boxes import Area
from ocjax.console.playfield import area_mask
from ocjax.console.rom_files import rom_path

# By step, in ALE.
ACTIONS = {(0, 0): 0, (0, -1): 2, (1, 0): 3, (-1, 0): 4, (0, 1): 5, (1, -1): 6, (-1, -1): 7}
LADDERS = ("ladder", "shaft")
ROPES = ("rope", "pole", "vine")
CLIMBED = LADDERS + ROPES
PITS = ("hole", "tar", "water")  # below the surface of a floor
DASHED = ("conveyor", "bridge")  # floors that are drawn with gaps
LEAST_DISTANCE = 40
NEAR = 4  # pixels from the place
TRIES = 4
PATIENCE = 120  # frames without a move
FRAMES_PER_PIXEL = 8
LADDER_GAP = 10  # pixels between rails
PIT_DEPTH = 10  # lines from the surface to the bottom of a pit's narrowest part
HOLE = 3  # most lines of a hole in a girder
MOST_FLOOR = 12  # lines of a floor that the player climbs through
SETTLE = 60  # frames without action before a walk on floors
MOST_SNAP = 6  # pixels from the player to a node
BEGIN, END = "<!-- walks -->", "<!-- /walks -->"
HEADER = ("game", "walks", "arrived", "blocked", "died", "late", "length")


@dataclass(frozen=True)
class Walker:
    """How the player of a game moves.

    Args:
        body: width and height that walls stop.
        moves: "free" in four directions, on "lines", on "floors" and ladders, or "flies": the
            player sinks unless the stick points up.
        lookahead: pixels of the path that decide the direction. In games where the stick chooses
            the next turn, more than 1.
        player: category of the player.
        kept: bytes of RAM that are written before each frame, to keep enemies away.
        plays: bytes of RAM in which the player is alive and moves.
        most: bytes of RAM, and their most value while the player is alive.
        step: most pixels between floors that the player walks over.
        grip: most pixels between the middles of the player and a ladder.
        rungs: lines between the rungs of ladders, which end at floors; 0: ladders have no gaps.
        sunk: lines of thick floors that are behind the player's feet.
        foot: width of the body's middle that must be above a floor.
        stride: pixels of a step across and of one down.
        avoid: categories of objects that lead elsewhere, such as the rooms of a hall.
        scroll: byte of RAM that counts what the screen has scrolled down, and pixels of a unit.
        area: left, top, right and bottom of the field, without the outside that tunnels lead to;
            None if walls enclose it.
    """

    body: tuple[int, int]
    moves: str = "free"
    lookahead: int = 1
    player: str = "Player"
    kept: Mapping[int, int] = field(default_factory=dict)
    step: int = 2
    grip: int = 2
    plays: Mapping[int, int] = field(default_factory=dict)
    rungs: int = 0
    sunk: int = 0
    most: Mapping[int, int] = field(default_factory=dict)
    foot: int = 2
    stride: tuple[int, int] = (1, 1)
    avoid: tuple[str, ...] = ()
    scroll: tuple[int, int] | None = None
    area: Area | None = None


# Ms. Pac-Man's ghosts, in the middle of the pen: their modes, columns and rows.
PENNED: dict[int, int] = {
    **dict.fromkeys(range(1, 5), 112),
    **dict.fromkeys(range(6, 10), 88),
    **dict.fromkeys(range(12, 16), 72),
}
# Pac-Man's ghosts, in the pen.
CAUGHT: dict[int, int] = {
    **dict.fromkeys(range(50, 54), 76),
    **dict.fromkeys(range(55, 59), 33),
    **dict.fromkeys(range(60, 64), 0),
}
PLAYER_ONLY = {92: 4}  # Amidar: every turn is the player's, so the others stand still
# Bank Heist: banks outside the maze instead of police, no dynamite, a full tank.
NO_DANGER: dict[int, int] = {
    **dict.fromkeys(range(9, 12), 200),
    **dict.fromkeys(range(24, 27), 253),
    63: 1,
    86: 0,
}
# Alien: no aliens, and no eaten eggs, so the maze never ends.
NO_ALIENS: dict[int, int] = {**dict.fromkeys(range(42, 45), 0), 91: 0}
# Hero: no beings, and full power.
NO_BEINGS: dict[int, int] = {**dict.fromkeys(range(37, 43), 147), 43: 81}
# Kangaroo: no monkeys and coconuts, and the time stands still.
NO_MONKEYS: dict[int, int] = {
    **dict.fromkeys(range(4, 8), 255),
    **dict.fromkeys(range(21, 24), 255),
    33: 255,
    59: 0x20,
}
# Donkey Kong: no barrels, and the bonus does not count down.
NO_BARRELS: dict[int, int] = {**dict.fromkeys(range(4), 0), 36: 0x50}
NO_DRAGONS: dict[int, int] = {36: 27, 41: 27, 46: 27}  # Adventure: all in a room far away
# Berzerk: an empty list of robots, no shot, no Otto.
NO_ROBOTS = {**dict.fromkeys(range(56, 64), 127), 26: 0, 118: 0}
NO_CREATURES = {9: 255, 12: 255, 15: 255, 36: 240}  # Tutankham: and a full timer
NO_HALLMONSTERS = dict.fromkeys(range(20, 26), 81)  # Venture: below the screen
NO_MONSTERS = dict.fromkeys(range(80, 86), 0)  # Wizard of Wor
WALKERS = {
    "Adventure": Walker((4, 8), kept=NO_DRAGONS, area=(8, 36, 152, 212), stride=(4, 8)),
    "Alien": Walker((8, 13), lookahead=4, kept=NO_ALIENS, area=(16, 5, 144, 173)),
    "Amidar": Walker((4, 3), "lines", lookahead=4, kept=PLAYER_ONLY),
    "BankHeist": Walker((8, 8), lookahead=4, kept=NO_DANGER, area=(16, 37, 144, 178)),
    "Berzerk": Walker((8, 20), kept=NO_ROBOTS, most={17: 2}, area=(8, 8, 152, 176)),
    # without Donkey Kong's girder and the one below, where barrels and the end of the board are
    "DonkeyKong": Walker(
        (8, 17),
        "floors",
        kept=NO_BARRELS,
        plays={12: 255},
        grip=0,
        rungs=3,
        area=(28, 46, 132, 196),
    ),
    "Hero": Walker((8, 24), "flies", lookahead=6, kept=NO_BEINGS, area=(8, 20, 160, 137)),
    # without the child's floor, where the level ends
    "Kangaroo": Walker(
        (8, 24), "floors", kept=NO_MONKEYS, grip=0, rungs=4, area=(16, 10, 144, 180)
    ),
    "MontezumaRevenge": Walker(body=(8, 20), moves="floors", grip=1, kept={46: 8}, plays={2: 4}),
    "MsPacman": Walker(body=(8, 10), lookahead=4, kept=PENNED),
    "Pacman": Walker((8, 14), lookahead=4, kept=CAUGHT, area=(0, 25, 160, 195)),
    # scenes with a ladder, in which Harry stands
    "Pitfall": Walker(
        (8, 20), "floors", plays={20: 0, 100: 5}, rungs=2, sunk=8, foot=8, area=(12, 0, 148, 190)
    ),
    "Tutankham": Walker(
        (7, 8), kept=NO_CREATURES, area=(8, 35, 152, 175), stride=(4, 4), scroll=(65, 4)
    ),
    "Venture": Walker(
        (1, 2), kept=NO_HALLMONSTERS, area=(4, 26, 156, 182), stride=(1, 2), avoid=("Room",)
    ),
    "WizardOfWor": Walker((8, 16), lookahead=4, kept=NO_MONSTERS, area=(16, 24, 144, 141)),
}


# --------------------------------------------------------------------------------------------------
# plans


def free_positions(blocked: np.ndarray, body: tuple[int, int]) -> np.ndarray:
    """Positions of the body's upper left corner at which it covers no blocked pixel, `[H, W]`."""
    width, height = body
    padded = np.pad(blocked, ((0, height), (0, width)), constant_values=True)
    total = np.pad(padded.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    h, w = blocked.shape
    in_rows = total[height : height + h] - total[:h]
    covered: Any = in_rows[:, width : width + w] - in_rows[:, :w]
    return covered == 0


def kinds_of(game: Any, masks: np.ndarray, effect: str, names: tuple[str, ...] = ()) -> np.ndarray:
    """Pixels of the kinds with an effect, and of these names if some are given, bool `[H, W]`."""
    chosen = [kind.effect == effect and (not names or kind.name in names) for kind in game.terrain]
    return np.asarray(masks[chosen].any(axis=0))


def nodes_and_edges(
    game: Any, masks: np.ndarray, walker: Walker, avoided: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, bool `[H, W]`, and edges with their costs: int `[n, 2]` of flat positions, `[n]`."""
    blocked = kinds_of(game, masks, "blocks") | avoided
    if walker.moves == "lines":
        blocked = ~without_gaps(kinds_of(game, masks, "carries"))
    if walker.area is not None:
        blocked = blocked | ~area_mask(walker.area, game.screen[0])
    kills = kinds_of(game, masks, "kills")
    if walker.moves != "floors":
        free = free_positions(blocked | kills, walker.body)
        depth = np.asarray(ndimage.distance_transform_cdt(np.pad(free, 1), "taxicab"))
        room = np.minimum(depth[1:-1, 1:-1], 6)
        cost = 1.0 + 2 * (6 - room)
        return free, *edges_between(free, free, cost, across=True, down=True, stride=walker.stride)
    width, height = walker.body
    carries = kinds_of(game, masks, "carries")
    climbed = kinds_of(game, masks, "carries", CLIMBED)
    floors = blocked | (carries & ~climbed) | filled(kinds_of(game, masks, "carries", DASHED))
    if walker.rungs:
        floors = np.asarray(ndimage.binary_closing(floors, np.ones((HOLE + 1, 1))))
    floors = lowered(floors & ~above_pits(game, masks), walker.sunk)
    free = free_positions(blocked | kills, walker.body)
    foot_left = (width - walker.foot) // 2
    no_floor = moved_left(free_positions(floors, (walker.foot, 1)), foot_left)
    stands = free & ~shifted(no_floor, height) & shifted(no_floor, height - 1)
    drawn = kinds_of(game, masks, "carries", LADDERS)
    rungs = between_floors(drawn, floors & ~blocked, walker.rungs) if walker.rungs else drawn
    ladders = moved_left(middles_of_runs(rungs, walker.grip), width // 2)
    ropes = moved_left(
        middles_of_runs(kinds_of(game, masks, "carries", ROPES), walker.grip), width // 2
    )
    on_ladder = shifted(np.asarray(ndimage.maximum_filter1d(ladders, 3, axis=0)), height - 1)
    climbs = on_ladder | (ropes & shifted(ropes, height - 1))
    if walker.area is not None:
        climbs &= free_positions(~area_mask(walker.area, game.screen[0]), walker.body)
    flat = np.ones(free.shape)
    sideways = edges_between(stands, stands, flat, across=True, down=False, step=walker.step)
    upright = edges_between(climbs | stands, climbs, flat, across=True, down=True)
    pairs = np.concatenate([sideways[0], upright[0]])
    return stands | climbs, pairs, np.concatenate([sideways[1], upright[1]])


def above_pits(game: Any, masks: np.ndarray) -> np.ndarray:
    """Pixels a few lines above a pit: the surface of a floor may be drawn over it."""
    chosen = [kind.name in PITS for kind in game.terrain]
    pits = np.pad(masks[chosen].any(axis=0), ((0, PIT_DEPTH), (0, 0)))
    lines = np.lib.stride_tricks.sliding_window_view(pits, PIT_DEPTH + 1, axis=0)
    return np.asarray(lines.any(axis=-1))


def lowered(floors: np.ndarray, lines: int) -> np.ndarray:
    """Floors without the upper lines of those that are thicker."""
    thick = np.asarray(ndimage.binary_opening(floors, np.ones((lines + 1, 1))), bool)
    below = np.pad(thick, ((lines, 0), (0, 0)))[: len(thick)]
    return floors & ~thick | thick & below


def filled(mask: np.ndarray) -> np.ndarray:
    """The boxes around pixels that are close to each other."""
    out = np.zeros_like(mask)
    near = ndimage.binary_dilation(mask, np.ones((5, 2 * LADDER_GAP + 1)))
    labels, _ = ndimage.label(near)  # pyright: ignore
    for box in ndimage.find_objects(labels):
        ys, xs = np.nonzero(mask[box])
        top, left = box[0].start, box[1].start
        out[top + ys.min() : top + ys.max() + 1, left + xs.min() : left + xs.max() + 1] = True
    return out


def between_floors(rungs: np.ndarray, floors: np.ndarray, gap: int) -> np.ndarray:
    """Ladders whose rungs, at most `gap` lines apart, lead from a floor to the floor above.

    The player climbs through the floor above.
    """
    joined = ndimage.binary_closing(rungs | floors, np.ones((gap + 1, 1))) & ~floors
    labels, _ = ndimage.label(joined, np.array([[0, 1, 0]] * 3))  # pyright: ignore
    ends = np.pad(floors, ((1, 1), (0, 0)))
    out = np.zeros_like(rungs)
    for box in ndimage.find_objects(labels):
        lines, column = box[0], box[1].start
        has_floors = ends[lines.start, column] and ends[lines.stop + 1, column]
        out[box] |= bool(rungs[box].any() and has_floors)
    for _ in range(MOST_FLOOR):
        out |= shifted(out, 1) & floors
    return out


def moved_left(mask: np.ndarray, columns: int) -> np.ndarray:
    """The mask read so many columns further right; False beside the screen."""
    return np.pad(mask, ((0, 0), (0, columns)))[:, columns:]


def middles_of_runs(mask: np.ndarray, most: int) -> np.ndarray:
    """Pixels at most so far from the middle of a run of a row; runs may have gaps of a ladder."""
    out = np.zeros_like(mask)
    for y, row in enumerate(mask):
        columns = np.flatnonzero(row)
        for run in np.split(columns, np.flatnonzero(np.diff(columns) > LADDER_GAP) + 1):
            if len(run):
                middle = (run[0] + run[-1] + 1) // 2
                out[y, max(middle - most, 0) : middle + most + 1] = True
    return out


def without_gaps(mask: np.ndarray) -> np.ndarray:
    """The mask with gaps of a row filled."""
    return np.asarray(ndimage.binary_closing(mask, np.ones((3, 1))), bool)


def shifted(mask: np.ndarray, rows: int) -> np.ndarray:
    """The mask read so many rows further down; True below the screen."""
    return np.pad(mask, ((0, rows), (0, 0)), constant_values=True)[rows:]


def edges_between(
    start: np.ndarray,
    end: np.ndarray,
    cost: np.ndarray,
    *,
    across: bool,
    down: bool,
    step: int = 0,
    stride: tuple[int, int] = (1, 1),
) -> tuple[np.ndarray, np.ndarray]:
    """Edges of one pixel, or of a stride, in both directions, and their costs.

    With `step`, an edge across may also go so many rows up or down.
    """
    h, w = start.shape
    number = np.arange(h * w).reshape(h, w)
    pairs = []
    offsets = [(dy, stride[0]) for dy in range(-step, step + 1)] if across else []
    for dy, dx in [*offsets, *([(stride[1], 0)] if down else [])]:
        rows, below = slice(max(-dy, 0), h - max(dy, 0)), slice(max(dy, 0), h + min(dy, 0))
        one = start[rows, : w - dx] & end[below, dx:] | end[rows, : w - dx] & start[below, dx:]
        pairs.append(np.stack([number[rows, : w - dx][one], number[below, dx:][one]], axis=1))
    both = np.concatenate([*pairs, *(pair[:, ::-1] for pair in pairs)])
    return both, cost.ravel()[both[:, 1]]


@dataclass(frozen=True)
class Plan:
    """The shortest ways from all nodes to one place, as flat positions."""

    ahead: np.ndarray  # the next node of the way, negative at the place and off the ways
    distance: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def to(cls, place: int, nodes: np.ndarray, pairs: np.ndarray, costs: np.ndarray) -> "Plan":
        """Plan all ways to a place."""
        size = nodes.size
        graph = sparse.coo_array((costs, (pairs[:, 1], pairs[:, 0])), (size, size)).tocsr()
        distance, ahead = csgraph.dijkstra(graph, indices=place, return_predecessors=True)
        return cls(ahead, distance, nodes.shape)

    def way(self, start: int, most: int) -> np.ndarray:
        """The next nodes from a node on, as (x, y) `[n, 2]`, at most `most`."""
        nodes = [start]
        while len(nodes) <= most and self.ahead[nodes[-1]] >= 0:
            nodes.append(int(self.ahead[nodes[-1]]))
        y, x = np.divmod(np.array(nodes), self.shape[1])
        return np.stack([x, y], axis=1)

    def nearest(self, x: int, y: int) -> int | None:
        """The node with a way that is nearest to a position, if there is one near."""
        h, w = self.shape
        top, left = max(y - MOST_SNAP, 0), max(x - MOST_SNAP, 0)
        ys, xs = np.mgrid[top : min(y + MOST_SNAP + 1, h), left : min(x + MOST_SNAP + 1, w)]
        off = np.abs(ys - y) + np.abs(xs - x) + 1e9 * np.isinf(self.distance[ys * w + xs])
        if off.size == 0 or off.min() >= 1e9:
            return None
        return int((ys * w + xs).ravel()[off.argmin()])


# --------------------------------------------------------------------------------------------------
# walks


class Player:
    """A game in the emulator, and where its player is."""

    def __init__(self, name: str, seed: int) -> None:
        self.game: Any = ocjax.load(name)
        self.walker = WALKERS[name]
        self._slot = self.game.slices[self.walker.player].start
        ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
        self.ale = ale_py.ALEInterface()
        self.ale.setInt("random_seed", seed)
        self.ale.setFloat("repeat_action_probability", 0.0)
        self.ale.loadROM(rom_path(self.game.rom))
        self.rng = np.random.default_rng(seed)
        self.origin = 0  # what the screen had scrolled when the walk began

    def act(self, action: int) -> None:
        """Emulate a frame."""
        for address, value in self.walker.kept.items():
            self.ale.setRAM(address, value)
        self.ale.act(action)

    def position(self) -> tuple[int, int] | None:
        """The upper left corner of the player's body, or None."""
        objects = self.game.rem(self.ale.getRAM())
        if not bool(objects.valid[self._slot]):
            return None
        x, y, w, h = np.asarray(objects.xywh[self._slot]).astype(int).tolist()
        width, height = self.walker.body
        left = x + (w - width) // 2
        y = y + self.scrolled() - self.origin
        return left, (y + h - height if self.walker.moves == "floors" else y + (h - height) // 2)

    def scrolled(self) -> int:
        """Pixels that the screen has scrolled down, from the map's top."""
        if self.walker.scroll is None:
            return 0
        address, pixels = self.walker.scroll
        return pixels * int(self.ale.getRAM()[address])

    def avoided(self) -> np.ndarray:
        """Pixels in the boxes of the objects that lead elsewhere, bool `[H, W]`."""
        objects = self.game.rem(self.ale.getRAM())
        out = np.zeros(self.game.screen, bool)
        for name in self.walker.avoid:
            slots = self.game.slices[name]
            boxes = np.asarray(objects.xywh[slots])[np.asarray(objects.valid[slots])].astype(int)
            for x, y, w, h in boxes.tolist():
                out[y : y + h, x : x + w] = True
        return out

    def settled(self) -> tuple[int, int] | None:
        """The position, on floors after some frames without action, if he stands still then."""
        if any(self.ale.getRAM()[at] > value for at, value in self.walker.most.items()):
            return None
        if self.walker.moves != "floors":
            return self.position()
        lives = self.ale.lives()
        places = []
        for _ in range(SETTLE):
            places.append(self.position())
            self.act(ACTIONS[(0, 0)])
        ram = self.ale.getRAM()
        alive = all(ram[address] == value for address, value in self.walker.plays.items())
        stood = places[SETTLE // 2] == places[-1] and alive
        return places[-1] if stood and self.ale.lives() == lives else None

    def masks(self) -> np.ndarray:
        """The terrain, bool `[kinds, H, W]`."""
        return np.asarray(self.game.terrain_of(self.ale.getRAM()).masks)

    def play(self, frames: int) -> None:
        """Play at random, each action for 4 to 16 frames; begin again after the end."""
        actions = [int(action.value) for action in self.ale.getMinimalActionSet()]
        while frames > 0:
            if self.ale.game_over():
                self.ale.reset_game()
            action, hold = self.rng.choice(actions), int(self.rng.integers(4, 17))
            for _ in range(hold):
                self.act(int(action))
            frames -= hold


def drawn_place(player: Player, plan_from: Plan, nodes: np.ndarray, start: int) -> int | None:
    """A random reachable place far enough from a node."""
    y, x = np.divmod(np.flatnonzero(nodes), nodes.shape[1])
    begin_y, begin_x = divmod(start, nodes.shape[1])
    reachable = np.isfinite(plan_from.distance[np.flatnonzero(nodes)])
    far = np.hypot(x - begin_x, y - begin_y) >= LEAST_DISTANCE
    places = np.flatnonzero(nodes)[reachable & far]
    return int(player.rng.choice(places)) if len(places) else None


def outcome(player: Player, plan: Plan, place: int, length: int) -> str:
    """Follow a plan from the present state: "arrived", "blocked", "died" or "late"."""
    goal_y, goal_x = divmod(place, plan.shape[1])
    lives, still, last = player.ale.lives(), 0, (-1, -1)
    for _ in range(FRAMES_PER_PIXEL * length + 2 * PATIENCE):
        at = player.position()
        if player.ale.game_over() or player.ale.lives() < lives:
            return "died"
        if at is None:
            player.act(0)
            continue
        if max(abs(at[0] - goal_x), abs(at[1] - goal_y)) <= NEAR:
            return "arrived"
        still = still + 1 if at == last else 0
        if still > PATIENCE:
            return "blocked"
        last, node = at, plan.nearest(*at)
        player.act(ACTIONS[(0, 0)] if node is None else direction(plan, node, player.walker))
    return "late"


def direction(plan: Plan, node: int, walker: Walker) -> int:
    """The action that leads along the way from a node.

    On floors the player climbs as soon as the ladder is within his grip.
    """
    on_floors = walker.moves == "floors"
    way = plan.way(node, walker.grip + 1 if on_floors else walker.lookahead)
    moves = np.sign(np.diff(way, axis=0))
    if not len(moves):
        return ACTIONS[(0, 0)]
    if walker.moves == "flies":
        aside = moves[moves[:, 0] != 0, 0]
        return ACTIONS[(int(aside[0]) if len(aside) else 0, -1 if moves[:, 1].min() < 0 else 0)]
    upright = moves[moves[:, 0] == 0]  # a step on a slope also goes across
    x, y = (upright[0] if on_floors and len(upright) else moves[-1]).tolist()
    return ACTIONS[(x, 0) if x else (0, y)]


def walk(player: Player) -> tuple[str, int] | None:
    """Walk once from the present state; the outcome and the path's length, or None without one."""
    player.origin = player.scrolled()
    at = player.settled()
    if at is None:
        return None
    nodes, pairs, costs = nodes_and_edges(
        player.game, player.masks(), player.walker, player.avoided()
    )
    around = Plan(np.zeros(0), np.where(nodes, 0.0, np.inf).ravel(), nodes.shape)
    start = around.nearest(*at)
    if start is None:
        return None
    place = drawn_place(player, Plan.to(start, nodes, pairs, costs), nodes, start)
    if place is None:
        return None
    plan = Plan.to(place, nodes, pairs, costs)
    length = int(np.abs(np.diff(plan.way(start, 2000), axis=0)).sum())
    state = player.ale.cloneState()
    result = "died"
    for _ in range(TRIES):
        result = outcome(player, plan, place, length)
        player.ale.restoreState(state)
        if result != "died":
            break
        for _ in range(int(player.rng.integers(0, 16))):
            player.act(0)
    player.ale.restoreState(state)
    return result, length


def measure(name: str, walks: int, seed: int) -> list[str]:
    """Walk in one game; a row of the table."""
    player = Player(name, seed)
    results: collections.Counter[str] = collections.Counter()
    lengths = []
    for _ in track(range(walks), name, transient=True):
        while True:
            player.play(int(player.rng.integers(60, 400)))
            walked = walk(player)
            if walked is not None:
                break
        results[walked[0]] += 1
        lengths.append(walked[1])
    share = [f"{100 * results[key] / walks:.0f}" for key in HEADER[2:6]]
    return [name, str(walks), *share, f"{np.mean(lengths):.0f}"]


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n")[0])
    parser.add_argument("games", nargs="*", help="default: all games with a walker")
    parser.add_argument("--walks", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    table = PageTable(BEGIN, END, HEADER)
    table.measure(args.games or WALKERS, lambda name: measure(name, args.walks, args.seed))


if __name__ == "__main__":
    main()
