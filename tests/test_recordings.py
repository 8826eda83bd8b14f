"""Recordings in files, and the excerpts that the tests use."""

import zipfile

import numpy as np
import pytest

import ocjax
from ocjax import recordings
from ocjax.emulators.start import variants
from ocjax.envs import Settings
from ocjax.play import rollouts
from tests.support.command import run_app
from tests.support.record import __main__ as command
from tests.support.record import fixtures
from tests.support.states import DATA, damaged_archive


@pytest.fixture(scope="module")
def tape():
    return rollouts.rollout(ocjax.load("Pong"), 64, seed=5, num_envs=4)


def test_a_written_recording_reads_back(tape, tmp_path):
    path = tmp_path / "tape.npz"
    tape.write(path)
    back = recordings.read(path)
    for name in (*recordings.ARRAYS, "frame_skip", "game"):
        assert np.array_equal(getattr(back, name), getattr(tape, name)), name
    assert [p.name for p in tmp_path.iterdir()] == ["tape.npz"]
    assert Settings(**back.settings) == Settings(frame_skip=3, repeat_action_probability=0.0)
    both = recordings.join([tape, back])
    assert both.settings == tape.settings
    assert len(np.unique(both.episode)) == 8
    assert both.frame_skip == 3
    with pytest.raises(FileNotFoundError):
        tape.write(tmp_path / "nowhere" / "tape.npz")


def test_wrong_arrays_are_refused(tape, tmp_path):
    path = tmp_path / "tape.npz"
    arrays = {"rams": tape.rams, "screens": tape.screens, "game": "Pong"}
    for change, message in (
        ({"lives": tape.lives[:-1]}, "lives must be numbers"),
        ({"settings": "v5"}, "settings must be a JSON object, got"),
        ({"resets": tape.lives}, "resets must be bool"),
        ({"previous": tape.previous[:, ::2]}, "previous must be uint8"),
        ({"previous_shown": tape.previous}, "previous_shown is stored as exclusive or with shown"),
    ):
        np.savez(path, **arrays, **change)
        with pytest.raises(recordings.RecordingError, match=message):
            recordings.read(path)


def test_files_of_the_wrong_game_or_rom_are_refused(tmp_path):
    with np.load(DATA / "Pong.npz") as file:
        rams, screens = file["rams"], file["screens"]
    pong = ocjax.load("Pong")

    def written(**arrays):
        path = tmp_path / "tape.npz"
        np.savez(path, **arrays)
        return path

    tape = recordings.read(written(rams=rams, screens=screens, game="Pong", md5=pong.md5))
    assert tape.game is pong
    assert np.array_equal(tape.rams, rams)
    assert recordings.read(written(rams=rams), "ALE/Pong-v5").screens is None
    for arrays, game, message in (
        ({"rams": rams, "game": "Pong"}, "Freeway", "a recording of Pong, not of Freeway"),
        ({"rams": rams, "game": "Pong", "md5": "0" * 32}, None, "ROM of md5 000"),
        ({"screens": screens}, "Pong", "no array 'rams'"),
        ({"rams": rams.astype(int)}, "Pong", "rams must be uint8"),
        ({"rams": rams, "screens": screens[:, :84, :84]}, "Pong", "screens must be uint8"),
        ({"rams": rams, "screens": screens[:-1]}, "Pong", "screens must be uint8"),
    ):
        with pytest.raises(recordings.RecordingError, match=message):
            recordings.read(written(**arrays), game)
    with pytest.raises(ocjax.errors.UnknownGameError):
        recordings.read(written(rams=rams))


def test_drawn_pixels_read_back(tape, tmp_path):
    drawn = np.random.default_rng(0).random(tape.screens.shape) < 0.1
    recordings.Recording(tape.game, tape.rams, tape.screens, drawn=drawn).write(
        tmp_path / "Pong.npz"
    )
    back = recordings.read(tmp_path / "Pong.npz")
    assert back.drawn.dtype == np.bool_
    assert np.array_equal(back.drawn, drawn)
    with np.load(tmp_path / "Pong.npz") as file:
        assert file["drawn"].nbytes * 8 == drawn.size


def test_a_failed_write_leaves_the_file_as_it_was(tape, tmp_path, monkeypatch):
    path = tmp_path / "tape.npz"
    tape.write(path)
    before = path.read_bytes()

    def fail(file, **arrays):
        file.write(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="disk full"):
        tape.write(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["tape.npz"]


@pytest.fixture(scope="module")
def damage(tmp_path_factory):
    """A function that damages a small recording in one of four ways, chosen by a number, and
    returns the file."""
    folder = tmp_path_factory.mktemp("damaged")
    whole = recordings.read(DATA / "Pong.npz")
    small = {name: array[:2] for name, array in whole.arrays.items()}
    recordings.Recording(whole.game, **small, frame_skip=3, settings={"noop_max": 3}).write(
        folder / "whole.npz"
    )
    good = (folder / "whole.npz").read_bytes()

    def damaged(number):
        path = folder / "Pong.npz"
        path.write_bytes(damaged_archive(good, number))
        return path

    return damaged, recordings.read(folder / "whole.npz")


def check_damaged(damage, number):
    """Check that a damaged file loads unchanged, or raises an error with its name."""
    damaged, whole = damage
    path = damaged(number)
    try:
        tape = recordings.read(path)
    except recordings.RecordingError as error:
        assert str(path) in str(error)  # noqa: PT017
        return False
    assert tape.settings == whole.settings
    assert tape.frame_skip == whole.frame_skip
    assert {k: v.tobytes() for k, v in tape.arrays.items()} == {
        k: v.tobytes() for k, v in whole.arrays.items()
    }
    return True


def test_damaged_files_are_refused(damage):
    loaded = [check_damaged(damage, number) for number in range(200)]
    assert not all(loaded[k] for k in range(0, 200, 2))


def stored(path, name, header, data=bytes(8), **info):
    """Write a zip archive with one member and a changed directory entry."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(
            f"{name}.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + data
        )
        for field, value in info.items():
            setattr(archive.infolist()[0], field, value)
    return path


@pytest.mark.parametrize(
    ("header", "info", "message"),
    [
        (
            b"{'descr': '|u1', 'fortran_order': False, 'shape': (999999999999, 128)}",
            {},
            "claims uint8",
        ),
        (
            b"{'descr': '|u1', 'fortran_order': False, 'shape': (1, 8)}",
            {"file_size": 2**40, "compress_size": 2**40},
            "claims 1,099,511,627,776|Overlapped entries",
        ),
        (
            b"{'descr': '|u1', 'fortran_order': False, 'shape': (1, 8)}",
            {"file_size": 2**40},
            "claims 1,099,511,627,776",
        ),
        (b"{'descr': '|O', 'fortran_order': False, 'shape': (1,)}", {}, "claims object"),
        (b"(" * 9000, {}, "not a readable"),
        (
            b"{'descr': '|u1', 'fortran_order': False, 'shape': (1, 8)}",
            {"compress_type": 99},
            "NotImplementedError",
        ),
        (
            b"{'descr': '|u1', 'fortran_order': False, 'shape': (1, 8)}",
            {"flag_bits": 1},
            "encrypted",
        ),
    ],
)
def test_false_headers_are_refused(tmp_path, header, info, message):
    path = stored(tmp_path / "Pong.npz", "rams", header, **info)
    with pytest.raises(recordings.RecordingError, match=message) as caught:
        recordings.read(path)
    assert str(path) in str(caught.value)


def test_facts_are_checked(tape, tmp_path):
    path = tmp_path / "Pong.npz"
    for facts, message in (
        ({"frame_skip": 0}, "frame_skip must be a number of at least 1"),
        ({"frame_skip": "3"}, "frame_skip must be a number of at least 1"),
        ({"frame_skip": [3, 4]}, "frame_skip must be a single value"),
        ({"settings": "[" * 100_000}, "settings must be a JSON object"),
        ({"settings": "3"}, "settings must be a JSON object"),
        ({"game": "Pung"}, "recording of another program: no game 'Pung'"),
        ({"game": ["Pong"]}, "game must be a single value"),
    ):
        np.savez_compressed(path, rams=tape.rams, **facts)
        with pytest.raises(recordings.RecordingError, match=message):
            recordings.read(path)


@pytest.fixture
def short(monkeypatch):
    """Runs of five seconds instead of a minute."""
    monkeypatch.setattr(fixtures, "FRAMES", 300)


@pytest.mark.slow
def test_equal_arguments_record_equal_samples(short):
    def record(*seeds):
        return fixtures.record(
            ocjax.load("Breakout"), 12, seeds=seeds, modes=(0, 4, 8), difficulties=(0, 1)
        )

    tape, again, other = record(0, 1), record(0, 1), record(2, 3)
    assert len(tape) == 12
    assert set(tape.arrays) == {"rams", "screens", "previous", "rewards", "lives"}
    for name, array in tape.arrays.items():
        assert np.array_equal(again.arrays[name], array), name
    assert not np.array_equal(other.rams, tape.rams)


@pytest.mark.slow
def test_boundaries_are_first_and_last_states_and_lost_lives():
    tape = fixtures.record_boundaries(ocjax.load("MsPacman"), 9, seed=5)
    assert tape.resets.sum() == tape.ends.sum() == 3
    assert not (tape.resets & tape.ends).any()
    assert (tape.rewards[tape.resets] == 0).all()
    assert (tape.lives[tape.ends] == 0).all()
    between = ~tape.resets & ~tape.ends
    assert (
        (tape.lives[between] >= 1) & (tape.lives[between] < tape.lives[tape.resets].max())
    ).all()
    assert np.array_equal(
        fixtures.record_boundaries(ocjax.load("MsPacman"), 9, seed=5).rams, tape.rams
    )


def test_samples_are_successive_emulated_frames(short):
    """VEM finds the ball of Pong at REM's place on the frame, and a few pixels away on the previous
    frame."""
    game = ocjax.load("Pong")
    tape = fixtures.record(game, 24, modes=(0,))
    sources = (game.rem, tape.rams), (game.vem, tape.screens), (game.vem, tape.previous)
    objects = [extract(x).of("Ball") for extract, x in sources]
    balls = [np.asarray(o.xywh)[:, 0].astype(int) for o in objects]
    both = np.logical_and.reduce([np.asarray(o.valid)[:, 0] for o in objects])
    assert both.sum() >= 5
    assert np.array_equal(balls[0][both], balls[1][both])
    step = np.abs(balls[1] - balls[2])[both, :2].max(axis=1)
    assert 1 <= np.median(step) <= 4
    assert step.max() <= 8


def test_samples_are_spread():
    """Samples cycle through the modes, every mode has all seeds and both frame skips, and time
    grows from start to end."""
    settings = [(m, 0) for m in range(3)]
    runs = fixtures.schedule(36, settings, (7, 8))
    assert {(r.mode, r.seed, r.frame_skip) for r in runs} == {
        (m, s, k) for m in range(3) for s in (7, 8) for k in fixtures.FRAME_SKIPS
    }
    samples = sorted(
        (i, r.mode, step * r.frame_skip)
        for r in runs
        for step, numbers in r.samples.items()
        for i in numbers
    )
    assert [i for i, _, _ in samples] == list(range(36))
    assert [m for _, m, _ in samples] == [0, 1, 2] * 12
    frames = np.array([frame for _, _, frame in samples])
    assert frames[0] == 0
    assert frames[-1] > 0.98 * fixtures.FRAMES
    assert np.diff(frames).min() > 0


def test_every_mode_has_a_sample(tmp_path):
    game = ocjax.load("SpaceInvaders")
    modes, difficulties = variants(game)
    assert len(modes) == 16
    assert difficulties == [0, 1]
    runs = fixtures.schedule(max(4, len(modes)), [(m, 0) for m in modes], (0, 1))
    assert {r.mode for r in runs} == set(modes)


def record(*arguments):
    return run_app(command.app, *arguments)


def test_record(short, tmp_path, monkeypatch):
    monkeypatch.setattr(fixtures, "SAMPLES", 6)
    result = record("pong", "samples", "--mode", 0, "--data", tmp_path)
    assert result.exit_code == 0, result.output
    assert "6 samples of Pong, without drawn pixels" in " ".join(result.output.split())
    tape = recordings.read(tmp_path / "Pong.npz")
    assert (len(tape), tape.drawn) == (6, None)
    assert [p.name for p in tmp_path.iterdir()] == ["Pong.npz"]


def test_cut_from_recordings(tape, tmp_path, monkeypatch):
    """Each file gives half of the samples; `drawn` marks the pixels that the chip drew on either
    frame."""
    rng = np.random.default_rng(0)
    shown, previous_shown = rng.integers(0, 2, (2, *tape.screens.shape), np.uint8)
    game = tape.game
    recordings.Recording(
        game, tape.rams, tape.screens, tape.previous, shown, previous_shown, lives=tape.lives
    ).write(tmp_path / "a.npz")
    recordings.Recording(
        game,
        tape.rams[:9],
        tape.screens[:9],
        tape.previous[:9],
        shown[:9],
        previous_shown[:9],
        lives=tape.lives[:9],
    ).write(tmp_path / "b.npz")
    monkeypatch.setattr(fixtures, "SAMPLES", 8)
    args = ("Pong", "samples", "--data", tmp_path)
    result = record(*args, "--from", tmp_path / "a.npz", "--from", tmp_path / "b.npz")
    assert result.exit_code == 0, result.output
    assert "with drawn pixels" in " ".join(result.output.split())
    cut = recordings.read(tmp_path / "Pong.npz")
    pick = [0, 21, 42, 63]
    assert np.array_equal(cut.rams[:4], tape.rams[pick])
    assert np.array_equal(cut.previous[:4], tape.previous[pick])
    assert np.array_equal(cut.drawn[:4], (shown[pick] | previous_shown[pick]) != 0)
    assert set(cut.arrays) == {"rams", "screens", "previous", "drawn", "lives"}
    result = record(*args, "--mode", 0)
    assert result.exit_code == 2
    assert "says what the video chip drew, which a new recording cannot" in " ".join(
        result.output.replace("│", " ").split()
    )
    assert np.array_equal(recordings.read(tmp_path / "Pong.npz").drawn, cut.drawn)


def test_wrong_use_of_record(tape, tmp_path, monkeypatch):
    monkeypatch.setattr(fixtures, "SAMPLES", 65)
    (data := tmp_path / "data").mkdir()
    tape.write(tmp_path / "Pong.npz")
    for args, message in (
        (("Pung",), "did you mean Pong"),
        (
            ("Pong", "sampels"),
            "a part must be samples, ends, modes, limits, edits, expected, got 'sampels'",
        ),
        (("Pong", "samples", "--mode", 99), "Pong has no mode 99"),
        (("Pong", "samples", "--difficulty", 9), "Pong has no difficulty 9"),
        (("Pong", "samples", "--data", tmp_path / "nowhere"), "no folder"),
        (("Pong", "samples", "--from", tmp_path / "no.npz"), "no recording"),
        (
            ("Breakout", "samples", "--from", tmp_path / "Pong.npz"),
            "a recording of Pong, not of Breakout",
        ),
        (
            ("Pong", "samples", "--from", tmp_path / "Pong.npz", "--data", data),
            "cannot cut 65 samples from 64",
        ),
        (("Pong", "samples", "--from", tmp_path / "Pong.npz"), "would replace the input"),
        (
            ("Pong", "samples", "--from", tmp_path / "Pong.npz", "--mode", 0),
            "with --from nothing is",
        ),
    ):
        result = record(*args) if "--data" in args else record(*args, "--data", tmp_path)
        assert result.exit_code == 2, args
        assert message in " ".join(result.output.replace("│", " ").split()), result.output


def test_every_game_has_its_recording():
    missing = [name for name in ocjax.games() if not (DATA / f"{name}.npz").exists()]
    commands = "; ".join(f"python -m tests.support.record {name}" for name in missing)
    assert not missing, f"tests/data lacks recordings: {commands}"
