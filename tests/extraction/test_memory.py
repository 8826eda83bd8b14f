"""Peak memory of VEM: at most four times its input."""

import functools
import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import pytest

import ocjax
from ocjax._xla import batches
from ocjax.extraction import vem
from tests.support.states import DATA

GAMES = ("Pong", "SpaceInvaders")
BATCHES = (2048, 2000)  # a whole number of chunks, and not
STATUS, RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")

# Prints the growth of memory above its use before a call: for a copy as float32 (its output is four
# times its input), and for VEM. It reads the process's own peak, which can be reset; getrusage's
# peak starts at the parent's and includes compilation. Blocks larger than a page come directly from
# the system and return to it, so that a call cannot use memory freed before. The frames' source
# stays referenced, so no part of it is freed between the two readings, even if the device shares
# it.
SCRIPT = """
import ctypes, pathlib, sys, time
import jax, jax.numpy as jnp, numpy as np
import ocjax

def resident(line):
    status = pathlib.Path("/proc/self/status").read_text()
    return 1024 * int(status.split(line + ":")[1].split()[0])

def growth(f, x):
    kept = jax.block_until_ready(f(x))  # dropped, it would be freed some time later
    before = 0
    # Other threads return the memory of the call after it.
    while abs(before - (before := resident("VmRSS"))) > 2**18:
        time.sleep(0.5)
        ctypes.CDLL(None).malloc_trim(0)
    pathlib.Path("/proc/self/clear_refs").write_text("5")
    jax.block_until_ready(f(x))
    return resident("VmHWM") - before

game, batch = ocjax.load(sys.argv[1]), int(sys.argv[2])
with np.load(sys.argv[3]) as file:
    source = np.resize(file["screens"], (batch, *game.screen))
x = jax.block_until_ready(jnp.asarray(source))
print(x.nbytes, growth(jax.jit(lambda x: x.astype(jnp.float32)), x), growth(game.vem, x))
"""


@functools.cache
def compiled(name, batch):
    """Bytes of arguments, results and intermediate values of VEM, compiled for a batch."""
    game = ocjax.load(name)
    frames = jax.ShapeDtypeStruct((batch, *game.screen), jnp.uint8)
    sizes = jax.jit(game.vem).lower(frames).compile().memory_analysis()
    return sizes.argument_size_in_bytes, sizes.output_size_in_bytes, sizes.temp_size_in_bytes


@pytest.mark.slow
@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("name", GAMES)
def test_compiled_program(name, batch):
    given, results, between = compiled(name, batch)
    assert given == batch * 210 * 160
    assert given + results + between <= 4 * given


@pytest.mark.slow
@pytest.mark.skipif(
    not os.access(RESET, os.W_OK) or "VmHWM" not in STATUS.read_text(),
    reason="the system does not report the peak memory of a process",
)
@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("name", GAMES)
def test_process(name, batch):
    data = DATA / f"{name}.npz"
    environment = os.environ | {
        "JAX_PLATFORMS": "cpu",
        "MALLOC_MMAP_THRESHOLD_": "4096",
        "MALLOC_TRIM_THRESHOLD_": "0",
    }
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, name, str(batch), data],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    frames, copied, grown = map(int, run.stdout.split())
    sys.stdout.write(f"{frames=} {copied=} {grown=} compiled={compiled(name, batch)}\n")
    margin = 2**23
    assert abs(copied - 4 * frames) < margin, "the measure itself"
    assert frames + grown <= 4 * frames
    if jax.default_backend() == "cpu":
        size = batches.shared_size(batch, vem.CHUNK)
        filled_up = size * frames // batch if size > batch else 0
        assert abs(grown - filled_up - sum(compiled(name, size)[1:])) < margin, (
            "what the compiler says is what the process takes"
        )
