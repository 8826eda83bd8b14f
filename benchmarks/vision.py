"""Time VEM and its kernels, beside OCAtari, OpenCV and SciPy in the same run.

    python benchmarks/vision.py [GAME ...] [--ocatari PYTHON] [--core 0] [--largest 4096]

VEM is timed for each game and batch size. PYTHON is the interpreter of an environment with OCAtari.
On a CPU, this process and OCAtari's are bound to one core, and OpenCV to one thread. A time is the
median of repeated, synchronous calls after a warm-up call; the spread is the 10th to 90th
percentile. Compilation is timed separately. The frames in tests/data are repeated to fill the
batch.

The kernels are always timed on frames of Pong, Space Invaders and Ms. Pac-Man. OpenCV and SciPy get
ready masks with closed gaps, one frame at a time. If they and the kernel find different boxes, the
run ends with an error.
"""

import argparse
import importlib
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from _page import freed_memory
from extraction import bind, ocatari_times, recorded, repeated, timed

if TYPE_CHECKING:
    import jax

    from ocjax import Game
    from ocjax.vision.bitmap import Bitmap
    from ocjax.vision.components import Search

BATCHES = (1, 16, 64, 256, 1024, 4096)
KERNEL_BATCH = 256
KERNEL_GAMES = ("Pong", "SpaceInvaders", "MsPacman")
# colours of Space Invaders and Ms. Pac-Man
MASKS = (
    (20,),
    (52,),
    (82,),
    (196,),
    (246,),
    (6,),
    (74, 138, 8, 214),
    (38, 184, 88, 70, 150, 12),
)

Rects = list[tuple[int, int, int, int]]  # x, y, w, h


def optional(name: str) -> Any:
    """Import a module; None if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        print(
            f"{name} is not installed, so its times are missing: the extra `dev` has it",
            file=sys.stderr,
        )
        return None


def backend() -> str:
    """JAX's backend, from another process.

    This process must be bound to a core before JAX starts its threads.
    """
    code = "import jax; print(jax.default_backend())"
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()[-1]


def compiled(f: Callable[..., Any], *inputs: Any) -> tuple[Callable[[Any], Any], float]:
    """Compile a function for these inputs.

    Returns a function of their tuple, and the seconds of the compilation.
    """
    import jax

    start = time.perf_counter()
    program = jax.jit(f).lower(*inputs).compile()
    return (lambda x: program(*x)), time.perf_counter() - start


def per_frame(seconds: tuple[float, float, float], batch: int) -> tuple[float, list[str]]:
    """Microseconds per frame: the median, and cells with the median and the spread."""
    median, low, high = (1e6 * t / batch for t in seconds)
    return median, [f"{median:.3f}", f"{low:.3f}-{high:.3f}"]


def comparison(theirs: float | None, median: float) -> list[str]:
    """Cells with another program's time and its ratio to VEM's."""
    return [f"{theirs:.1f}", f"{theirs / median:,.1f}"] if theirs else ["", ""]


def table(title: str, text_columns: Sequence[str], columns: Sequence[str]) -> Any:
    """An empty table."""
    from rich.table import Table

    out = Table(title=title, title_justify="left")
    for heading in (*text_columns, *columns):
        out.add_column(
            heading,
            justify="left" if heading in text_columns else "right",
            no_wrap=heading != "ratio",
        )
    return out


# ------------------------------------------------------------------------------------------
# other programs


def contours(cv2: Any, mask: np.ndarray) -> Rects:
    """Boxes of the outer contours, by OpenCV's findContours."""
    found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return [cv2.boundingRect(c) for c in found]


def labelled_by_cv2(cv2: Any, mask: np.ndarray) -> Rects:
    """Boxes of the components, by OpenCV's connectedComponentsWithStats (as an array)."""
    return cv2.connectedComponentsWithStats(mask)[2][1:, :4]


def labelled_by_scipy(ndimage: Any, mask: np.ndarray) -> Rects:
    """Boxes of the components, by SciPy's label and find_objects."""
    labels, _ = ndimage.label(mask, np.ones((3, 3), bool))
    return [
        (x.start, y.start, x.stop - x.start, y.stop - y.start)
        for y, x in ndimage.find_objects(labels)
    ]


def others() -> dict[str, Callable[[np.ndarray], Rects] | None]:
    """Other programs' functions that find boxes in a mask; missing programs are None."""
    cv2, ndimage = optional("cv2"), optional("scipy.ndimage")
    if cv2:
        cv2.setNumThreads(1)
    return {
        "cv2 contours": partial(contours, cv2) if cv2 else None,
        "cv2 labels": partial(labelled_by_cv2, cv2) if cv2 else None,
        "ndimage": partial(labelled_by_scipy, ndimage) if ndimage else None,
    }


def on_each(f: Callable[[np.ndarray], Any], masks: np.ndarray) -> None:
    """Call a function on every frame."""
    for mask in masks:
        f(mask)


# ------------------------------------------------------------------------------------------
# VEM


def vem_table(
    title: str, games: list[str], python: str | None, largest: int
) -> tuple[Any, list[str]]:
    """Time VEM: the table, and lines with the geometric means of the ratios."""
    import jax.numpy as jnp

    import ocjax

    ratios: dict[int, list[float]] = {}
    out = table(
        f"VEM, {title}",
        ["game"],
        ["compilation s", "batch", "median", "10-90 %", "OCAtari", "ratio"],
    )
    for name in games:
        game = ocjax.load(name)
        times, screens = ocatari_times(python, game.name)["vem"], recorded(game.name)["screens"]
        theirs = times[0] if times else None
        for batch in (b for b in BATCHES if b <= largest):
            x = (jnp.asarray(repeated(screens, batch)),)
            program, seconds = compiled(game.vem, *x)
            median, cells = per_frame(timed(program, x), batch)
            out.add_row(
                game.name, f"{seconds:.2f}", f"{batch:,}", *cells, *comparison(theirs, median)
            )
            if theirs:
                ratios.setdefault(batch, []).append(theirs / median)
            print(f"{game.name} {batch}: {median:.3f} us", file=sys.stderr)
    means = [
        f"{b:,}: {statistics.geometric_mean(r):,.0f} times OCAtari's rate (geometric mean)"
        for b, r in ratios.items()
    ]
    return out, means


# ------------------------------------------------------------------------------------------
# kernels


class Kernels:
    """Times of VEM's kernels, in a table.

    Args:
        title: title of the table.
    """

    def __init__(self, title: str) -> None:
        import jax.numpy as jnp

        import ocjax

        self.others = others()
        columns = [column for name in self.others for column in (name, "ratio")]
        self.table = table(
            f"Kernels, batch {KERNEL_BATCH}, {title}",
            ["kernel", "frames"],
            ["compilation s", "median", "10-90 %", *columns],
        )
        self.games: dict[str, Game] = {name: ocjax.load(name) for name in KERNEL_GAMES}
        self.screens = {
            name: repeated(recorded(name)["screens"], KERNEL_BATCH) for name in KERNEL_GAMES
        }
        self.frames = {name: jnp.asarray(screens) for name, screens in self.screens.items()}

    def row(
        self,
        kernel: str,
        frames: str,
        f: Callable[..., Any],
        *inputs: Any,
        theirs: dict[str, float] | None = None,
    ) -> Any:
        """Time a kernel, add a row, and return the kernel's result.

        Args:
            kernel: its name.
            frames: the game of the frames.
            f: the kernel.
            inputs: its arguments.
            theirs: microseconds per frame of other programs.
        """
        program, seconds = compiled(f, *inputs)
        median, cells = per_frame(timed(program, inputs), KERNEL_BATCH)
        compared = [
            cell for name in self.others for cell in comparison((theirs or {}).get(name), median)
        ]
        self.table.add_row(kernel, frames, f"{seconds:.2f}", *cells, *compared)
        print(f"{kernel}, {frames}: {median:.3f} us", file=sys.stderr)
        return program(inputs)

    def category(self, game: str, name: str) -> Any:
        """A category by name. The caller knows the type of its rule."""
        return next(c for c in self.games[game].categories if c.name == name)

    def masks(self) -> None:
        """Bit planes and colour masks."""
        from ocjax.vision import bitmap as bm

        planes = self.row("bit planes", "SpaceInvaders", bm.planes, self.frames["SpaceInvaders"])
        for n in (1, 4, 8):
            self.row(
                f"colour masks, {n}",
                "SpaceInvaders",
                lambda p, n=n: [bm.color_mask(p, colors) for colors in MASKS[:n]],
                planes,
            )

    def rules(self) -> None:
        """The rules that read fixed places: Bounds and Cells."""
        from ocjax.vision.bounds import detect_bounds
        from ocjax.vision.cells import detect_cells

        sides = [self.category("Pong", name).rule for name in ("Player", "Enemy", "Ball")]
        words = bitmaps(self.frames["Pong"], *(rule.palette for rule in sides))
        self.row("Bounds, 1", "Pong", lambda m: detect_bounds(sides[:1], [[m]]), words[0])
        self.row("Bounds, 3", "Pong", lambda *m: detect_bounds(sides, [[w] for w in m]), *words)
        shields = self.category("SpaceInvaders", "Shield").rule
        (red,) = bitmaps(self.frames["SpaceInvaders"], shields.palette)
        self.row(
            "Bounds, 3 of one colour",
            "SpaceInvaders",
            lambda m: detect_bounds([shields], [[m] * 3]),
            red,
        )
        for name in ("Pill", "PowerPill"):
            pills = self.category("MsPacman", name)
            (walls,) = bitmaps(self.frames["MsPacman"], pills.rule.palette)
            kernel = f"Cells, {pills.count}{' whole' if pills.rule.whole else ''}"
            self.row(kernel, "MsPacman", partial(detect_cells, pills.rule), walls)

    def components(self) -> None:
        """Connected components of one colour in a region, and of walls on the whole screen.

        The colour is from Space Invaders, and the walls are Ms. Pac-Man's.
        """
        import jax

        from ocjax.console.boxes import WIDTH
        from ocjax.vision import bitmap
        from ocjax.vision.components.search import Search
        from ocjax.vision.shapes import Shape

        alien = self.category("SpaceInvaders", "Alien")
        rule, (left, top, right, bottom) = alien.rule, alien.rule.region
        (words,) = bitmaps(self.frames["SpaceInvaders"], rule.palette)
        words = jax.jit(lambda m: bitmap.cut(m, rule.region))(words)
        shapes = {
            "up to 8 x 10": rule.shapes,
            "up to 31 x 32": Shape(),
        }
        searches = {
            name: Search(alien.count, (shape,), gap=rule.gap) for name, shape in shapes.items()
        }
        mask = np.isin(self.screens["SpaceInvaders"], rule.palette)
        mask = np.pad(mask[:, top:bottom, left:right], ((0, 0), (0, 0), (left, WIDTH - right)))
        self.component_rows("SpaceInvaders", words, mask, searches)

        colors = self.category("MsPacman", "Pill").rule.palette
        (walls,) = bitmaps(self.frames["MsPacman"], colors)
        mask = np.isin(self.screens["MsPacman"], colors)
        self.component_rows(
            "MsPacman",
            walls,
            mask,
            {
                "up to 8 x 10": Search(200, (Shape(w=(1, 8), h=(1, 10)),)),
                "up to 31 x 32": Search(200),
            },
        )

    def component_rows(
        self, frames: str, words: "Bitmap", mask: np.ndarray, searches: "dict[str, Search]"
    ) -> None:
        """Time searches of one mask that close the same gaps.

        Args:
            frames: the game.
            words: the mask as a bitmap.
            mask: the same as bool `[B, H, W]`.
            searches: the searches by name.
        """
        import jax

        from ocjax.vision.components import components

        gap = next(iter(searches.values())).gap
        closed = np.zeros((len(mask), mask.shape[1] + gap[1], mask.shape[2] + gap[0]), np.uint8)
        for i, j in np.ndindex(gap[0] + 1, gap[1] + 1):
            closed[:, j : j + mask.shape[1], i : i + mask.shape[2]] |= mask
        theirs = {
            name: 1e6 * timed(partial(on_each, f), closed)[0] / KERNEL_BATCH
            for name, f in self.others.items()
            if f
        }
        for kind, search in searches.items():
            (ours,) = self.row(
                f"components, {kind}",
                frames,
                lambda m, s=search: components([m], [s]),
                words,
                theirs=theirs,
            )
            self.check_components(
                f"components, {kind}, {frames}", search, jax.tree.map(np.asarray, ours), closed
            )

    def check_components(self, what: str, search: "Search", ours: Any, closed: np.ndarray) -> None:
        """End the run if another program finds other boxes in any of the distinct frames."""
        gap, (max_width, max_height) = search.gap, search.shapes[0].max_size
        distinct = len(recorded(what.split(", ")[-1])["screens"])
        for name, f in self.others.items():
            for b in range(distinct if f else 0):
                found = (
                    [
                        (int(x), int(y), int(w) - gap[0], int(h) - gap[1])
                        for x, y, w, h in f(closed[b])
                    ]
                    if f
                    else []
                )
                want = sorted(r for r in found if r[2] <= max_width and r[3] <= max_height)
                sides = ours.x, ours.y, ours.w, ours.h
                got = sorted(
                    tuple(int(v[k, b]) for v in sides) for k in np.flatnonzero(ours.valid[:, b])
                )
                if got != want:
                    raise SystemExit(
                        f"{what}, frame {b}: the kernel finds {got}, but {name} finds {want}"
                    )

    def tracking(self) -> None:
        """Merging and tracking of objects."""
        import jax.numpy as jnp

        import ocjax

        invaders, data = self.games["SpaceInvaders"], recorded("SpaceInvaders")
        before = jnp.asarray(repeated(data["previous"], KERNEL_BATCH))
        both = [invaders.vem(x) for x in (before, self.frames["SpaceInvaders"])]
        self.row("merge_frames", "SpaceInvaders", ocjax.merge_frames, *both)
        self.row("track", "SpaceInvaders", ocjax.track, *both)


def bitmaps(frames: "jax.Array", *color_sets: tuple[int, ...]) -> "tuple[Bitmap, ...]":
    """Masks of some colours as bitmaps."""
    import jax

    from ocjax.vision import bitmap as bm

    @jax.jit
    def masks(frames: jax.Array) -> tuple[bm.Bitmap, ...]:
        planes = bm.planes(frames)
        return tuple(bm.color_mask(planes, colors) for colors in color_sets)

    return masks(frames)


def kernel_table(title: str) -> Any:
    """Time VEM's kernels."""
    kernels = Kernels(title)
    for measure in (kernels.masks, kernels.rules, kernels.components, kernels.tracking):
        measure()
    return kernels.table


def main() -> None:
    """Print the tables and the geometric means of VEM's ratios."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", help="default: all games")
    parser.add_argument("--ocatari", metavar="PYTHON", help="Python interpreter that has OCAtari")
    parser.add_argument("--core", type=int, default=0, help="core to run on")
    parser.add_argument(
        "--largest", type=int, default=BATCHES[-1], help="skip larger batches of VEM"
    )
    arguments = parser.parse_args()
    on_cpu = backend() == "cpu"
    if on_cpu:
        bind(arguments.core)

    import jax
    from rich.console import Console

    import ocjax

    memory = freed_memory()
    console = Console(width=160)
    where = (
        "one CPU core"
        if on_cpu
        else f"GPU ({jax.devices()[0].device_kind}), other programs on the CPU"
    )
    title = f"microseconds per frame, {where}, jax {jax.__version__}, {memory}"
    vem, means = vem_table(
        title, arguments.games or list(ocjax.games()), arguments.ocatari, arguments.largest
    )
    console.print(vem, *means, kernel_table(title), sep="\n")


if __name__ == "__main__":
    main()
