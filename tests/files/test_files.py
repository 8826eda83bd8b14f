"""Objects of files: every format of input and output, damaged inputs, and interruptions."""

import gc
import io
import json
import os
import shutil
import signal
import subprocess
import sys

import jax
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import ocjax
from ocjax import files
from ocjax.cli.app import app
from ocjax.console import palette
from ocjax.files import InputError, open_input, pipeline, run_lengths
from ocjax.files.run_lengths import RunLengths
from ocjax.transforms.segmentation import masks
from tests.support.marks import slow_but
from tests.support.states import excerpt

FIELDS = ("xywh", "valid", "orientation", "value", "rgb")


@pytest.fixture(scope="module")
def pong():
    return ocjax.load("Pong")


@pytest.fixture(scope="module")
def rams():
    return excerpt("Pong")["rams"]


@pytest.fixture(scope="module")
def frames(pong):
    """RGB frames."""
    return pong.palette[excerpt("Pong")["screens"][:10]]


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(pipeline, "BLOCK_ROWS", {"rem": 16, "vem": 4})


def write_hdf5(path, data):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["a/observations"], file.attrs["game"] = data, "Pong"


def write_zarr(path, data):
    zarr = pytest.importorskip("zarr")
    zarr.create_group(path, attributes={"game": "Pong"}).create_array(
        "frames", shape=data.shape, dtype=data.dtype
    )[:] = data


def columns(data):
    """The rows as Arrow arrays of each type that holds bytes."""
    pa = pytest.importorskip("pyarrow")
    flat = pa.array(data.reshape(-1))
    rows = [row.tobytes() for row in data]
    return {
        "fixed_size_list": pa.FixedSizeListArray.from_arrays(flat, data.shape[1]),
        "list": pa.array(data.tolist(), pa.list_(pa.uint8())),
        "list_of_int64": pa.array(data.tolist()),
        "binary": pa.array(rows),
        "fixed_size_binary": pa.array(rows, pa.binary(data.shape[1])),
    }


def png(frame):
    buffer = io.BytesIO()
    Image.fromarray(frame).save(buffer, "PNG")
    return buffer.getvalue()


def expect(path, game, source):
    """The file has the game's objects for the RAM or the frames."""
    objects = (game.rem if source.shape[1:] == (128,) else game.vem)(source)
    with np.load(path) as found:
        for name in FIELDS:
            assert np.array_equal(found[name], getattr(objects, name)), name
        assert found["categories"].tolist() == [
            c.name for c in game.categories for _ in range(c.count)
        ]
        assert (found["game"], found["md5"], found["ocjax"]) == (
            game.name,
            game.md5,
            ocjax.__version__,
        )


@pytest.mark.parametrize("suffix", ["npy", "npz", "hdf5", "zarr"])
def test_arrays(tmp_path, pong, rams, frames, suffix):
    screens = excerpt("Pong")["screens"][:10]
    for name, data in (("rams", rams), ("screens", frames), ("screens", screens)):
        path = tmp_path / f"Pong{data.ndim}.{suffix}"
        if suffix == "npy":
            np.save(path, data)
        elif suffix == "npz":
            np.savez_compressed(path, other=np.zeros(3), **{name: data})
        else:
            (write_hdf5 if suffix == "hdf5" else write_zarr)(path, data)
        files.extract(path, tmp_path / "out.npz", "Pong")
        expect(tmp_path / "out.npz", pong, data)
        assert not (tmp_path / "out.npz.parts").exists()


@pytest.mark.parametrize(
    "kind", ["fixed_size_list", "list", "list_of_int64", "binary", "fixed_size_binary"]
)
def test_tables(tmp_path, pong, rams, kind):
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = pa.table(
        {"n": np.arange(len(rams)), "ram": columns(rams)[kind]}
    ).replace_schema_metadata({"game": "Pong"})
    parquet.write_table(table, tmp_path / "x.parquet", row_group_size=7)
    with (
        pa.OSFile(str(tmp_path / "file.arrow"), "wb") as sink,
        pa.ipc.new_file(sink, table.schema) as writer,
    ):
        writer.write_table(table, max_chunksize=9)
    with (
        pa.OSFile(str(tmp_path / "stream.arrow"), "wb") as sink,
        pa.ipc.new_stream(sink, table.schema) as writer,
    ):
        writer.write_table(table, max_chunksize=9)
    for name in ("x.parquet", "file.arrow", "stream.arrow"):
        files.extract(tmp_path / name, tmp_path / "out.npz")
        expect(tmp_path / "out.npz", pong, rams)


def test_pictures(tmp_path, pong, frames):
    """A folder of pictures, and pictures in a table, with or without a path beside them."""
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    folder = tmp_path / "pong"
    folder.mkdir()
    for i, frame in enumerate(frames):
        (folder / f"{i}.png").write_bytes(png(frame))  # "10.png" comes last
    single = [png(frame) for frame in frames]
    parquet.write_table(pa.table({"image": single}), tmp_path / "a.parquet")
    parquet.write_table(
        pa.table({"image": [{"bytes": one, "path": ""} for one in single]}), tmp_path / "b.parquet"
    )
    for source in (folder, tmp_path / "a.parquet", tmp_path / "b.parquet"):
        files.extract(source, tmp_path / "out.npz", "Pong")
        expect(tmp_path / "out.npz", pong, frames)


def write_pictures(folder, pictures, suffix="png"):
    folder.mkdir()
    for i, picture in enumerate(pictures):
        (folder / f"frame_{i}.{suffix}").write_bytes(png(picture))
    return folder


def test_suffixes_may_be_in_upper_case(tmp_path, pong, rams, frames):
    files.extract(write_pictures(tmp_path / "pong", frames, "PNG"), tmp_path / "out.NPZ")
    expect(tmp_path / "out.NPZ", pong, frames)
    np.save(tmp_path / "Pong.npy", rams)
    (tmp_path / "Pong.npy").rename(tmp_path / "Pong.NPY")
    files.extract(tmp_path / "Pong.NPY", tmp_path / "out.npz")
    expect(tmp_path / "out.npz", pong, rams)


@pytest.mark.parametrize(
    "name",
    [
        "Pong",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("Asteroids", "Freeway", "PacMan")
        ),
    ],
)
def test_pictures_of_palette_indices(tmp_path, name):
    """Pictures without colours show `ale.getScreen()`; shades of grey, as of
    `ale.getScreenGrayscale()`, raise an error."""
    game = ocjax.load(name)
    screens = excerpt(game.name)["screens"][:12]
    files.extract(write_pictures(tmp_path / game.name, screens), tmp_path / "out.npz")
    expect(tmp_path / "out.npz", game, screens)
    for program, weights in (("ale", [0.2989, 0.587, 0.114]), ("pillow", [0.299, 0.587, 0.114])):
        gray = np.round(game.palette @ weights).astype(np.uint8)[screens]
        folder = write_pictures(tmp_path / program, gray)
        refused(
            InputError,
            r"row \d+: the console has no palette index|shades of grey: save the frames in RGB",
            folder,
            tmp_path / "a.npz",
            game.name,
        )


@pytest.mark.slow
def test_pictures_that_may_be_grey_are_refused(tmp_path):
    """Black and 170 are a palette index and a shade of grey."""
    picture = np.zeros((210, 160), np.uint8)
    picture[100:110, 50:60] = 170
    assert 170 in np.round(palette.NTSC @ [0.299, 0.587, 0.114])
    message = "which may show palette indices"
    refused(
        InputError, message, write_pictures(tmp_path / "Asteroids", [picture]), tmp_path / "out.npz"
    )
    picture[0, 0] = 2  # no shade of grey
    with pytest.warns(UserWarning, match="no object of Asteroids"):
        files.extract(write_pictures(tmp_path / "asteroids", [picture]), tmp_path / "out.npz")


def test_arrays_of_grey_frames_are_refused(tmp_path, pong):
    """A grey frame is not a frame of palette indices: some shades are odd, and all indices are
    even."""
    gray = np.round(pong.palette @ [0.2989, 0.587, 0.114]).astype(np.uint8)[
        excerpt("Pong")["screens"]
    ]
    np.save(tmp_path / "Pong.npy", gray)
    refused(
        InputError,
        r"Pong\.npy, row 0: the console has no palette index \d+",
        tmp_path / "Pong.npy",
        tmp_path / "out.npz",
    )


def test_rows_of_several_dimensions(tmp_path, rams, frames):
    """The rows are steps and environments; blocks of 16 rows do not divide into 9 environments."""
    h5py, parquet = pytest.importorskip("h5py"), pytest.importorskip("pyarrow.parquet")
    pytest.importorskip("zarr")
    ram = np.concatenate([rams, rams])[:63].reshape(7, 9, 128)
    for name, data in (
        ("ram", ram),
        ("screens", frames.reshape(2, 5, 210, 160, 3)),
        ("deep", ram.reshape(7, 3, 3, 128)),
    ):
        np.save(tmp_path / f"{name}.npy", data)
        np.savez(tmp_path / f"{name}.npz", obs=data)
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            file["obs"] = data
        write_zarr(tmp_path / f"{name}.zarr", data)
        game = ocjax.load("Pong")
        for suffix in ("npy", "npz", "h5", "zarr"):
            files.extract(tmp_path / f"{name}.{suffix}", tmp_path / "out.npz", "Pong")
            expect_fields(tmp_path / "out.npz", (game.vem if name == "screens" else game.rem)(data))
        files.extract(tmp_path / f"{name}.h5", tmp_path / "out.hdf5", "Pong")
        with h5py.File(tmp_path / "out.hdf5") as file:
            assert np.array_equal(file["xywh"], np.load(tmp_path / "out.npz")["xywh"])
    files.extract(tmp_path / "ram.npy", tmp_path / "out.parquet", "Pong")
    table = parquet.read_table(tmp_path / "out.parquet").to_pandas()
    step, env, _ = np.nonzero(game.rem(ram).valid)
    assert (table.row_0.tolist(), table.row_1.tolist()) == (step.tolist(), env.tolist())
    for none in (ram[:0], ram[:, :0]):
        np.save(tmp_path / "none.npy", none)
        files.extract(tmp_path / "none.npy", tmp_path / "out.h5", "Pong")
        with h5py.File(tmp_path / "out.h5") as file:
            assert file["xywh"].shape == (*none.shape[:2], game.num_slots, 4)


def expect_fields(path, objects):
    with np.load(path) as found:
        for name in FIELDS:
            assert np.array_equal(found[name], getattr(objects, name)), name


@pytest.mark.parametrize(
    "dtype",
    slow_but(["int64", ">i4"], ["int16", "int32", "int64", "uint16", "uint32", "uint64", ">i4"]),
)
def test_integers_of_other_widths(tmp_path, pong, rams, dtype):
    out = tmp_path / "out.npz"
    np.save(tmp_path / "Pong.npy", rams.astype(dtype))
    np.savez_compressed(tmp_path / "Pong.npz", rams=rams.astype(dtype))
    write_hdf5(tmp_path / "Pong.h5", rams.astype(dtype))
    for suffix in ("npy", "npz", "h5"):
        files.extract(tmp_path / f"Pong.{suffix}", out)
        expect(out, pong, rams)
    for value in (256, -1)[: 1 if np.dtype(dtype).kind == "u" else 2]:
        wrong = rams.astype(dtype)
        wrong[21, 5] = value
        np.save(tmp_path / "Pong.npy", wrong)
        refused(
            InputError,
            rf"Pong\.npy, row 21, holds {value}: bytes of RAM",
            tmp_path / "Pong.npy",
            out,
        )
        shutil.rmtree(tmp_path / "out.npz.parts")


def test_folders_of_the_library_datasets(tmp_path, pong, rams, frames):
    """`save_to_disk` writes Arrow files in the order of a list, and a folder for each split."""
    pa = pytest.importorskip("pyarrow")

    def save(folder, name, parts):
        folder.mkdir(parents=True)
        names = [f"data-{k}.arrow" for k in (2, 0, 1)]
        for file, part in zip(names, parts, strict=False):
            table = pa.table({"n": list(range(len(part))), name: part})
            with (
                pa.OSFile(str(folder / file), "wb") as sink,
                pa.ipc.new_stream(sink, table.schema) as writer,
            ):
                writer.write_table(table, max_chunksize=5)
        (folder / "state.json").write_text(
            json.dumps({"_data_files": [{"filename": n} for n in names[: len(parts)]]})
        )

    save(tmp_path / "one" / "pong", "observations", [rams[:9].tolist(), rams[9:].tolist()])
    files.extract(tmp_path / "one" / "pong", tmp_path / "out.npz")
    expect(tmp_path / "out.npz", pong, rams)
    pictures = [{"bytes": png(frame), "path": None} for frame in frames]
    save(tmp_path / "two" / "train", "image", [pictures[:3], pictures[3:7], pictures[7:]])
    (tmp_path / "two" / "dataset_dict.json").write_text('{"splits": ["train"]}')
    files.extract(tmp_path / "two", tmp_path / "out.npz", "Pong")
    expect(tmp_path / "out.npz", pong, frames)
    (tmp_path / "two" / "dataset_dict.json").write_text('{"splits": ["train", "test"]}')
    refused(
        InputError,
        "has the splits train, test: give the folder of one",
        tmp_path / "two",
        tmp_path / "out.npz",
        "Pong",
    )


@pytest.mark.filterwarnings(
    "ignore:`:UserWarning", "ignore:Implicitly cleaning up:ResourceWarning"
)  # in minari
def test_minari(tmp_path, pong, monkeypatch):
    minari = pytest.importorskip("minari")
    import gymnasium

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    collector = minari.DataCollector(
        gymnasium.make("ALE/Pong-v5", obs_type="ram", max_num_frames_per_episode=100)
    )
    rows = []
    for seed in range(2):
        obs, over = collector.reset(seed=seed)[0], False
        rows.append(obs)
        while not over:
            obs, _, terminated, truncated, _ = collector.step(2)
            over = terminated or truncated
            rows.append(obs)
    collector.create_dataset(
        dataset_id="pong/test-v0",
        author="x",
        author_email="x@y.zz",
        code_permalink="x",
        algorithm_name="x",
        description="x",
    )
    collector.close()
    del collector
    gc.collect()  # otherwise another test notices its folder
    files.extract("minari:pong/test-v0", tmp_path / "out.npz")
    expect(tmp_path / "out.npz", pong, np.stack(rows))


@pytest.mark.parametrize("hud", [True, False])
def test_outputs_hold_the_same_objects(tmp_path, rams, hud):
    np.save(tmp_path / "Pong.npy", rams)
    game, suffixes = ocjax.load("Pong", hud=hud), ("npz", "h5", "parquet", "json", "txt")
    h5py, parquet = pytest.importorskip("h5py"), pytest.importorskip("pyarrow.parquet")
    for suffix in suffixes:
        files.extract(tmp_path / "Pong.npy", tmp_path / f"out.{suffix}", hud=hud)
    expect(tmp_path / "out.npz", game, rams)
    objects = jax.tree.map(np.asarray, game.rem(rams))
    with h5py.File(tmp_path / "out.h5") as file:
        for name in FIELDS:
            assert np.array_equal(file[name], getattr(objects, name))
        assert file.attrs["md5"] == game.md5
        assert [c.decode() for c in file["categories"]] == [
            c.name for c in game.categories for _ in range(c.count)
        ]
    table = parquet.read_table(tmp_path / "out.parquet")
    assert table.schema.metadata[b"method"] == b"rem"
    lines = table.to_pylist()
    records = [(i, r) for i in range(len(rams)) for r in objects[i].to_list()]
    assert len(lines) == len(records)
    for line, (i, record) in zip(lines, records, strict=True):
        assert (line["row"], line["category"], line["index"]) == (
            i,
            record["category"],
            record["slot"],
        )
        assert [line[k] for k in "xywh"] == [record[k] for k in "xywh"]
        assert line["value"] == record.get("value", 0)
        assert line["orientation"] == record.get("orientation", 0)
        assert [line[k] for k in "rgb"] == list(record["rgb"])
        assert line["hud"] == record["hud"]


@pytest.mark.filterwarnings("ignore:Operation with tuple")  # in motmetrics
def test_coco_and_mot_are_read_by_their_libraries(tmp_path, rams, pong):
    coco_module = pytest.importorskip("pycocotools.coco")
    motmetrics = pytest.importorskip("motmetrics")
    np.save(tmp_path / "Pong.npy", rams)
    for suffix in ("json", "txt"):
        files.extract(tmp_path / "Pong.npy", tmp_path / f"out.{suffix}")
    objects = jax.tree.map(np.asarray, pong.rem(rams))
    rows, slots = np.nonzero(objects.valid)
    coco = coco_module.COCO(str(tmp_path / "out.json"))
    assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == [c.name for c in pong.categories]
    assert coco.getImgIds() == list(range(len(rams)))
    annotations = coco.loadAnns(coco.getAnnIds())
    assert [a["bbox"] for a in annotations] == objects.xywh[rows, slots].tolist()
    assert [a["image_id"] for a in annotations] == rows.tolist()
    names = [c.name for c in pong.categories for _ in range(c.count)]
    assert [coco.cats[a["category_id"]]["name"] for a in annotations] == [names[s] for s in slots]
    found = motmetrics.io.loadtxt(str(tmp_path / "out.txt"), fmt=motmetrics.io.Format.MOT15_2D)
    assert found.index.tolist() == [
        (r + 1, s + 1) for r, s in zip(rows.tolist(), slots.tolist(), strict=True)
    ]
    assert found[["Width", "Height"]].to_numpy().tolist() == objects.xywh[rows, slots, 2:].tolist()


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools
@pytest.mark.parametrize("hud", [True, False])
def test_pixels_in_coco(tmp_path, frames, hud, monkeypatch):
    """Annotations of frames have masks; the last block and the last chunk are shorter."""
    coco_module = pytest.importorskip("pycocotools.coco")
    monkeypatch.setattr(run_lengths, "CHUNK", 3)
    game = ocjax.load("Pong", hud=hud)
    np.save(tmp_path / "Pong.npy", frames)
    files.extract(tmp_path / "Pong.npy", tmp_path / "out.json", hud=hud)
    objects = game.vem(frames)
    wanted = np.asarray(masks(objects, frames))[np.asarray(objects.valid)]
    coco = coco_module.COCO(str(tmp_path / "out.json"))
    annotations = coco.loadAnns(coco.getAnnIds())
    assert len(annotations) > 10
    np.testing.assert_array_equal([coco.annToMask(a) for a in annotations], wanted)
    assert [a["area"] for a in annotations] == wanted.sum(axis=(1, 2)).tolist()


def test_damaged_run_lengths(tmp_path):
    """Two masks of 12 pixels."""
    path = tmp_path / "masks.npz"
    whole = {"counts": np.int32([0, 5, 7, 12]), "ends": np.int64([3, 4])}
    RunLengths(**whole).write(path)
    assert list(RunLengths.read(path, 2, 12)) == [[0, 5, 7], [12]]
    for change, message in (
        ({"ends": np.int64([4])}, "does not have 2 masks"),
        ({"ends": np.int64([3, 3])}, "are not those of masks"),
        ({"ends": np.int64([3, 9])}, "are not those of masks"),
        ({"ends": np.int64([2, 4])}, "does not have 12 pixels"),
        ({"counts": np.int32([0, 5, 7, 13])}, "does not have 12 pixels"),
        ({"counts": np.int32([5, -5, 12, 12])}, "are not those of masks"),
        ({"counts": np.int64([0, 5, 7, 12])}, "expected the arrays counts, ends"),
        ({"counts": np.zeros(27, np.int32)}, "does not have 2 masks"),
    ):
        np.savez(path, **{**whole, **change})
        with pytest.raises(ValueError, match=rf"masks\.npz is damaged: .*{message}"):
            RunLengths.read(path, 2, 12)


def test_yolo(tmp_path, pong, rams, frames):
    np.save(tmp_path / "Pong.npy", rams)
    files.extract(tmp_path / "Pong.npy", f"yolo:{tmp_path / 'labels'}")
    objects = jax.tree.map(np.asarray, pong.rem(rams))
    found = sorted((tmp_path / "labels" / "labels").iterdir())
    assert [p.name for p in found] == [f"{i:06}.txt" for i in range(len(rams))]
    for i, path in enumerate(found):
        lines = [line.split() for line in path.read_text().splitlines()]
        valid = objects.valid[i]
        assert [int(line[0]) for line in lines] == pong.slot_category[valid].tolist()
        cx, cy, w, h = np.array([line[1:] for line in lines], float).reshape(-1, 4).T * [
            [160],
            [210],
            [160],
            [210],
        ]
        np.testing.assert_allclose(
            np.stack([cx - w / 2, cy - h / 2, w, h], axis=-1), objects.xywh[i][valid], atol=1e-3
        )
    text = (tmp_path / "labels" / "data.yaml").read_text().splitlines()
    assert text[0].startswith(f"# game Pong, md5 {pong.md5}, method rem")
    assert text[1:] == [
        "train: images",
        "val: images",
        "names:",
        *(f'  {i}: "{c.name}"' for i, c in enumerate(pong.categories)),
    ]
    files.extract(write_pictures(tmp_path / "pong", frames), f"yolo:{tmp_path / 'b'}", hud=False)
    assert {p.stem for p in (tmp_path / "b" / "labels").iterdir()} == {
        f"frame_{i}" for i in range(len(frames))
    }
    assert not any(p.name.endswith((".parts", ".tmp")) for p in tmp_path.iterdir())
    refused(FileExistsError, "exists already", tmp_path / "Pong.npy", f"yolo:{tmp_path / 'b'}")
    refused(
        NotADirectoryError, "no folder", tmp_path / "Pong.npy", f"yolo:{tmp_path / 'none' / 'b'}"
    )


def test_no_rows(tmp_path):
    pytest.importorskip("h5py")
    pytest.importorskip("pyarrow")
    np.save(tmp_path / "Pong.npy", np.zeros((0, 128), np.uint8))
    for suffix in ("npz", "h5", "parquet", "json", "txt"):
        files.extract(tmp_path / "Pong.npy", tmp_path / f"out.{suffix}")
    assert np.load(tmp_path / "out.npz")["xywh"].shape == (0, ocjax.load("Pong").num_slots, 4)


INTERRUPTED = """
import os, signal, sys
from ocjax import files
from ocjax.files import pipeline
pipeline.BLOCK_ROWS = {"rem": 16, "vem": 4}
def report(done, total):
    if done >= 64:
        os.kill(os.getpid(), signal.SIGKILL)
files.extract(sys.argv[1], sys.argv[2], report=report)
"""


@pytest.mark.parametrize(
    "suffix", slow_but(["npz", "txt"], ["npz", "h5", "parquet", "json", "txt"])
)
def test_killed_and_resumed_equals_uninterrupted(tmp_path, rams, suffix):
    if suffix in ("h5", "parquet"):
        pytest.importorskip({"h5": "h5py", "parquet": "pyarrow"}[suffix])
    np.save(tmp_path / "Pong.npy", np.tile(rams, (5, 1)))
    whole, parts = tmp_path / f"whole.{suffix}", tmp_path / f"resumed.{suffix}"
    files.extract(tmp_path / "Pong.npy", whole)
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, tmp_path / "Pong.npy", parts])
    assert done.returncode == -signal.SIGKILL
    assert not parts.exists()
    times = {p.name: p.stat().st_mtime_ns for p in tmp_path.glob("*.parts/0*.npz")}
    assert len(times) >= 3
    kept = []

    def report(done, total):
        kept.append({p.name: p.stat().st_mtime_ns for p in tmp_path.glob("*.parts/0*.npz")})

    files.extract(tmp_path / "Pong.npy", parts, report=report)
    assert times.items() <= kept[-1].items(), "finished blocks are not extracted again"
    assert parts.read_bytes() == whole.read_bytes()


def test_work_of_another_extraction_is_refused(tmp_path, rams):
    np.save(tmp_path / "Pong.npy", rams)

    def stop(done, total):
        if done:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        files.extract(tmp_path / "Pong.npy", tmp_path / "out.npz", report=stop)
    with pytest.raises(ValueError, match=r"out\.npz\.parts holds another extraction"):
        files.extract(tmp_path / "Pong.npy", tmp_path / "out.npz", hud=False)
    os.utime(tmp_path / "Pong.npy", ns=(1, 1))
    with pytest.raises(ValueError, match="differs in stamp"):
        files.extract(tmp_path / "Pong.npy", tmp_path / "out.npz")


def rewritten(**changes):
    """A change of the arrays of a block."""
    return lambda path: np.savez(path, **{**np.load(path), **changes})


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda path: path.write_bytes(path.read_bytes()[:500]), "BadZipFile"),
        (lambda path: path.write_bytes(b""), "BadZipFile"),
        (lambda path: np.savez(path, row=np.zeros(3, np.int64)), "expected the arrays row, slot"),
        (rewritten(row=np.array([0, 10**9])), "must be int32"),
        (rewritten(row=np.zeros(10**6, np.int64)), "it has 1,000,000 objects"),
        (rewritten(slot=np.array([{}], object)), "object"),
        (lambda path: rewritten(row=np.load(path)["row"] - 1)(path), "a row is not in 0 to"),
        (lambda path: rewritten(slot=np.load(path)["slot"] + 1)(path), "a slot is not in 0 to"),
    ],
)
def test_damaged_work_is_refused(tmp_path, rams, damage, reason):
    np.save(tmp_path / "Pong.npy", rams)

    def stop(done, total):
        if done:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        files.extract(tmp_path / "Pong.npy", tmp_path / "out.npz", report=stop)
    block = tmp_path / "out.npz.parts" / "000000.npz"
    damage(block)
    with pytest.raises(
        ValueError, match=rf"{block.name} is damaged: .*{reason}.* Delete the folder"
    ):
        files.extract(tmp_path / "Pong.npy", tmp_path / "out.npz")
    assert not (tmp_path / "out.npz").exists()


def refused(error, match, *args, **options):
    with pytest.raises(error, match=match):
        files.extract(*args, **options)


def test_wrong_inputs_are_refused(tmp_path, rams, frames):
    out = tmp_path / "out.npz"
    refused(FileNotFoundError, "no input", tmp_path / "Pong.npy", out)
    (tmp_path / "Pong.csv").write_text("1")
    refused(InputError, "has no known format", tmp_path / "Pong.csv", out)
    (tmp_path / "empty").mkdir()
    refused(InputError, "holds no pictures", tmp_path / "empty", out, "Pong")
    np.save(tmp_path / "Pong.npy", rams)
    refused(
        ValueError,
        r"must end in \.npz, .*or be yolo:FOLDER, or minari:ID",
        tmp_path / "Pong.npy",
        tmp_path / "out.csv",
    )
    refused(NotADirectoryError, "no folder", tmp_path / "Pong.npy", tmp_path / "none" / "out.npz")
    refused(ocjax.errors.UnknownGameError, "no game 'Chess'", tmp_path / "Pong.npy", out, "Chess")
    np.savez(tmp_path / "a.npz", rams=rams, game="Pong", md5="0" * 32)
    refused(InputError, "made with the ROM of md5 0000", tmp_path / "a.npz", out)
    refused(InputError, "is of Pong, not of Boxing", tmp_path / "a.npz", out, "Boxing")
    refused(InputError, "has no array 'x': it has rams", tmp_path / "a.npz", out, array="x")
    np.save(tmp_path / "train-0.npy", rams)
    refused(
        ocjax.errors.UnknownGameError,
        r"train-0\.npy names no game.*--game",
        tmp_path / "train-0.npy",
        out,
    )
    np.savez(tmp_path / "b.npz", x=rams)
    refused(InputError, "has no RAM or frames named rams", tmp_path / "b.npz", out, "Pong")
    for wrong in (rams.astype(np.float32), rams > 9, rams[:, :127], rams[0], frames[:, :, :80]):
        np.save(tmp_path / "wrong.npy", wrong)
        refused(InputError, r"wrong\.npy must be uint8", tmp_path / "wrong.npy", out, "Pong")
    np.save(tmp_path / "high.npy", np.zeros((2, 250, 160), np.uint8))
    refused(
        InputError,
        r"has frames of \[250, 160\], but Pong has \[210, 160\]",
        tmp_path / "high.npy",
        out,
        "Pong",
    )
    assert not out.exists()
    assert not (tmp_path / "out.npz.parts").exists()


def test_damaged_inputs_are_refused_with_the_row(tmp_path, rams, frames):
    out = tmp_path / "out.npz"
    np.save(tmp_path / "Pong.npy", rams)
    content = (tmp_path / "Pong.npy").read_bytes()
    (tmp_path / "Pong.npy").write_bytes(content[: 128 + 20 * 128])
    refused(InputError, rf"Pong\.npy ends in row 20 of {len(rams)}", tmp_path / "Pong.npy", out)
    (tmp_path / "Pong.npy").write_bytes(content[:100])
    refused(InputError, r"Pong\.npy cannot be read", tmp_path / "Pong.npy", out)
    np.savez(tmp_path / "Pong.npz", rams=np.tile(rams, (200, 1)))
    content = (tmp_path / "Pong.npz").read_bytes()
    (tmp_path / "Pong.npz").write_bytes(content[: len(content) // 2])
    refused(InputError, r"Pong\.npz cannot be read", tmp_path / "Pong.npz", out)
    flipped = bytearray(content)
    flipped[len(content) // 2] ^= 1
    (tmp_path / "Pong.npz").write_bytes(flipped)
    refused(
        InputError,
        r"rows \d+ to \d+, cannot be read: BadZipFile",
        tmp_path / "Pong.npz",
        tmp_path / "c.npz",
    )
    folder = tmp_path / "pong"
    folder.mkdir()
    for i, frame in enumerate(frames):
        (folder / f"{i}.png").write_bytes(png(frame))
    (folder / "6.png").write_bytes(png(frames[0])[:200])
    refused(InputError, r"row 6, .*6\.png, is not a readable picture", folder, tmp_path / "a.npz")
    (folder / "6.png").write_bytes(png(frames[0][:100]))
    refused(InputError, r"row 6, has the shape \[100, 160, 3\]", folder, tmp_path / "b.npz")


def test_frames_with_other_colours_are_refused(tmp_path, frames):
    jpeg = io.BytesIO()
    Image.fromarray(frames[5]).save(jpeg, "JPEG")
    lossy, pooled = frames.copy(), frames.copy()
    lossy[5] = np.asarray(Image.open(jpeg))
    pooled[7, 100, 80] = (1, 2, 3)
    for wrong, row in ((lossy, 5), (pooled, 7)):
        np.save(tmp_path / "Pong.npy", wrong)
        refused(
            InputError,
            f"row {row}: the console has no colour",
            tmp_path / "Pong.npy",
            tmp_path / f"{row}.npz",
        )


def test_blocks_are_read_in_any_order(tmp_path, rams):
    np.savez_compressed(tmp_path / "x.npz", rams=rams, game="Pong")
    with open_input(tmp_path / "x.npz") as rows:
        assert rows.facts == {"game": "Pong"}
        for start, stop in ((10, 20), (0, 5), (5, 30)):
            assert np.array_equal(rows.read(start, stop), rams[start:stop])


def test_command(tmp_path, rams, pong):
    np.save(tmp_path / "Pong.npy", rams)
    done = CliRunner().invoke(
        app, ["extract", str(tmp_path / "Pong.npy"), "--out", str(tmp_path / "out.npz")]
    )
    assert done.exit_code == 0, done.output
    assert "Written" in done.output
    expect(tmp_path / "out.npz", pong, rams)
    wrong = CliRunner().invoke(
        app, ["extract", str(tmp_path / "Pong.npy"), "--out", str(tmp_path / "out.csv")]
    )
    assert wrong.exit_code == 2
    assert "must end in" in wrong.output
    assert "0 of 0" not in wrong.output


def test_a_recording_of_another_game_gives_a_warning(tmp_path):
    np.save(tmp_path / "frames.npy", np.zeros((5, 210, 160), np.uint8))
    with pytest.warns(UserWarning, match="no object of Pong is in .*frames.npy: is it a record"):
        files.extract(tmp_path / "frames.npy", tmp_path / "out.npz", "Pong")
    assert (tmp_path / "out.npz").exists()
