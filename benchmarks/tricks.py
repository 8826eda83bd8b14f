"""Measure what each compiler trick gains, with it and without it in alternating processes.

    python benchmarks/tricks.py [TRICK ...] [--games GAME ...] [--rounds 5] [--core 0] [--list]

A gain is the time without the trick divided by the time with it: 1.20 means that the trick saves a
sixth of the time. Each pair of measurements runs in two fresh processes, one with the trick and one
without it. The gain is the median over the pairs, with the lowest and the highest. A measurement is
the median of repeated, synchronous calls after the first one, which is timed separately. Times are
processor times of one core, so that other programs disturb them little. The processes do not use
the compilation cache. If the objects differ without a trick, or a process fails, the program prints
the other tricks and exits with 1.

The second table replaces each size of a kernel by another one; a gain above 1 favours the present
size. By default, each trick is measured on games for which it matters.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
import zlib
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from extraction import SOURCES, bind, recorded, repeated

SECONDS = 0.4  # processor time of the calls of a measurement
MIN_CALLS = 5
MIN_GAIN = 1.05  # a trick that gains less in all rows should be removed
LIMITLESS = 2**30
# The modules that take names from others. All are imported before a trick is replaced.
MODULES = "extraction.rem", "extraction.vem", "extraction.registry"

Batches = tuple[int, ...]  # sizes, measured one after the other


class Case(NamedTuple):
    """A measurement of a method."""

    method: str
    batches: Batches
    games: tuple[str, ...]


class Trick(NamedTuple):
    """A trick, and its replacement: a function of the present value of one name in ocjax."""

    name: str
    place: str
    without: Callable[[Any], Any]
    cases: tuple[Case, ...]


class Measured(NamedTuple):
    """The result of one process for one game."""

    run: float  # seconds of all batches
    first_call: float
    checksum: int


def rem(*games: str, batches: Batches = (4096,)) -> Case:
    """A measurement of REM."""
    return Case("rem", batches, games)


def vem(*games: str, batches: Batches = (256,)) -> Case:
    """A measurement of VEM."""
    return Case("vem", batches, games)


def becomes(value: Any) -> Callable[[Any], Any]:
    """A replacement that does not depend on the present value."""
    return lambda _: value


def without_option(name: str) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """A replacement of compiler options that lacks one of them."""
    return lambda options: {key: value for key, value in options.items() if key != name}


def segmentation(*games: str, batches: Batches = (128,)) -> Case:
    """A measurement of `ocjax.segment` on VEM's objects."""
    return Case("segment", batches, games)


# ------------------------------------------------------------------------------------------
# plain operations instead of tricks


def plain_vmap(f: Callable[[Any], Any], _: Any) -> Callable[[Any], Any]:
    """JAX's `vmap`, instead of `batch_last`."""
    import jax

    return jax.vmap(f, in_axes=-1, out_axes=-1)


def mapped(f: Callable[[Any], Any], x: Any, size: int) -> Any:
    """`lax.map`, instead of `in_chunks`; the batch is a multiple of the chunks."""
    import jax

    if len(x) <= size:
        return f(x)
    chunks = jax.lax.map(f, x.reshape(-1, size, *x.shape[1:]))
    return jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:]), chunks)


def inlined(f: Callable[..., Any], *x: Any, small: int | None = None) -> Any:
    """A plain call, instead of `materialize`."""
    return f(*x)


def boxes_by_state(slots: Any, small: int) -> Any:
    """Boxes of all states and slots, instead of one row of them."""
    from ocjax._xla import kernels
    from ocjax.extraction import words

    return kernels.materialize(words.boxes, slots, small=small)


# ------------------------------------------------------------------------------------------
# the tricks

TRICKS = (
    Trick(
        "batch last",
        "_xla.batch_last.batch_last",
        becomes(plain_vmap),
        (rem("Asteroids", "BeamRider", "Pong"),),
    ),
    Trick(
        "look-ups along the batch",
        "_xla.batch_last._is_look_up",
        becomes(lambda *_: False),
        (rem("BeamRider", "MsPacman"),),
    ),
    Trick(
        "stored values",
        "_xla.dataflow.MIN_SAVED_OPERATIONS",
        becomes(LIMITLESS),
        (rem("Amidar", "Riverraid", "Pong"),),
    ),
    Trick(
        "repetitions by broadcasts",
        "_xla.dataflow._repetitions",
        becomes(lambda _: 1),
        (rem("Enduro", "Phoenix", "Riverraid"),),
    ),
    Trick(
        "values instead of their parts",
        "_xla.dataflow._PARTS",
        becomes(frozenset()),
        (rem("Enduro", "Phoenix"),),
    ),
    Trick(
        "stored reductions",
        "_xla.dataflow._REDUCTIONS",
        becomes(frozenset()),
        (rem("Krull", "MsPacman"),),
    ),
    Trick(
        "small results",
        "_xla.batch_last.MIN_STORED_ELEMENTS",
        becomes(0),
        (rem("MsPacman", batches=(1, 8)),),
    ),
    Trick(
        "small batches",
        "extraction.rem.MIN_MATERIALIZED_STATES",
        becomes(0),
        (rem("Pong", "MsPacman", batches=(1, 16)),),
    ),
    Trick(
        "small arrays",
        "_xla.kernels.MIN_MATERIALIZED_ELEMENTS",
        becomes(0),
        (vem("Pong", "SpaceInvaders", batches=(1,)),),
    ),
    Trick(
        "calls that are not inlined",
        "_xla.kernels.set_xla_metadata",
        becomes(lambda value, **_: value),
        (rem("SpaceInvaders"), vem("SpaceInvaders", batches=(32,))),
    ),
    Trick(
        "padded rows",
        "_xla.kernels.ROW_PADDING",
        becomes(0),
        (rem("Pong", "MsPacman"),),
    ),
    Trick(
        "boxes in one row",
        "extraction.rem._boxes",
        becomes(boxes_by_state),
        (rem("Assault", "MsPacman"),),
    ),
    Trick(
        "chunks of states",
        "extraction.rem.CHUNK",
        becomes(LIMITLESS),
        (rem("Pong", "MsPacman", batches=(65536,)),),
    ),
    Trick(
        "chunks of frames",
        "extraction.vem.CHUNK",
        becomes(LIMITLESS),
        (vem("Pong", "SpaceInvaders", batches=(512,)),),
    ),
    Trick(
        "chunks in place",
        "_xla.batches.in_chunks",
        becomes(mapped),
        (rem("MsPacman", batches=(65536,)), vem("Pong")),
    ),
    Trick(
        "compiler options",
        "_xla.batches.compiler_options",
        becomes(lambda: None),
        (rem("BeamRider"), vem("BeamRider")),
    ),
    Trick(
        "older emitters",
        "_xla.batches.COMPILER_OPTIONS",
        without_option("xla_cpu_use_fusion_emitters"),
        (rem("BeamRider"), vem("BeamRider")),
    ),
    Trick(
        "code in one piece",
        "_xla.batches.COMPILER_OPTIONS",
        without_option("xla_cpu_parallel_codegen_split_count"),
        (rem("BeamRider"), vem("BeamRider")),
    ),
    Trick(
        "vectors of 512 bits",
        "_xla.batches.COMPILER_OPTIONS",
        without_option("xla_cpu_prefer_vector_width"),
        (rem("Solaris"), vem("Adventure")),
    ),
    Trick(
        "shared sizes",
        "_xla.batches.shared_size",
        becomes(lambda n, _: n),
        (rem("Seaquest", batches=(600, 700, 800, 900)), vem("Seaquest", batches=(20, 25, 30))),
    ),
    Trick(
        "freed memory",
        "_xla.process.MALLOC",
        becomes({}),
        (rem("Pong", "MsPacman", batches=(65536,)),),
    ),
    Trick(
        "selected bytes",
        "extraction.rem.MAX_SELECTED_BYTES",
        becomes(0),
        (rem("Boxing", "Asterix", "Robotank"),),
    ),
    Trick(
        "transposed RAM",
        "extraction.rem.MAX_SELECTED_BYTES",
        becomes(128),
        (rem("Pacman", "SpaceInvaders", "Surround"),),
    ),
    Trick(
        "joined slices",
        "extraction.rem.MAX_SKIPPED_BYTES",
        becomes(0),
        (rem("PrivateEye", "Seaquest"),),
    ),
    Trick(
        "rows that are read",
        "vision.scene._rows_looked_at",
        becomes(lambda _, height: height),
        (vem("Pong", "SpaceInvaders"),),
    ),
    Trick(
        "unshared masks",
        "vision.scene.MAX_UNSHARED_REGIONS",
        becomes(0),
        (vem("Pong", "Freeway"),),
    ),
    Trick(
        "first mask",
        "vision.scene.MIN_MATERIALIZED_COLORS",
        becomes(LIMITLESS),
        (vem("Freeway"),),
    ),
    Trick(
        "two boards",
        "vision.blobs.MIN_RATIO_OF_ONE_BOARD",
        becomes(LIMITLESS),
        (vem("PrivateEye", "DemonAttack"),),
    ),
    Trick(
        "short reductions",
        "vision.bitmap.MAX_REDUCED_ROWS",
        becomes(LIMITLESS),
        (vem("Gopher", "Pooyan"),),
    ),
    Trick(
        "gathered regions",
        "vision.bounds.MAX_GATHERED_ROWS",
        becomes(0),
        (vem("Gopher", "NameThisGame"),),
    ),
    Trick(
        "large windows",
        "vision.components.layout.MAX_WORDS_OF_FULL_ROUND",
        becomes(LIMITLESS),
        (vem("Pitfall", "Jamesbond"),),
    ),
    Trick(
        "division of floats",
        "vision.components.boxes._quotient",
        becomes(lambda a, b: a // b),
        (vem("Berzerk"),),
    ),
    Trick(
        "stored look-ups",
        "extraction.ownership.materialize",
        becomes(inlined),
        (segmentation("Pong", "SpaceInvaders"),),
    ),
    Trick(
        "unrolled bits",
        "extraction.ownership._UNROLLED",
        becomes(1),
        (segmentation("Pong", "SpaceInvaders"),),
    ),
)
SIZES = (
    Trick(
        "stored values, 20 operations",
        "_xla.dataflow.MIN_SAVED_OPERATIONS",
        becomes(20),
        (rem("Amidar", "Riverraid"),),
    ),
    Trick(
        "chunks of states, 512",
        "extraction.rem.CHUNK",
        becomes(512),
        (rem("Pong", "MsPacman", batches=(65536,)),),
    ),
    Trick(
        "chunks of frames, 16",
        "extraction.vem.CHUNK",
        becomes(16),
        (vem("Pong", "SpaceInvaders"),),
    ),
    Trick(
        "chunks of frames, 64",
        "extraction.vem.CHUNK",
        becomes(64),
        (vem("Pong", "SpaceInvaders"),),
    ),
    Trick(
        "sizes per doubling, 1",
        "_xla.batches.SIZES_PER_DOUBLING",
        becomes(1),
        (vem("Seaquest", batches=(544,)),),
    ),
    Trick(
        "strips, 4 rows",
        "vision.bounds.STRIP_ROWS",
        becomes(4),
        (vem("Boxing", "Breakout"),),
    ),
    Trick(
        "strips, 16 rows",
        "vision.bounds.STRIP_ROWS",
        becomes(16),
        (vem("Boxing", "Breakout"),),
    ),
    Trick(
        "blocks of rows, 16",
        "vision.components.layout.BLOCK_ROWS",
        becomes(16),
        (vem("SpaceInvaders", "Asteroids"),),
    ),
    Trick(
        "candidates, 4",
        "vision.components.layout.CANDIDATES_PER_FRAME",
        becomes(4),
        (vem("SpaceInvaders", "Asteroids"),),
    ),
    Trick(
        "candidates, 16",
        "vision.components.layout.CANDIDATES_PER_FRAME",
        becomes(16),
        (vem("SpaceInvaders", "Asteroids"),),
    ),
    Trick(
        "steps along lines, 4 rows",
        "vision.filters._ROWS_PER_STEP",
        becomes(4),
        (vem("Tennis"),),
    ),
)
BY_NAME = {trick.name: trick for trick in (*TRICKS, *SIZES)}

# ------------------------------------------------------------------------------------------
# one process


def replace(trick: Trick) -> None:
    """Replace a name of ocjax, also in modules that have imported it."""
    module_name, _, name = f"ocjax.{trick.place}".rpartition(".")
    old = getattr(import_module(module_name), name)
    new = trick.without(old)
    for loaded in [m for key, m in sys.modules.items() if key.startswith("ocjax.")]:
        if vars(loaded).get(name) is old:
            setattr(loaded, name, new)


def processor_time(f: Callable[[Any], Any], x: Any) -> float:
    """Seconds of a call: the median of repeated calls."""
    import jax

    spent: list[float] = []
    while len(spent) < MIN_CALLS or sum(spent) < SECONDS:
        start = time.process_time()
        jax.block_until_ready(f(x))
        spent.append(time.process_time() - start)
    return statistics.median(spent)


def function_of(game: str, method: str, x: Any) -> Callable[[Any], Any]:
    """The measured function of RAM states or frames."""
    import jax

    import ocjax

    extractor = ocjax.load(game)
    if method != "segment":
        return getattr(extractor, method)
    objects = jax.block_until_ready(extractor.vem(x))
    return lambda frames: ocjax.segment(objects, frames)


def measure(case: Case, game: str) -> Measured:
    """Measure a method of a game."""
    import jax
    import jax.numpy as jnp

    samples = recorded(game)[SOURCES["rem" if case.method == "rem" else "vem"]]
    run, first_call, checksum = 0.0, 0.0, 0
    for batch in case.batches:
        x = jax.block_until_ready(jnp.asarray(repeated(samples, batch)))
        extract = function_of(game, case.method, x)
        start = time.process_time()
        objects = jax.block_until_ready(extract(x))
        first_call += time.process_time() - start
        run += processor_time(extract, x)
        for leaf in jax.tree.leaves(objects):
            checksum = zlib.crc32(np.asarray(leaf).tobytes(), checksum)
    return Measured(run, first_call, checksum)


def worker(name: str, with_trick: bool, games: Sequence[str], core: int) -> None:
    """Measure all cases of a trick, and print the results as JSON."""
    bind(core)
    for module in MODULES:
        import_module(f"ocjax.{module}")
    if not with_trick:
        replace(BY_NAME[name])

    import ocjax

    ocjax.retain_freed_memory()
    cases = BY_NAME[name].cases
    print(json.dumps([[measure(case, game) for game in games or case.games] for case in cases]))


# ------------------------------------------------------------------------------------------
# pairs of processes


def in_process(*arguments: Any) -> list[list[Measured]]:
    """Call `worker` in a fresh process."""
    run = subprocess.run(
        [sys.executable, __file__, "--worker", json.dumps(arguments)],
        env={**os.environ, "JAX_ENABLE_COMPILATION_CACHE": "false"},
        capture_output=True,
        text=True,
        check=False,
    )
    if run.returncode:
        raise RuntimeError(f"{arguments[0]}, with it: {arguments[1]}\n{run.stderr}")
    return [[Measured(*own) for own in of_case] for of_case in json.loads(run.stdout)]


def gain(pairs: Sequence[tuple[Measured, Measured]], field: str) -> list[float]:
    """Lowest, median and highest ratio of a time without the trick to that with it."""
    ratios = sorted(getattr(plain, field) / getattr(own, field) for own, plain in pairs)
    return [ratios[0], statistics.median(ratios), ratios[-1]]


def pairs_of(
    trick: Trick, games: Sequence[str], rounds: int, core: int
) -> dict[tuple[Case, str], list[tuple[Measured, Measured]]]:
    """Measure a trick in pairs of processes; every second pair begins without it."""
    pairs: dict[tuple[Case, str], list[tuple[Measured, Measured]]] = {}
    for i in range(rounds):
        results = {
            with_trick: in_process(trick.name, with_trick, games, core)
            for with_trick in ((True, False) if i % 2 == 0 else (False, True))
        }
        for case, own, plain in zip(trick.cases, results[True], results[False], strict=True):
            for game, a, b in zip(games or case.games, own, plain, strict=True):
                if a.checksum != b.checksum:
                    raise RuntimeError(f"{trick.name}: {case.method} of {game} has other objects")
                pairs.setdefault((case, game), []).append((a, b))
    return pairs


def rows(trick: Trick, games: Sequence[str], rounds: int, core: int) -> list[list[Any]]:
    """Name, method, game, batches, and the gains of running and of the first call."""
    return [
        [
            trick.name,
            case.method.upper(),
            game,
            ", ".join(f"{batch:,}" for batch in case.batches),
            gain(pairs, "run"),
            gain(pairs, "first_call"),
        ]
        for (case, game), pairs in pairs_of(trick, games, rounds, core).items()
    ]


def print_table(title: str, measured: Sequence[Sequence[Any]]) -> None:
    """Print the gains."""
    from rich.console import Console
    from rich.table import Table

    texts = "trick", "method", "game"
    table = Table(title=title, title_justify="left")
    for heading in (*texts, "batch", "run", "lowest-highest", "first call", "lowest-highest"):
        table.add_column(heading, justify="left" if heading in texts else "right", no_wrap=True)
    for *cells, run, first_call in measured:
        gains = (
            cell
            for low, median, high in (run, first_call)
            for cell in (f"{median:.2f}", f"{low:.2f}-{high:.2f}")
        )
        table.add_row(*cells, *gains)
    Console(width=140).print(table)


def useless(measured: Sequence[Sequence[Any]]) -> list[str]:
    """The tricks that gain less than `MIN_GAIN` in all their rows, for running and compiling."""
    useful = {
        name for name, *_, run, first_call in measured if max(run[1], first_call[1]) >= MIN_GAIN
    }
    return sorted({name for name, *_ in measured} - useful)


def main() -> None:
    """Print the tables, and the tricks that gain little."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tricks", nargs="*", metavar="TRICK", help="names; default: all")
    parser.add_argument("--games", nargs="+", default=[], help="instead of each trick's own games")
    parser.add_argument("--rounds", type=int, default=5, help="pairs of processes")
    parser.add_argument("--core", type=int, default=0, help="core to run on")
    parser.add_argument("--list", action="store_true", help="print the names and end")
    parser.add_argument("--worker", type=json.loads, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        return worker(*arguments.worker)
    if arguments.list:
        return print(*BY_NAME, sep="\n")
    if unknown := set(arguments.tricks) - set(BY_NAME):
        parser.error(f"no such trick: {', '.join(sorted(unknown))}; --list prints the names")

    from importlib.metadata import version

    where = f"processor time on one core, jax {version('jax')}, {arguments.rounds} pairs"
    failures: list[str] = []
    for title, group in (("Gain of tricks", TRICKS), ("Gain of sizes over others", SIZES)):
        measured: list[list[Any]] = []
        for trick in group:
            if arguments.tricks and trick.name not in arguments.tricks:
                continue
            try:
                measured += rows(trick, arguments.games, arguments.rounds, arguments.core)
                print(f"{trick.name}: {measured[-1][4][1]:.2f}", file=sys.stderr)
            except RuntimeError as error:
                failures.append(str(error))
        if measured:
            print_table(f"{title}: {where}", measured)
        if group is TRICKS and (names := useless(measured)):
            print(f"Less than {MIN_GAIN - 1:.0%} in all rows: {', '.join(names)}")
    return sys.exit("\n".join(failures) if failures else 0)


if __name__ == "__main__":
    main()
