"""Untrusted inputs: every reader keeps its input, stays in its folder, and reads its input or
raises an error, in bounded memory and time."""

import importlib.util
import json
import os
import shutil
import struct
import zipfile
import zlib

import gymnasium
import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax import files
from ocjax.files import InputError, inputs, pictures
from tests.support import reading
from tests.support.reading import READERS, save_arrow
from tests.support.states import excerpt

PICTURES = [f"folder of {suffix}" for suffix in pictures.FORMATS]
FOLDERS = [
    ".zarr",
    "folder of .parquet",
    "save_to_disk",
    "minari",
    *PICTURES,
]  # their input is a folder

pytestmark = pytest.mark.filterwarnings("ignore:`:UserWarning")  # in minari


@pytest.fixture(scope="module")
def read():
    reader = reading.Reader()
    yield reader
    reader.close()


@pytest.fixture(scope="module")
def rows():
    return excerpt("Pong")["rams"][:20]


@pytest.fixture(params=READERS)
def reader(request):
    return request.param


@pytest.fixture
def source(reader, rows, tmp_path, monkeypatch):
    """An input of each reader."""
    folder = tmp_path / "input"
    folder.mkdir()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder))
    return READERS[reader](folder, rows)


def parts(tmp_path):
    """The files of the input."""
    return sorted(
        path
        for path in (tmp_path / "input").rglob("*")
        if path.is_file() and path.name != "namespace_metadata.json"
    )


def test_every_reader_is_in_the_table():
    assert {*inputs._OPENERS} | {
        f"folder of {suffix}" for suffix in pictures.FORMATS
    } <= READERS.keys()


def test_every_reader_reads(source, rows):
    with files.open_input(source) as opened:
        assert opened.rows == len(rows)
        found = np.concatenate(
            [opened.read(start, min(start + 6, len(rows))) for start in range(0, len(rows), 6)]
        )
        again = opened.read(3, 12)
        stored = {path.name for path in opened.reads}
    assert np.array_equal(found[3:12], again)
    assert stored
    if opened.row_shape == (128,):
        assert np.array_equal(found, rows)


def test_outputs_on_top_of_inputs_are_refused(source, tmp_path):
    """The test names each input file as output: by its name, by a link, by a hard link, and through
    a link to its folder."""
    before = {path: path.read_bytes() for path in parts(tmp_path)}
    (tmp_path / "folder").symlink_to(tmp_path / "input")
    for k, path in enumerate(before):
        link, other = tmp_path / f"link{k}.npz", tmp_path / f"other{k}.npz"
        link.symlink_to(path)
        os.link(path, other)
        outs = [link, other]
        if path.suffix in (".npz", ".h5", ".hdf5", ".parquet", ".json"):
            outs += [path, tmp_path / "folder" / path.relative_to(tmp_path / "input")]
        for out in outs:
            with pytest.raises(shutil.SameFileError, match="would replace the input"):
                files.extract(source, out, "Pong")
            assert {path: path.read_bytes() for path in before} == before
    assert not any(tmp_path.rglob("*.parts"))


def put_link(path, moved):
    path.symlink_to(moved)


def put_pipe(path, moved):
    os.mkfifo(path)


def put_folder(path, moved):
    path.mkdir()


@pytest.mark.parametrize("reader", FOLDERS, indirect=True)
@pytest.mark.parametrize(
    ("kind", "put"),
    [("a link", put_link), ("a special file", put_pipe), ("", put_folder)],
    ids=["link", "pipe", "folder"],
)
def test_special_files_in_folders_are_refused(source, reader, tmp_path, read, kind, put):
    """A link to the file's own contents outside the folder, a pipe, and a folder take the place of
    each file."""
    for path in parts(tmp_path):
        moved = tmp_path / "moved"
        path.rename(moved)
        put(path, moved)
        found = read(source)
        if put is put_folder and reader == ".zarr":  # a missing chunk is full of zeros
            assert found == "read" or found.startswith("InputError")
        else:
            assert found.startswith("InputError"), (path, found)
            assert kind in found, (path, found)
        path.rmdir() if put is put_folder else path.unlink()
        moved.rename(path)
    assert read(source) == "read"


@pytest.mark.parametrize("reader", [name for name in READERS if name not in FOLDERS], indirect=True)
def test_pipes_are_refused(source, read):
    source.unlink()
    os.mkfifo(source)
    assert "is a special file" in read(source)
    for kind in ("recording", "policy"):
        assert "not a regular file" in read(source, kind=kind)


def test_damaged_inputs_are_refused_or_read(source, tmp_path, read):
    """The test cuts each file off, or overwrites it with other bytes from some offset on.

    Nothing crashes, hangs or raises another error.
    """
    rng = np.random.default_rng(0)
    for path in parts(tmp_path)[:3]:
        whole = path.read_bytes()
        for at in rng.integers(len(whole), size=4).tolist():
            for damaged in (
                whole[:at],
                whole[:at] + rng.bytes(min(16, len(whole) - at)) + whole[at + 16 :],
            ):
                path.write_bytes(damaged)
                found = read(source)
                assert found == "read" or found.startswith("InputError"), (path, at, found)
        path.write_bytes(whole)


def png_of(width, height):
    """A PNG picture of black pixels in a few kilobytes."""

    def chunk(name, data):
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    packer = zlib.compressobj(9)
    data = b"".join(packer.compress(bytes(1 + width)) for _ in range(height)) + packer.flush()
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    )


@pytest.fixture(scope="module", params=[9_000, 13_000])
def bomb(request):
    """A picture below the limit of Pillow's own, and one above."""
    return png_of(request.param, request.param)


def in_folder(folder, content):
    path = folder / "Pong"
    path.mkdir()
    for i in range(3):
        (path / f"{i}.png").write_bytes(content)
    return path


def in_table(save):
    def write(folder, content):
        pa = pytest.importorskip("pyarrow")
        return save(folder, pa.table({"image": [content] * 3}))

    return write


def save_parquet(folder, table):
    pytest.importorskip("pyarrow.parquet").write_table(table, folder / "Pong.parquet")
    return folder / "Pong.parquet"


def save_stream(folder, table):
    (folder / "Pong").mkdir()
    save_arrow(folder / "Pong" / "a.arrow", table, stream=True)
    (folder / "Pong" / "state.json").write_text('{"_data_files": [{"filename": "a.arrow"}]}')
    return folder / "Pong"


HOLDERS = {
    "folder": in_folder,
    "parquet": in_table(save_parquet),
    "arrow": in_table(lambda folder, table: save_arrow(folder / "Pong.arrow", table)),
    "save_to_disk": in_table(save_stream),
}


OTHERS = {
    "eps": b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 160 210\n",
    "ppm": b"P5 160 210 255 ",
    "long": bytes(2**20 + 1),
}


@pytest.mark.parametrize("holder", HOLDERS)
def test_sizes_of_pictures_are_checked_before_pixels_are_decoded(holder, tmp_path, read, bomb):
    found = read(HOLDERS[holder](tmp_path, bomb))
    assert found.startswith("InputError")
    assert "pictures must be 160 pixels wide" in found or "169000000 pixels" in found, found


@pytest.mark.parametrize("holder", HOLDERS)
@pytest.mark.parametrize("content", OTHERS)
def test_other_contents_are_refused(holder, tmp_path, read, content):
    """Readers decode only the documented formats, with any suffix."""
    found = read(HOLDERS[holder](tmp_path, OTHERS[content].ljust(33_000, b"0")))
    assert found.startswith("InputError"), found


def npz(path, name, header, data):
    """An archive with RAM and an array with the given header and data."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("rams.npy", "w") as file:
            np.lib.format.write_array(file, np.zeros((4, 128), np.uint8))
        with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
            np.lib.format.write_array_header_1_0(file, {"fortran_order": False, **header})
            for part in data:
                file.write(part)
    return path


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("input", "game"),
        ("recording", "game"),
        ("recording", "settings"),
        ("policy", "description"),
    ],
)
def test_giant_texts_are_refused(tmp_path, read, kind, name):
    path = npz(
        tmp_path / "Pong.npz",
        name,
        {"descr": "<U100000000", "shape": ()},
        [bytes(2**22)] * 95 + [bytes(400_000_000 - 95 * 2**22)],
    )
    found = read(path, kind=kind)
    assert "text of 400,000,000 bytes" in found, found


@pytest.mark.parametrize(
    ("kind", "name"), [("recording", "lives"), ("recording", "screens"), ("policy", "w0")]
)
def test_giant_arrays_are_refused(tmp_path, read, kind, name):
    """Giant arrays do not fit the other arrays, and the reader does not read them further."""
    path = npz(
        tmp_path / "Pong.npz", name, {"descr": "|u1", "shape": (2**29,)}, [bytes(2**23)] * 2**6
    )
    found = read(path, kind=kind)
    assert found.startswith({"recording": "RecordingError", "policy": "PolicyError"}[kind]), found
    assert "MemoryError" not in found


def giant_npy(folder):
    with (folder / "Pong.npy").open("wb") as file:
        np.lib.format.write_array_header_1_0(
            file, {"descr": "|u1", "fortran_order": False, "shape": (1, 10**10, 128)}
        )
    return folder / "Pong.npy"


def long_npy(folder):
    with (folder / "Pong.npy").open("wb") as file:
        np.lib.format.write_array_header_1_0(
            file, {"descr": "|u1", "fortran_order": False, "shape": (10**12, 128)}
        )
        file.write(bytes(256))
    return folder / "Pong.npy"


def negative_npy(folder):
    with (folder / "Pong.npy").open("wb") as file:
        np.lib.format.write_array_header_1_0(
            file, {"descr": "|u1", "fortran_order": False, "shape": (-4, 128)}
        )
    return folder / "Pong.npy"


def hdf5(**options):
    def write(folder):
        h5py = pytest.importorskip("h5py")
        with h5py.File(folder / "Pong.h5", "w") as file:
            file.create_dataset("rams", dtype="u1", **options)
        return folder / "Pong.h5"

    return write


def repeated_filter(folder):
    h5py = pytest.importorskip("h5py")
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_chunk((4096, 128))
    for _ in range(2):
        properties.set_deflate(9)
    with h5py.File(folder / "Pong.h5", "w") as file:
        space = h5py.h5s.create_simple((4096, 128))
        h5py.Dataset(h5py.h5d.create(file.id, b"rams", h5py.h5t.STD_U8LE, space, properties))[:] = 0
    return folder / "Pong.h5"


def zarr(**options):
    def write(folder):
        library = pytest.importorskip("zarr")
        array = library.create_group(folder / "Pong.zarr").create_array(
            "rams", dtype="u1", **options
        )
        array[0] = 1
        return folder / "Pong.zarr"

    return write


def giant_zarr_chunks(folder):
    path = zarr(shape=(4, 128), chunks=(4, 128))(folder)
    metadata = path / "rams" / "zarr.json"
    fields = json.loads(metadata.read_text())
    fields["chunk_grid"]["configuration"]["chunk_shape"] = [2**24, 128]
    metadata.write_text(json.dumps(fields))
    return path


def pickling_zarr(part):
    """A Zarr array with metadata that ask for pickle."""

    def write(folder):
        pytest.importorskip("zarr")
        path = folder / "Pong.zarr"
        path.mkdir()
        codec = (
            {"filters": [{"id": "pickle"}]}
            if part == "filters"
            else {"compressor": {"id": "pickle"}}
        )
        fields = {
            "zarr_format": 2,
            "shape": [4, 128],
            "chunks": [4, 128],
            "dtype": "|u1",
            "compressor": None,
            "filters": None,
        }
        (path / ".zarray").write_text(json.dumps(fields | {"fill_value": 0, "order": "C"} | codec))
        (path / "0.0").write_bytes(b"cos\nsystem\n(S'touch %s'\ntR." % bytes(folder / "executed"))
        return path

    return write


def repeated_rows(folder):
    """A few kilobytes of Parquet that hold ten million rows."""
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    column = pa.DictionaryArray.from_arrays(
        pa.array(np.zeros(10**7, np.int8)), pa.array([bytes(128)])
    )
    parquet.write_table(
        pa.table({"ram": column.dictionary_decode()}), folder / "Pong.parquet", compression="zstd"
    )
    return folder / "Pong.parquet"


def arrow(column):
    """A column in an Arrow file, with its buffers written unchanged."""

    def write(folder):
        pa = pytest.importorskip("pyarrow")
        return save_arrow(folder / "Pong.arrow", pa.table({"ram": column(pa)}))

    return write


def offsets_out_of_bounds(pa):
    offsets = np.array([0, 128, 2**30, 384], np.int32)
    return pa.Array.from_buffers(
        pa.binary(), 3, [None, pa.py_buffer(offsets), pa.py_buffer(bytes(384))]
    )


def lists_out_of_bounds(pa):
    offsets = np.array([0, 128, 2**30, 384], np.int32)
    return pa.Array.from_buffers(
        pa.list_(pa.uint8()),
        3,
        [None, pa.py_buffer(offsets)],
        children=[pa.array(bytes(384), pa.uint8())],
    )


def pictures_out_of_bounds(pa):
    return pa.StructArray.from_arrays(
        [offsets_out_of_bounds(pa), pa.nulls(3, pa.string())], ["bytes", "path"]
    )


def repeated_runs(pa):
    return pa.RunEndEncodedArray.from_arrays(pa.array([2**30], pa.int64()), pa.array([bytes(128)]))


def shared_lists(pa):
    offsets, sizes = np.zeros(1000, np.int32), np.full(1000, 128 * 1000, np.int32)
    return pa.ListViewArray.from_arrays(
        pa.array(offsets), pa.array(sizes), pa.array(np.zeros(128_000, np.uint8))
    )


def shared_bytes(pa):
    return pa.DictionaryArray.from_arrays(
        pa.array(np.zeros(1000, np.int32)), pa.array([bytes(2**20)])
    )


GIANTS = {
    "npy, giant first entry": giant_npy,
    "npy, many rows": long_npy,
    "npy, negative": negative_npy,
    "hdf5, many rows": hdf5(shape=(10**12, 128)),
    "hdf5, many rows in chunks": hdf5(shape=(10**12, 128), chunks=(64, 128), compression="gzip"),
    "hdf5, giant entries": hdf5(shape=(2, 10**9, 128), chunks=(1, 64, 128)),
    "hdf5, giant chunks": hdf5(
        shape=(4, 128), maxshape=(None, 128), chunks=(2**24, 128), compression="gzip"
    ),
    "hdf5, repeated filter": repeated_filter,
    "zarr, many rows": zarr(shape=(10**12, 128), chunks=(64, 128)),
    "zarr, giant chunks": giant_zarr_chunks,
    "zarr, pickled filters": pickling_zarr("filters"),
    "zarr, pickled compressor": pickling_zarr("compressor"),
    "parquet, repeated rows": repeated_rows,
    "arrow, offsets of bytes": arrow(offsets_out_of_bounds),
    "arrow, offsets of lists": arrow(lists_out_of_bounds),
    "arrow, offsets of pictures": arrow(pictures_out_of_bounds),
    "arrow, repeated runs": arrow(repeated_runs),
    "arrow, shared lists": arrow(shared_lists),
    "arrow, shared bytes": arrow(shared_bytes),
}


@pytest.mark.parametrize("case", GIANTS)
def test_claims_that_a_file_cannot_hold_are_refused(case, tmp_path, read):
    found = read(GIANTS[case](tmp_path), memory=2**29)
    assert found.startswith("InputError"), found
    assert "MemoryError" not in found
    assert "\n" not in found
    assert not (tmp_path / "executed").exists()


SECRET = 7  # each byte of a file that is not part of the input


@pytest.fixture
def secret(tmp_path):
    """Files of the user beside an input, with rows that a reader could take for RAM."""
    rows = np.full((20, 128), SECRET, np.uint8)
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "raw").write_bytes(rows.tobytes())
    if importlib.util.find_spec("pyarrow") and importlib.util.find_spec("h5py"):
        reading.hdf5(".h5")(tmp_path / "secret", rows)
        save_arrow(tmp_path / "secret" / "a.arrow", reading.table(rows), stream=True)
    return tmp_path / "secret"


def external_storage(file, secret):
    file.create_dataset("rams", (20, 128), "u1", external=[(str(secret / "raw"), 0, 2560)])


def virtual(file, secret):
    h5py = pytest.importorskip("h5py")
    layout = h5py.VirtualLayout((20, 128), "u1")
    layout[:] = h5py.VirtualSource(str(secret / "Pong.h5"), "a/rams", (20, 128))
    file.create_virtual_dataset("rams", layout)


def external_link(file, secret):
    h5py = pytest.importorskip("h5py")
    file["rams"] = h5py.ExternalLink(str(secret / "Pong.h5"), "a/rams")


def external_group(file, secret):
    h5py = pytest.importorskip("h5py")
    file["rams"] = np.zeros((4, 128), np.uint8)
    file["a"] = h5py.ExternalLink(str(secret / "Pong.h5"), "a")


@pytest.mark.parametrize("array", [None, "rams", "a/rams"])
@pytest.mark.parametrize("refer", [external_storage, virtual, external_link, external_group])
def test_hdf5_reads_no_other_file(tmp_path, secret, refer, array):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "Pong.h5", "w") as file:
        refer(file, secret)
    with pytest.raises(InputError, match=r"other file|has no array 'a/rams'"):
        files.extract(tmp_path / "Pong.h5", tmp_path / "out.npz", array=array)
    assert not (tmp_path / "out.npz").exists()


@pytest.mark.filterwarnings("ignore:`:UserWarning")
@pytest.mark.parametrize("refer", [external_storage, virtual, external_link])
def test_minari_reads_no_other_file(tmp_path, secret, rows, refer, monkeypatch):
    h5py = pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    name = reading.write_minari(tmp_path, rows)
    with h5py.File(tmp_path / "pong" / "test-v0" / "data" / "main_data.hdf5", "a") as file:
        del file["episode_1/observations"]
        refer(file["episode_1"], secret)
        file["episode_1"].move("rams", "observations")
    for out in (tmp_path / "out.npz", "minari:pong/copy-v0"):
        with pytest.raises(InputError, match="other file"):
            files.extract(name, out)
    assert not (tmp_path / "out.npz").exists()
    assert not (tmp_path / "pong" / "copy-v0").exists()


def test_minari_makes_no_environment(tmp_path, rows, read, monkeypatch):
    """Without spaces in the metadata, minari would import the entry point that they name, and call
    it."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    name = reading.write_minari(tmp_path, rows)
    path = tmp_path / "pong" / "test-v0" / "data" / "metadata.json"
    fields = json.loads(path.read_text())
    spec = gymnasium.spec("ocjax/Pong-v5").to_json()
    changed = json.loads(spec) | {
        "entry_point": "os:system",
        "kwargs": {"command": f"touch {tmp_path / 'executed'}"},
    }
    del fields["action_space"]
    path.write_text(json.dumps(fields | {"env_spec": json.dumps(changed)}))
    found = read(name)
    assert "lack action_space" in found, found
    assert not (tmp_path / "executed").exists()


def test_minari_claims_are_checked(tmp_path, rows, read, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    for data_format in ("hdf5", "arrow", "parquet"):
        folder = tmp_path / data_format
        monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder))
        name = reading.write_minari(folder, rows, data_format)
        assert read(name, memory=2**30) == "read"
        path = folder / "pong" / "test-v0" / "data" / "metadata.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"total_episodes": 10**12}))
        assert "claims 1,000,000,000,000" in read(name)


@pytest.mark.parametrize(
    "other",
    ["../../secret/a.arrow", "{secret}/a.arrow", "..", ".", "", 3, "link.arrow", "folder/a.arrow"],
)
def test_folders_of_datasets_refer_to_their_own_files(tmp_path, secret, rows, other):
    path = reading.write_hugging_face(tmp_path, rows)
    (path / "train" / "link.arrow").symlink_to(secret / "a.arrow")
    (path / "train" / "folder").symlink_to(secret)
    (path / "folder").symlink_to(secret)
    name = other.format(secret=secret) if isinstance(other, str) else other
    (path / "train" / "state.json").write_text(json.dumps({"_data_files": [{"filename": name}]}))
    with pytest.raises(InputError):
        files.extract(path, tmp_path / "out.npz")
    (path / "dataset_dict.json").write_text(json.dumps({"splits": [name]}))
    with pytest.raises(InputError):
        files.extract(path, tmp_path / "out.npz")
    assert not (tmp_path / "out.npz").exists()


def test_files_that_are_listed_twice(tmp_path, rows):
    path = reading.write_hugging_face(tmp_path, rows) / "train"
    (path / "state.json").write_text(
        json.dumps({"_data_files": [{"filename": "data-1.arrow"}] * 1000})
    )
    with pytest.raises(InputError, match="lists a file twice"):
        files.extract(path, tmp_path / "out.npz", "Pong")


def test_names_of_pictures(tmp_path, rows):
    """Readers ignore hidden files and sort all other names, also names with other digits."""
    folder = reading.picture_folder("png")(tmp_path, rows[:3])
    for old, new in (("0", "\u00b2"), ("1", "10"), ("2", "9\u0663")):
        (folder / f"{old}.png").rename(folder / f"{new}.png")
    for name in ("._1.png", ".hidden.png", "notes.txt"):
        (folder / name).write_text("no picture")
    (folder / "sub").mkdir()
    with files.open_input(folder) as opened:
        assert [opened.stem(i) for i in range(opened.rows)] == ["9\u0663", "10", "\u00b2"]


@pytest.mark.parametrize("suffix", pictures.FORMATS)
def test_animations_are_refused(tmp_path, suffix):
    (tmp_path / "pong").mkdir()
    frames = [Image.new("RGB", (160, 210), color) for color in ("black", "white")]
    if suffix == ".bmp":
        return
    options = {"lossless": True} if suffix == ".webp" else {}
    frames[0].save(
        tmp_path / "pong" / f"0{suffix}", save_all=True, append_images=frames[1:], **options
    )
    with pytest.raises(InputError, match="holds several frames"):
        files.extract(tmp_path / "pong", tmp_path / "out.npz")


@pytest.mark.parametrize("suffix", pictures.FORMATS)
def test_frames_in_pictures(tmp_path, suffix):
    """Frames as RGB pictures and as pictures of palette indices, in folders and in tables."""
    game, screens = ocjax.load("Pong"), excerpt("Pong")["screens"][:4]
    options = {"lossless": True} if suffix == ".webp" else {}
    for name, frames in (("rgb", np.asarray(game.palette)[screens]), ("indices", screens)):
        if name == "indices" and suffix in (".webp", ".gif"):
            continue  # these have colours
        (tmp_path / name).mkdir()
        for i, frame in enumerate(frames):
            Image.fromarray(frame).save(tmp_path / name / f"{i}{suffix}", **options)
        inputs = [tmp_path / name]
        if importlib.util.find_spec("pyarrow"):
            pa = pytest.importorskip("pyarrow")
            images = [(tmp_path / name / f"{i}{suffix}").read_bytes() for i in range(len(frames))]
            inputs.append(save_parquet(tmp_path, pa.table({"image": images})))
        for source in inputs:
            files.extract(source, tmp_path / "out.npz", "Pong")
            with np.load(tmp_path / "out.npz") as found:
                assert np.array_equal(found["xywh"], game.vem(frames).xywh)


def write_groups(path, parts, name):
    """Arrays in groups, in an archive or a file of each format that has groups; `name` has a place
    for the number of the episode."""
    if path.suffix == ".npz":
        np.savez(path, **{name.format(k): part for k, part in parts.items()})
    elif path.suffix == ".h5":
        with pytest.importorskip("h5py").File(path, "w") as file:
            for k, part in parts.items():
                file[name.format(k)] = part
    else:
        group = pytest.importorskip("zarr").create_group(path)
        for k, part in parts.items():
            group.create_array(name.format(k), shape=part.shape, dtype=part.dtype)[:] = part


@pytest.fixture(params=[".npz", ".h5", ".zarr"])
def grouped(request, tmp_path):
    return tmp_path / f"Pong{request.param}"


@pytest.mark.parametrize(
    "name", ["episode_{}/observations", "data/demo_{}/obs/ram", "rollout{}/step{}/rams"]
)
def test_episodes_in_groups(grouped, tmp_path, rows, name):
    """Groups are read in natural order, and outputs number the episodes."""
    lengths = {10: 5, 9: 7, 1: 0, 100: 8}
    ends = dict(
        zip(sorted(lengths), np.cumsum([lengths[k] for k in sorted(lengths)]).tolist(), strict=True)
    )
    episodes = {k: rows[ends[k] - lengths[k] : ends[k]] for k in lengths}
    write_groups(grouped, episodes, name.replace("{}", "{0}"))
    with files.open_input(grouped) as opened:
        assert np.array_equal(opened.read(0, len(rows)), rows)
        assert np.array_equal(opened.read(5, 9), rows[5:9])
    number = np.repeat(np.arange(4), [0, 7, 5, 8])
    files.extract(grouped, tmp_path / "out.npz")
    with np.load(tmp_path / "out.npz") as found:
        assert np.array_equal(found["xywh"], ocjax.load("Pong").rem(rows).xywh)
        assert np.array_equal(found["episode"], number)
    if importlib.util.find_spec("h5py"):
        files.extract(grouped, tmp_path / "out.h5")
        with pytest.importorskip("h5py").File(tmp_path / "out.h5") as found:
            assert np.array_equal(found["episode"], number)
    if importlib.util.find_spec("pyarrow"):
        files.extract(grouped, tmp_path / "out.parquet")
        found = pytest.importorskip("pyarrow.parquet").read_table(tmp_path / "out.parquet")
        assert np.array_equal(found["episode"].to_numpy(), number[found["row"].to_numpy()])


def test_one_episode_by_its_name(grouped, rows):
    write_groups(grouped, {1: rows[:5], 2: rows[5:]}, "episode_{}/observations")
    with files.open_input(grouped, "episode_2/observations") as opened:
        assert np.array_equal(opened.read(0, opened.rows), rows[5:])
    with files.open_input(grouped, "observations") as opened:
        assert opened.episodes == [5, 15]


def test_arrays_of_one_name_that_are_no_episodes(grouped, tmp_path, rows):
    write_groups(grouped, {"train": rows, "test": rows[:3]}, "{}/rams")
    with pytest.raises(
        InputError, match=r"several arrays that match: test/rams \[3, 128\], train/rams \[20, 128\]"
    ):
        files.extract(grouped, tmp_path / "out.npz")
    with files.open_input(grouped, "test/rams") as opened:
        assert opened.rows == 3


def test_episodes_of_different_rows(grouped, tmp_path, rows):
    for k, other in enumerate((np.zeros((2, 210, 160), np.uint8), rows[:, :127])):
        path = grouped.with_stem(f"Pong{k}")
        write_groups(path, {1: rows, 2: other}, "episode_{}/observations")
        with pytest.raises(
            InputError,
            match=rf"episode_2/observations, has the shape \[{len(other)}, {other.shape[1]}",
        ):
            files.extract(path, tmp_path / "out.npz", "Pong")


@pytest.mark.filterwarnings("ignore:`:UserWarning")
def test_episodes_of_minari(tmp_path, rows, monkeypatch):
    for data_format in ("hdf5", "arrow", "parquet"):
        monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / data_format))
        files.extract(
            reading.write_minari(tmp_path / data_format, rows, data_format), tmp_path / "out.npz"
        )
        with np.load(tmp_path / "out.npz") as found:
            assert np.array_equal(found["episode"], [0] * 9 + [1] * 11)
            assert np.array_equal(found["xywh"], ocjax.load("Pong").rem(rows).xywh)


@pytest.mark.parametrize("data_format", ["hdf5", "arrow", "parquet"])
def test_minari_with_jpeg(tmp_path, monkeypatch, data_format):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    frames = np.asarray(ocjax.load("Pong").palette)[excerpt("Pong")["screens"][:20]]
    with pytest.raises(InputError, match="stores frames as JPEG"):
        files.extract(reading.write_minari(tmp_path, frames, data_format), tmp_path / "out.npz")


def test_folders_of_parquet_files(tmp_path, rows):
    parquet = pytest.importorskip("pyarrow.parquet")
    folder = reading.write_parquet_folder(tmp_path, rows) / "data"
    for source in (folder, folder.parent):
        with files.open_input(source) as opened:
            assert np.array_equal(opened.read(0, 20), rows)
    (folder / "train-00001-of-00002.parquet").rename(tmp_path / "moved")
    with pytest.raises(
        InputError,
        match=r"has 1 Parquet files, but the name of train-00000-of-00002\.parquet is one of 2",
    ):
        files.extract(folder, tmp_path / "out.npz", "Pong")
    (tmp_path / "moved").rename(folder / "test-00001-of-00002.parquet")
    with pytest.raises(InputError, match="has the splits test, train"):
        files.extract(folder, tmp_path / "out.npz", "Pong")
    many = tmp_path / "many"
    many.mkdir()
    for k in range(12):
        parquet.write_table(reading.table(np.full((1, 128), k, np.uint8)), many / f"{k}.parquet")
    with files.open_input(many) as opened:
        assert opened.read(0, 12)[:, 0].tolist() == list(range(12))
