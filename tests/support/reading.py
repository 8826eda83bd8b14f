"""Inputs of `ocjax.files` in every format, and a process with little memory that reads inputs."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import ocjax

SERVER = """
import importlib.util, json, os, resource, signal, sys
from pathlib import Path
import numpy as np
import ocjax
from ocjax import datasets, files, recordings
from ocjax.play import policies

def read_input(path):
    with files.open_input(path) as rows:
        for start in range(0, rows.rows, 1024):
            rows.read(start, min(start + 1024, rows.rows))

READ = {
    "input": read_input,
    "recording": recordings.read,
    "policy": lambda path: policies.read(path, ocjax.load("Pong")),
    "dataset": datasets.open_dataset,
}
for module in ("h5py", "zarr", "pyarrow.parquet", "pyarrow.compute", "minari"):
    if importlib.util.find_spec(module.partition(".")[0]):
        importlib.import_module(module)
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
for line in sys.stdin:
    kind, path, memory, seconds, minari = json.loads(line)
    os.environ["MINARI_DATASETS_PATH"] = minari
    read_end, write_end = os.pipe()
    child = os.fork()
    if not child:
        resource.setrlimit(resource.RLIMIT_AS, (used + memory, used + memory))
        signal.alarm(seconds)
        try:
            READ[kind](path)
            text = "read"
        except Exception as error:
            text = f"{type(error).__name__}: {error}"
        os.write(write_end, text.encode(errors="replace")[:4000])
        os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end, errors="replace") as pipe:
        text = pipe.read()
    status = os.waitpid(child, 0)[1]
    print(json.dumps(text or f"ended with status {status}"), flush=True)
"""


class Reader:
    """A process that reads each input in a new process with a limit of memory and time."""

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def __call__(self, path, *, kind="input", memory=2**28, seconds=60):
        """The type and message of the error, or "read"."""
        self._process.stdin.write(
            json.dumps(
                [kind, str(path), memory, seconds, os.environ.get("MINARI_DATASETS_PATH", "")]
            )
            + "\n"
        )
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def close(self):
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()


def picture_folder(suffix, **options):
    def write(folder, rows):
        path = folder / "Pong"
        path.mkdir()
        for i, ram in enumerate(rows):
            frame = np.zeros((210, 160), np.uint8)
            frame[:1, :128] = ram & 0xFE
            Image.fromarray(ocjax.load("Pong").palette[frame]).save(
                path / f"{i}.{suffix}", **options
            )
        return path

    return write


def write_npy(folder, rows):
    np.save(folder / "Pong.npy", rows)
    return folder / "Pong.npy"


def write_npz(folder, rows):
    np.savez_compressed(folder / "Pong.npz", rams=rows, game="Pong")
    return folder / "Pong.npz"


def hdf5(suffix):
    def write(folder, rows):
        h5py = pytest.importorskip("h5py")
        with h5py.File(folder / f"Pong{suffix}", "w") as file:
            file.create_dataset("a/rams", data=rows, chunks=(4, 128), compression="gzip")
        return folder / f"Pong{suffix}"

    return write


def write_zarr(folder, rows):
    zarr = pytest.importorskip("zarr")
    group = zarr.create_group(folder / "Pong.zarr")
    group.create_array("a/rams", shape=rows.shape, dtype=rows.dtype, chunks=(4, 128))[:] = rows
    return folder / "Pong.zarr"


def table(rows):
    pa = pytest.importorskip("pyarrow")
    return pa.table(
        {
            "n": np.arange(len(rows)),
            "ram": pa.FixedSizeListArray.from_arrays(pa.array(rows.reshape(-1)), 128),
        }
    )


def save_arrow(path, whole, *, stream=False, batch=None):
    """Write a table as an Arrow file, unchecked, in batches of `batch` rows."""
    pa = pytest.importorskip("pyarrow")
    new = pa.ipc.new_stream if stream else pa.ipc.new_file
    with pa.OSFile(str(path), "wb") as sink, new(sink, whole.schema) as writer:
        writer.write_table(whole, max_chunksize=batch)
    return path


def write_arrow(folder, rows):
    return save_arrow(folder / "Pong.arrow", table(rows), batch=9)


def write_stream(folder, rows):
    return save_arrow(folder / "Pong.arrow", table(rows), stream=True, batch=9)


def write_feather(folder, rows):
    feather = pytest.importorskip("pyarrow.feather")
    feather.write_feather(table(rows), str(folder / "Pong.feather"), compression="zstd")
    return folder / "Pong.feather"


def write_parquet(folder, rows):
    pytest.importorskip("pyarrow.parquet").write_table(
        table(rows), folder / "Pong.parquet", row_group_size=7
    )
    return folder / "Pong.parquet"


def write_parquet_folder(folder, rows):
    parquet = pytest.importorskip("pyarrow.parquet")
    (folder / "Pong" / "data").mkdir(parents=True)
    for k, part in enumerate((rows[:9], rows[9:])):
        parquet.write_table(
            table(part), folder / "Pong" / "data" / f"train-{k:05}-of-00002.parquet"
        )
    return folder / "Pong"


def write_hugging_face(folder, rows):
    path = folder / "Pong" / "train"
    path.mkdir(parents=True)
    names = ["data-1.arrow", "data-0.arrow"]
    for name, part in zip(names, (rows[:9], rows[9:]), strict=True):
        save_arrow(path / name, table(part), stream=True, batch=5)
    (path / "state.json").write_text(
        json.dumps({"_data_files": [{"filename": name} for name in names]})
    )
    (folder / "Pong" / "dataset_dict.json").write_text('{"splits": ["train"]}')
    return folder / "Pong"


def write_minari(folder, rows, data_format="hdf5"):
    """Write two episodes to the folder in the environment variable MINARI_DATASETS_PATH."""
    pytest.importorskip("minari")
    from gymnasium import spaces
    from minari.data_collector import EpisodeBuffer
    from minari.dataset.minari_storage import MinariStorage

    path = folder / "pong" / "test-v0"
    path.mkdir(parents=True)
    (folder / "pong" / "namespace_metadata.json").write_text("{}")
    box = spaces.Box(0, 255, rows.shape[1:], np.uint8)
    storage = MinariStorage.new(path / "data", box, spaces.Discrete(6), data_format=data_format)
    storage.update_metadata(
        {"dataset_id": "pong/test-v0", "minari_version": "0.5.4", "ocjax": {"game": "Pong"}}
    )
    for k, part in enumerate((rows[:9], rows[9:])):
        n = len(part) - 1
        flags = np.zeros(n, bool)
        storage.update_episodes(
            [
                EpisodeBuffer(
                    k, None, None, part, np.zeros(n, np.int64), np.zeros(n), flags, flags, {}
                )
            ]
        )
    return "minari:pong/test-v0"


READERS = {
    ".npy": write_npy,
    ".npz": write_npz,
    ".h5": hdf5(".h5"),
    ".hdf5": hdf5(".hdf5"),
    ".zarr": write_zarr,
    ".parquet": write_parquet,
    ".arrow": write_arrow,
    ".arrow stream": write_stream,
    ".feather": write_feather,
    "folder of .parquet": write_parquet_folder,
    "save_to_disk": write_hugging_face,
    "minari": write_minari,
    "folder of .png": picture_folder("png"),
    "folder of .gif": picture_folder("gif"),
    "folder of .webp": picture_folder("webp", lossless=True),
    "folder of .bmp": picture_folder("bmp"),
    "folder of .tif": picture_folder("tif"),
    "folder of .tiff": picture_folder("tiff", compression="tiff_lzw"),
}
