"""Objects in files."""

import dataclasses

import jax
import numpy as np
import pytest

import ocjax
from ocjax.extraction.records import FIELDS, no_objects
from tests.support.states import excerpt


def same(a, b):
    return a.game is b.game and jax.tree.all(jax.tree.map(np.array_equal, a, b))


def random_objects(game, batch):
    """Objects with random bytes in all fields."""
    rng = np.random.default_rng(0)
    fields = {
        name: np.frombuffer(rng.bytes(array.nbytes), array.dtype).reshape(array.shape)
        if name != "valid"
        else rng.random(array.shape) < 0.5
        for name, array in no_objects(batch, game.num_slots).items()
    }
    return ocjax.Objects(**fields, game=game)


@pytest.mark.parametrize("name", ocjax.games())
def test_objects_of_every_game_are_the_same_after_a_round_trip(tmp_path, name):
    path = tmp_path / "objects.npz"
    for hud in (True, False):
        objects = random_objects(ocjax.load(name, hud=hud), (3,))
        for written in (objects, objects[0], objects.of(objects.game.categories[0])):
            written.save(path)
            read = ocjax.Objects.load(str(path))
            assert same(written, read)
            assert {field: getattr(read, field).dtype for field in FIELDS} == {
                field: np.dtype(dtype) for field, (dtype, _) in FIELDS.items()
            }
    assert [file.name for file in tmp_path.iterdir()] == ["objects.npz"]


def test_extracted_objects_in_files(tmp_path):
    objects = ocjax.load("Pong").rem(excerpt("Pong")["rams"].reshape(2, -1, 128))
    for written in (objects, objects[:, :0]):
        written.save(tmp_path / "objects.npz")
        read = ocjax.Objects.load(tmp_path / "objects.npz")
        assert same(written, read)
        assert read.to_list() == written.to_list()
    with pytest.raises(ValueError, match="no reference to their game"):
        dataclasses.replace(objects, game=None).save(tmp_path / "other.npz")
    with pytest.raises(FileNotFoundError, match=r"no file .*other\.npz"):
        ocjax.Objects.load(tmp_path / "other.npz")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"game": None}, "it has no game"),
        ({"md5": ["a"]}, r"md5 must be a single value, got <U1 \[1\]"),
        ({"game": "Chess"}, "no game 'Chess'"),
        ({"md5": "0" * 32}, "its ROM has md5 '000.*, but the decoder of Pong is for 60e0"),
        ({"category": "Car"}, "Pong has no category 'Car'"),
        ({"category": "Ball"}, r"xywh must be int16 \[2, 1, 4\], got int16 \[2, 5, 4\]"),
        ({"hud": False}, r"xywh must be int16 \[2, 3, 4\]"),
        ({"game": "a\nb"}, r"no game 'a\\nb'"),
        ({"value": None}, r"it has no array value \(int32 \[2, 5\]\)"),
        ({"valid": np.ones((2, 5), np.int8)}, r"valid must be bool \[2, 5\], got int8 \[2, 5\]"),
        ({"rgb": np.zeros((1, 5, 3), np.uint8)}, r"rgb must be uint8 \[2, 5, 3\]"),
        ({"valid": np.array(True)}, "must be"),
        ({"value": np.array([{}], object)}, "NpzError|claims object"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path, changes, message):
    path = tmp_path / "objects.npz"
    random_objects(ocjax.load("Pong"), (2,)).save(path)
    with np.load(path) as file:
        arrays = {**file, **changes}
    np.savez(path, **{name: a for name, a in arrays.items() if a is not None})
    with pytest.raises(ValueError, match=message) as caught:
        ocjax.Objects.load(path)
    assert str(caught.value).startswith(f"{path} is not a readable file of objects: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("size", [0, 10, 200, -1])
def test_cut_off_files_are_refused(tmp_path, size):
    path = tmp_path / "objects.npz"
    random_objects(ocjax.load("Pong"), (2,)).save(path)
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(ValueError, match="is not a readable file of objects"):
        ocjax.Objects.load(path)


def test_files_that_claim_too_much_are_refused_before_they_are_read(tmp_path):
    path = tmp_path / "objects.npz"
    random_objects(ocjax.load("Pong"), (2,)).save(path)
    with np.load(path) as file:
        arrays = dict(file)
    arrays["rgb"] = np.zeros((2**12, 5, 3), np.uint8)
    np.savez_compressed(path, **arrays)
    with pytest.raises(ValueError, match=r"rgb must be uint8 \[2, 5, 3\], got uint8 \[4096"):
        ocjax.Objects.load(path)


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "objects.npz"
    path.write_text("old")

    def fails(file, **arrays):
        file.write(b"some")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", fails)
    with pytest.raises(OSError, match=r"No space left on device: .*objects\.npz"):
        random_objects(ocjax.load("Pong"), (2,)).save(path)
    assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1
