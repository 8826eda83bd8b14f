"""Time of VEM for each game and batch size, and of its kernels, beside OCAtari's, OpenCV's and scipy's in the same run.

    python benchmarks/vision.py [GAME ...] [--peer PYTHON] [--core 0] [--largest 4096]

PYTHON is the interpreter of an environment that has OCAtari. On a CPU the process and the peer's are bound to one
core, and OpenCV to one thread. A figure is the median over repeated calls, each waited for, after a warm-up call; the spread is
10-90 %; compilation is timed apart. Frames are those in tests/data, repeated to the batch size.

The kernels are timed on frames of Pong, Space Invaders and Ms. Pac-Man, whatever games are given. OpenCV and scipy get masks that are
made and joined already, a frame at a time; where they find other boxes than the kernel did, the run ends with an error.
"""

import argparse
import importlib
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from extraction import bind, peer_times, recorded, repeated, timed

BATCHES = (1, 16, 64, 256, 1024, 4096)
KERNEL_BATCH = 256
MASKS = ((20,), (52,), (82,), (196,), (246,), (6,), (74, 138, 8, 214), (38, 184, 88, 70, 150, 12))  # of Space Invaders, Ms. Pac-Man

Rects = list[tuple[int, int, int, int]]  # x, y, w, h


def optional(name: str) -> Any:
    """A module, None where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"{name} is not installed, its figures are left out: the `dev` extra has it", file=sys.stderr)
        return None


def backend() -> str:
    """What jax runs on, asked in another process: this one is to be bound to a core before jax starts its threads."""
    code = "import jax; print(jax.default_backend())"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()[-1]


def compiled(f: Callable[..., Any], *inputs: Any) -> tuple[Callable[[Any], Any], float]:
    """The function compiled for these inputs (taken as one tuple), and the seconds that it took."""
    import jax

    start = time.perf_counter()
    program = jax.jit(f).lower(*inputs).compile()
    return (lambda x: program(*x)), time.perf_counter() - start


def a_frame(seconds: tuple[float, float, float], batch: int) -> tuple[float, list[str]]:
    """Microseconds a frame: the median, and the cells that show it and the spread."""
    median, low, high = (1e6 * t / batch for t in seconds)
    return median, [f"{median:.3f}", f"{low:.3f}-{high:.3f}"]


def beside(theirs: float | None, median: float) -> list[str]:
    """The cells of another's time and of its ratio to ours."""
    return [f"{theirs:.1f}", f"{theirs / median:,.1f}"] if theirs else ["", ""]


def contours(cv2: Any, mask: np.ndarray) -> Rects:
    """Boxes of the outer contours, by findContours."""
    found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return [cv2.boundingRect(c) for c in found]


def labelled_by_cv2(cv2: Any, mask: np.ndarray) -> Rects:
    """Boxes of the components, by connectedComponentsWithStats (an array, in fact)."""
    return cv2.connectedComponentsWithStats(mask)[2][1:, :4]


def labelled_by_scipy(ndimage: Any, mask: np.ndarray) -> Rects:
    """Boxes of the components, by label and find_objects."""
    labels, _ = ndimage.label(mask, np.ones((3, 3), bool))
    return [(x.start, y.start, x.stop - x.start, y.stop - y.start) for y, x in ndimage.find_objects(labels)]


def on_each(f: Callable[[np.ndarray], Any], masks: np.ndarray) -> None:
    """Call it for every frame."""
    for mask in masks:
        f(mask)


def vem_table(title: str, games: list[str], peer: str | None, largest: int) -> tuple[Any, list[str]]:
    """VEM as a whole."""
    import jax.numpy as jnp
    from rich.table import Table

    import ocjax

    table, ratios = Table(title=f"VEM, {title}", title_justify="left"), {}
    for heading in ("game", "compile s", "batch", "median", "10-90 %", "OCAtari", "ratio"):
        table.add_column(heading, justify="left" if heading == "game" else "right")
    for name in games:
        game = ocjax.load(name)
        figures, screens = peer_times(peer, game.name)["vem"], recorded(game.name)["screens"]
        theirs = figures[0] if figures else None
        for batch in (b for b in BATCHES if b <= largest):
            x = (jnp.asarray(repeated(screens, batch)),)
            program, seconds = compiled(game.vem, *x)
            median, cells = a_frame(timed(program, x), batch)
            table.add_row(game.name, f"{seconds:.2f}", f"{batch:,}", *cells, *beside(theirs, median))
            if theirs:
                ratios.setdefault(batch, []).append(theirs / median)
            print(f"{game.name} {batch}: {median:.3f} us", file=sys.stderr)
    means = [f"{b:,}: {statistics.geometric_mean(r):,.0f} times OCAtari's rate (geometric mean)" for b, r in ratios.items()]
    return table, means


def kernel_table(title: str) -> Any:
    """The parts that VEM is made of."""
    import jax
    import jax.numpy as jnp
    from rich.table import Table

    import ocjax
    from ocjax.boxes import WIDTH
    from ocjax.vision import bitmap as bm
    from ocjax.vision import rules
    from ocjax.vision.components import Search, components

    cv2, ndimage = optional("cv2"), optional("scipy.ndimage")
    peers: dict[str, Any] = {  # Callable[[np.ndarray], Rects] or None
        "cv2 contours": cv2 and partial(contours, cv2),
        "cv2 labels": cv2 and partial(labelled_by_cv2, cv2),
        "ndimage": ndimage and partial(labelled_by_scipy, ndimage),
    }
    if cv2:
        cv2.setNumThreads(1)

    table = Table(title=f"kernels, batch {KERNEL_BATCH}, {title}", title_justify="left")
    for heading in ("kernel", "frames", "compile s", "median", "10-90 %"):
        table.add_column(heading, justify="left" if heading in ("kernel", "frames") else "right", no_wrap=True)
    for heading in peers:
        table.add_column(heading, justify="right")
        table.add_column("ratio", justify="right")

    def row(kernel: str, frames: str, f: Callable[..., Any], *inputs: Any, theirs: dict[str, float] | None = None) -> Any:
        program, seconds = compiled(f, *inputs)
        median, cells = a_frame(timed(program, inputs), KERNEL_BATCH)
        others = [cell for name in peers for cell in beside((theirs or {}).get(name), median)]
        table.add_row(kernel, frames, f"{seconds:.2f}", *cells, *others)
        print(f"{kernel}, {frames}: {median:.3f} us", file=sys.stderr)
        return program(inputs)

    def category(game: Any, name: str) -> Any:
        return next(c for c in game.categories if c.name == name)

    def bitmaps(frames: jax.Array, *color_sets: tuple[int, ...]) -> tuple[bm.Bitmap, ...]:
        planes = bm.planes(frames)
        return tuple(bm.color_mask(planes, colors) for colors in color_sets)

    pong, invaders, pacman = (ocjax.load(name) for name in ("Pong", "SpaceInvaders", "MsPacman"))
    screens = {g.name: repeated(recorded(g.name)["screens"], KERNEL_BATCH) for g in (pong, invaders, pacman)}
    frames = {name: jnp.asarray(s) for name, s in screens.items()}

    planes = row("bit planes", "SpaceInvaders", bm.planes, frames["SpaceInvaders"])
    for n in (1, 4, 8):
        row(f"colour masks, {n}", "SpaceInvaders", lambda *p, n=n: [bm.color_mask(p, colors) for colors in MASKS[:n]], *planes)

    paddles = [category(pong, name).rule for name in ("Player", "Enemy", "Ball")]
    masks = jax.jit(lambda x: bitmaps(x, *(r.palette for r in paddles)))(frames["Pong"])
    row("Bounds, 1", "Pong", lambda m: rules._see_bounds(paddles[0], [m]), masks[0])
    row("Bounds, 3", "Pong", lambda *m: [rules._see_bounds(r, [w]) for r, w in zip(paddles, m, strict=True)], *masks)
    shields = category(invaders, "Shield").rule
    (red,) = jax.jit(lambda x: bitmaps(x, shields.palette))(frames["SpaceInvaders"])
    row("Bounds, 3 of one colour", "SpaceInvaders", lambda m: rules._see_bounds(shields, [m] * 3), red)

    pills = category(pacman, "Pill")
    (walls,) = jax.jit(lambda x: bitmaps(x, pills.rule.palette))(frames["MsPacman"])
    for c in (pills, category(pacman, "PowerPill")):
        row(f"Cells, {c.count}{' whole' if c.rule.whole else ''}", "MsPacman", partial(rules._see_cells, c.rule), walls)

    def component_rows(frames: str, words: bm.Bitmap, host: np.ndarray, searches: dict[str, Search]) -> None:
        """Searches that join in the same way, of the same mask: as a bitmap, and as bool `[B, H, W]`."""
        join = next(iter(searches.values())).join
        joined = np.zeros((len(host), host.shape[1] + join[1], host.shape[2] + join[0]), np.uint8)
        for i, j in np.ndindex(join[0] + 1, join[1] + 1):
            joined[:, j : j + host.shape[1], i : i + host.shape[2]] |= host
        theirs = {name: 1e6 * timed(partial(on_each, f), joined)[0] / KERNEL_BATCH for name, f in peers.items() if f}
        for kind, search in searches.items():
            (ours,) = row(f"components, {kind}", frames, lambda m, s=search: components([m], [s]), words, theirs=theirs)
            ours = jax.tree.map(np.asarray, ours)
            limit, n_unique = search.max_size or (WIDTH, 256), len(recorded(frames)["screens"])
            for name, f in peers.items():
                for b in range(n_unique if f else 0):
                    found = [(int(x), int(y), int(w) - join[0], int(h) - join[1]) for x, y, w, h in f(joined[b])]
                    want = sorted(r for r in found if r[2] <= limit[0] and r[3] <= limit[1])
                    got = sorted(tuple(int(v[k, b]) for v in ours[:4]) for k in np.flatnonzero(ours.valid[:, b]))
                    if got != want:
                        raise SystemExit(f"components, {kind}, {frames}, frame {b}: {got}, but {name}: {want}")

    alien = category(invaders, "Alien")
    rule, (left, top, right, bottom) = alien.rule, alien.rule.region
    (yellow,) = jax.jit(lambda x: tuple(rules._cut(m, rule.region) for m in bitmaps(x, rule.palette)))(frames["SpaceInvaders"])
    limits = {"up to 8 x 10": rule.max_size, "up to 31 x 31": (31, 31), "any size": None}
    searches = {k: Search(alien.count, rule.join, rule.min_size, limit) for k, limit in limits.items()}
    host = np.isin(screens["SpaceInvaders"], rule.palette)
    host = np.pad(host[:, top:bottom, left:right], ((0, 0), (0, 0), (left, WIDTH - right)))
    component_rows("SpaceInvaders", yellow, host, searches)
    host = np.isin(screens["MsPacman"], pills.rule.palette)
    component_rows("MsPacman", walls, host, {"up to 8 x 10": Search(200, max_size=(8, 10)), "any size": Search(200)})

    data = recorded("SpaceInvaders")
    before = repeated(data["screens"] ^ data["previous"], KERNEL_BATCH)  # stored as what changes
    both = [invaders.vem(x) for x in (jnp.asarray(before), frames["SpaceInvaders"])]
    row("merge_frames", "SpaceInvaders", ocjax.merge_frames, *both)
    row("track", "SpaceInvaders", ocjax.track, *both)
    return table


def main() -> None:
    """Print the tables, and the geometric means of VEM's ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("games", nargs="*")
    parser.add_argument("--peer", help="Python interpreter that has OCAtari")
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--largest", type=int, default=BATCHES[-1], help="leave out larger batches of VEM")
    arguments = parser.parse_args()
    on_cpu = backend() == "cpu"
    if on_cpu:
        bind(arguments.core)

    import jax
    from rich.console import Console

    import ocjax

    console = Console(width=160)
    where = "one CPU core" if on_cpu else f"GPU ({jax.devices()[0].device_kind}), others on the CPU"
    title = f"microseconds a frame, {where}, jax {jax.__version__}"
    table, means = vem_table(title, arguments.games or list(ocjax.games()), arguments.peer, arguments.largest)
    console.print(table, *means, kernel_table(title), sep="\n")


if __name__ == "__main__":
    main()
