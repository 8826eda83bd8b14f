"""Page faults and time of REM and VEM with and without `ocjax.retain_freed_memory()`.

    python benchmarks/memory.py [GAME ...] [--calls 20] [--core 0]

Each measurement runs in a fresh process on one core. It repeats a call and drops each result, after
warm-up calls. Page faults are the kernel's count of pages that it maps and clears. Times are
processor times; system time is the part of the kernel, such as for page faults. The last column is
the median time of a call without retained memory divided by that with it.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import time
from typing import NamedTuple

from extraction import SOURCES, bind, recorded, repeated

BATCHES = {"rem": (4096, 16384, 65536, 262144), "vem": (256, 1024, 4096)}
WARM_UP = 5  # calls


class Measured(NamedTuple):
    """The result of a process."""

    retained: bool  # whether freed memory was retained
    megabytes: float  # of the objects
    largest: float  # megabytes of the largest array of the objects
    faults: float  # per call
    system: float  # fraction of the processor time that the kernel takes
    microseconds: float  # processor time per state or frame


def measure(name: str, method: str, batch: int, calls: int) -> Measured:
    """Measure one method in this process."""
    import jax
    import jax.numpy as jnp

    import ocjax

    retained = os.environ.get("OCJAX_RETAIN_MEMORY") == "1" and ocjax.retain_freed_memory()
    extract = getattr(ocjax.load(name), method)
    x = jnp.asarray(repeated(recorded(name)[SOURCES[method]], batch))
    sizes = [leaf.nbytes / 1e6 for leaf in jax.tree.leaves(extract(x))]
    for _ in range(WARM_UP):
        jax.block_until_ready(extract(x))
    before, spent = resource.getrusage(resource.RUSAGE_SELF), []
    for _ in range(calls):
        start = time.process_time()
        jax.block_until_ready(extract(x))
        spent.append(time.process_time() - start)
    after = resource.getrusage(resource.RUSAGE_SELF)
    system, user = after.ru_stime - before.ru_stime, after.ru_utime - before.ru_utime
    return Measured(
        retained,
        sum(sizes),
        max(sizes),
        (after.ru_minflt - before.ru_minflt) / calls,
        system / (system + user),
        1e6 * statistics.median(spent) / batch,
    )


def in_process(retain: bool, *arguments: str | int) -> Measured:
    """Call `measure` in a fresh process, given the core, calls, game, method and batch."""
    run = subprocess.run(
        [sys.executable, __file__, "--worker", json.dumps(arguments)],
        env={**os.environ, "OCJAX_RETAIN_MEMORY": str(int(retain))},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return Measured(*json.loads(run.stdout))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", default=["Pong", "SpaceInvaders", "MsPacman"])
    parser.add_argument("--calls", type=int, default=20, help="of a measurement")
    parser.add_argument("--core", type=int, default=0, help="core to run on")
    parser.add_argument("--worker", type=json.loads, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        core, calls, name, method, batch = arguments.worker
        bind(core)
        print(json.dumps(measure(name, method, batch, calls)))
        return

    from rich.console import Console
    from rich.table import Table

    table = Table(title="Freed memory: returned, and retained", title_justify="left")
    texts = "game", "method"
    for heading in (
        *texts,
        "batch",
        "results MB",
        "largest MB",
        "faults a call",
        "retained",
        "system time",
        "retained",
        "us",
        "retained",
        "ratio",
    ):
        table.add_column(heading, justify="left" if heading in texts else "right", no_wrap=True)
    for game in arguments.games:
        for method, batches in BATCHES.items():
            for batch in batches:
                plain, kept = (
                    in_process(retain, arguments.core, arguments.calls, game, method, batch)
                    for retain in (False, True)
                )
                if not kept.retained:
                    raise SystemExit("freed memory cannot be retained here")
                table.add_row(
                    game,
                    method.upper(),
                    f"{batch:,}",
                    f"{plain.megabytes:.1f}",
                    f"{plain.largest:.1f}",
                    f"{plain.faults:,.0f}",
                    f"{kept.faults:,.0f}",
                    f"{plain.system:.0%}",
                    f"{kept.system:.0%}",
                    f"{plain.microseconds:.3f}",
                    f"{kept.microseconds:.3f}",
                    f"{plain.microseconds / kept.microseconds:.2f}",
                )
                print(f"{game} {method} {batch}: {plain} {kept}", file=sys.stderr)
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
