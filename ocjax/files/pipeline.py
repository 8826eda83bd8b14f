"""Extract objects from an input to a file.

The extraction works block by block, so it can be resumed after an interruption.
"""

import dataclasses
import functools
import importlib.metadata
import itertools
import json
import math
import shutil
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from ocjax._xla.batches import by_chunks
from ocjax.console import palette
from ocjax.console.ram import RAM_SIZE
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files import cluster, jobs, minari, outputs, run_lengths
from ocjax.files import writing as output
from ocjax.files.blocks import Block, compact
from ocjax.files.inputs import MINARI, Input, InputError, open_input
from ocjax.files.jobs import Report, silent
from ocjax.files.run_lengths import RunLengths

BLOCK_ROWS = {"rem": 65_536, "vem": 2_048}  # per file of the work folder
BATCH = {"rem": 4_096, "vem": 256}  # rows per call and device; larger batches take longer per row
PLAN = "plan.json"


@dataclasses.dataclass(frozen=True)
class ExtractionPlan:
    """Identifies an extraction, in its work folder; a resumed extraction must match it."""

    input: str
    array: str | None
    rows: int
    stamp: tuple[int, int]  # size and modification time of the input file; zeros for other inputs
    game: str
    md5: str
    hud: bool
    method: str
    masks: bool  # whether to store the objects' pixels
    block_rows: int
    version: str  # of ocjax

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.rows // self.block_rows)

    def to_json(self) -> str:
        """The plan as JSON."""
        return json.dumps(dataclasses.asdict(self), indent=2) + "\n"


def extract(
    source: str | Path,
    out: str | Path,
    game: str | None = None,
    *,
    array: str | None = None,
    hud: bool = True,
    ray: str | None = None,
    report: Report = silent,
) -> None:
    """Extract the objects of all rows of an input, with REM from RAM or with VEM from frames.

    The work stays in the folder `OUT.parts` until the output is complete. After an interruption, a
    second call resumes the extraction and writes the same output. Rows are extracted in batches on
    all local devices.

    Args:
        source: the input; see `open_input`.
        out: an .npz, .h5, .hdf5 or .parquet file of objects, a .json file in COCO's format, a .txt
            file in MOT's, or a new folder in YOLO's format after "yolo:"; see
            `ocjax.files.outputs`. An existing file is replaced. For a Minari dataset, `out` can
            also be the ID of a new dataset after "minari:", a copy with the fields of `Objects` in
            its infos.
        game: the game's name. Required if the input's metadata and the file's name (`Pong.npy`)
            name no game.
        array: name of the input's array; see `open_input`.
        hud: whether display objects are included.
        ray: the address of a Ray cluster whose machines share the files; see `ocjax.files.cluster`.
        report: called at the beginning and after each block with the numbers of finished and of all
            rows.

    Raises:
        FileNotFoundError: the input does not exist.
        InputError: a ValueError; the input is damaged, its rows have another shape, a frame has
            colours that the console does not have, or the input was made with another ROM.
        UnknownGameError: a ValueError; no game has that name.
        ValueError: the output's format is not supported, the work folder belongs to another
            extraction, or the cluster cannot be reached.
        OSError: the output cannot be written, or would replace the input.

    Warns (UserWarning) if the input has no object of the game.
    """
    target = _target(str(source), str(out))
    with open_input(source, array) as rows:
        _check_apart(target, source, rows.reads)
        spec = game_of(rows, source, game, hud=hud)
        check_indices(rows, spec)
        plan = _plan(rows, source, array, spec, target, hud=hud)
        _prepare(target.folder, plan)
        blocks = (
            _blocks(rows, spec, plan, target.folder)
            if ray is None
            else _blocks_on_cluster(plan, target.folder, ray)
        )
        for done in itertools.chain([0], blocks):
            report(done, rows.rows)
    paths = [_part(target.folder, k) for k in range(plan.blocks)]
    found = outputs.Blocks(
        spec, plan.method, rows.batch, plan.block_rows, paths, rows.stem, rows.episodes, plan.masks
    )
    target.write(found)
    if found.rows and not any(len(block.row) for _, _, block in found):
        warnings.warn(
            f"no object of {spec.name} is in {source}: is it a recording of another game?",
            stacklevel=2,
        )
    shutil.rmtree(target.folder)


class _Found(NamedTuple):
    """The objects of a block, and their pixels if the output contains them."""

    block: Block
    masks: RunLengths | None

    def write(self, path: Path) -> None:
        """Write the files of a block; the second one marks it as complete."""
        if self.masks is not None:
            self.masks.write(outputs.masks_path(path))
        self.block.write(path)


class _Target(NamedTuple):
    path: Path  # file or folder of objects
    folder: Path  # work folder
    write: Callable[[outputs.Blocks], object]
    masks: bool = False  # whether it contains the objects' pixels, if the input shows them


def _target(source: str, out: str) -> _Target:
    """Check the output, and choose how to write it."""
    if out.startswith(MINARI):
        if not source.startswith(MINARI):
            raise ValueError(
                f"only a Minari dataset can be copied to another one with objects, got {source}"
            )
        path = minari.path_of(out)
        return _Target(
            path,
            path.with_name(f".{path.name}.parts"),
            lambda blocks: minari.copy_with_objects(source, out, blocks),
        )
    if out.startswith(outputs.YOLO):
        path = outputs.new_folder(out)
        return _Target(
            path,
            path.with_name(f"{path.name}.parts"),
            lambda blocks: outputs.write_yolo(blocks, path),
        )
    path = Path(out)
    writer = outputs.writer(path)
    output.check(path)
    return _Target(
        path,
        path.with_name(f"{path.name}.parts"),
        lambda blocks: output.write(path, lambda file: writer(blocks, file)),
        writer is outputs.write_coco,
    )


def _check_apart(target: _Target, source: str | Path, reads: Sequence[Path]) -> None:
    """Check that the output and the work folder replace no input."""
    for path in (target.path, target.folder):
        output.check_apart(path, reads)
    if Path(source).exists() and Path(source).resolve().is_relative_to(target.folder.resolve()):
        raise shutil.SameFileError(
            f"the input {source} lies in the work folder {target.folder}: give another output"
        )


def game_of(rows: Input, source: str | Path, name: str | None, *, hud: bool) -> Game:
    """The game of an input, from its metadata, the given name, or the file's name."""
    given = rows.facts.get("game") or name
    try:
        found = registry.load(given or Path(source).stem, hud=hud)
    except registry.UnknownGameError as error:
        if given:
            raise
        raise registry.UnknownGameError(
            f"{rows.name} names no game in its metadata or file name: give the game (--game)"
        ) from error
    if name is not None and registry.load(name, hud=hud) is not found:
        raise InputError(f"{rows.name} is of {found.name}, not of {registry.load(name).name}")
    if rows.facts.get("md5", found.md5) != found.md5:
        raise InputError(
            f"{rows.name} was made with the ROM of md5 {rows.facts['md5']}, but the decoder of "
            f"{found.name} is for {found.md5}"
        )
    return found


def method_of(rows: Input, game: Game) -> str:
    """The method that extracts from an input: "rem" or "vem"."""
    if rows.row_shape == (RAM_SIZE,):
        return "rem"
    if rows.row_shape[:2] != game.screen:
        raise InputError(
            f"{rows.name} has frames of {list(rows.row_shape)}, but {game.name} has "
            f"{list(game.screen)} or {[*game.screen, 3]}"
        )
    return "vem"


def extractor(game: Game, method: str) -> Callable[[np.ndarray], Objects]:
    """A function of any number of rows, with batches that are divided among the devices."""
    devices = jax.local_devices()
    size = BATCH[method] * len(devices)
    sharding = NamedSharding(Mesh(np.array(devices), ("rows",)), PartitionSpec("rows"))
    function = getattr(game, method)

    def call(rows: np.ndarray) -> Objects:
        return by_chunks(lambda chunk: function(jax.device_put(chunk, sharding)), rows, size)

    return call


def check_indices(rows: Input, game: Game) -> None:
    """Check that pictures without colours show palette indices, not shades of grey.

    It reads pictures until one has a number that no grey picture of the game has, mostly the first.
    """
    if not rows.pictures or len(rows.row_shape) != 2:
        return
    shades = game.palette @ [0.299, 0.587, 0.114]
    # programs round differently
    is_shade = np.isin(np.arange(256), [np.round(shades), np.floor(shades)])
    for i in range(rows.rows):
        picture = rows.read(i, i + 1)
        check_colors(picture, game, rows.name, i)
        if not is_shade[picture].all():
            return
    raise InputError(
        f"{rows.name} holds pictures without colours, which may show "
        "palette indices (ale.getScreen()), as VEM needs, "
        "or shades of grey: save the frames in RGB (ale.getScreenRGB())"
    )


def check_colors(frames: np.ndarray, game: Game, name: str, first: int) -> None:
    """Check that frames have only colours of the console. RAM is not checked.

    Args:
        frames: uint8 `[n, H, 160, 3]` of RGB, `[n, H, 160]` of palette indices, or other rows.
    """
    if frames.ndim == 3 and not game.pal:  # on PAL consoles, odd indices are shades of grey
        odd = np.bitwise_or.reduce(frames.reshape(len(frames), -1), axis=1) & 1
        if odd.any():
            i = int(odd.argmax())
            y, x = np.argwhere(frames[i] & 1)[0].tolist()
            raise InputError(
                f"{name}, row {first + i}: the console has no palette index {frames[i, y, x]}, "
                f"which is at column {x}, row {y}: they are "
                "even. VEM needs palette indices (ale.getScreen()) or RGB (ale.getScreenRGB()), "
                "not shades of grey"
            )
    if frames.ndim != 4:
        return
    wrong = np.asarray(_wrong_colors(game)(frames))
    if wrong.any():
        i = int(wrong.argmax())
        y, x = np.argwhere(~palette.is_color(frames[i], game.palette))[0].tolist()
        raise InputError(
            f"{name}, row {first + i}: the console has no colour {frames[i, y, x].tolist()}, "
            f"which is at column {x}, row {y}. VEM needs "
            "frames as the emulator draws them: not resized, not compressed as JPEG, not the "
            "maximum of two"
        )


@functools.cache
def _wrong_colors(game: Game) -> Callable[[np.ndarray], jax.Array]:
    """A compiled function that marks RGB frames with colours outside the palette, bool `[n]`."""
    own = np.asarray(game.palette)
    return jax.jit(lambda frames: ~palette.is_color(frames, own).all(axis=(1, 2)))


def _plan(
    rows: Input, source: str | Path, array: str | None, game: Game, target: _Target, *, hud: bool
) -> ExtractionPlan:
    method = method_of(rows, game)
    path = Path(source)
    stat = path.stat() if path.is_file() else None
    stamp = (stat.st_size, stat.st_mtime_ns) if stat else (0, 0)
    name = str(path.resolve()) if path.exists() else str(source)
    inner = max(1, math.prod(rows.batch[1:]))  # blocks are complete entries of the first dimension
    block_rows = max(1, BLOCK_ROWS[method] // inner) * inner
    return ExtractionPlan(
        name,
        array,
        rows.rows,
        stamp,
        game.name,
        game.md5,
        hud,
        method,
        target.masks and method == "vem",
        block_rows,
        importlib.metadata.version("ocjax"),
    )


def _prepare(folder: Path, plan: ExtractionPlan) -> None:
    """Create the work folder, or check its plan. A folder without results may be reused."""
    jobs.check_contents(folder, "work folder")
    if not any(folder.glob("*.npz")):
        for left in (folder / PLAN, *folder.glob(".*.tmp")):
            left.unlink(missing_ok=True)
    jobs.claim(folder, PLAN, plan.to_json(), "extraction")


def _part(folder: Path, k: int) -> Path:
    return folder / f"{k:06}.npz"


def _blocks(rows: Input, game: Game, plan: ExtractionPlan, folder: Path) -> Iterator[int]:
    """Extract the missing blocks, and yield the number of finished rows after each block."""
    call = extractor(game, plan.method)
    with ThreadPoolExecutor(1) as executor:
        writing: Any = None
        for k in range(plan.blocks):
            if not _part(folder, k).exists():
                found = _extract_block(rows, game, plan, call, k)
                if writing is not None:
                    writing.result()
                writing = executor.submit(found.write, _part(folder, k))
            yield min((k + 1) * plan.block_rows, plan.rows)
        if writing is not None:
            writing.result()


def _extract_block(
    rows: Input, game: Game, plan: ExtractionPlan, call: Callable[[np.ndarray], Objects], k: int
) -> _Found:
    start = k * plan.block_rows
    block = rows.read(start, min(start + plan.block_rows, plan.rows))
    check_colors(block, game, rows.name, start)
    objects = call(block)
    masks = run_lengths.of_objects(objects, block) if plan.masks else None
    return _Found(compact(objects), masks)


def _blocks_on_cluster(plan: ExtractionPlan, folder: Path, address: str) -> Iterator[int]:
    """Like `_blocks`, but on the machines of a Ray cluster."""
    sizes = [min(plan.block_rows, plan.rows - k * plan.block_rows) for k in range(plan.blocks)]
    missing = [k for k in range(plan.blocks) if not _part(folder, k).exists()]
    done = plan.rows - sum(sizes[k] for k in missing)
    yield done
    for k in cluster.completed(
        functools.partial(_write_block, plan, folder.resolve()), missing, address
    ):
        done += sizes[k]
        yield done


def _write_block(plan: ExtractionPlan, folder: Path, k: int) -> None:
    """Extract a block in a process of a cluster, unless another process did."""
    if _part(folder, k).exists():
        return
    game = registry.load(plan.game, hud=plan.hud)
    with open_input(plan.input, plan.array) as rows:
        _extract_block(rows, game, plan, extractor(game, plan.method), k).write(_part(folder, k))
