"""Pools of emulators, and vector environments against ale-py's own environment."""

import dataclasses
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import ale_py
import gymnasium
import numpy as np
import pytest

import ocjax
from ocjax.console import rom_files
from ocjax.emulators import ale, variations
from ocjax.emulators.worker.emulator import Phase
from ocjax.emulators.worker.interface import WorkerConfig
from ocjax.envs import PRESETS, AlePool, RomError, Settings, WorkerError
from tests.support.marks import slow_but

gymnasium.register_envs(ale_py)


@pytest.fixture(scope="module")
def actions():
    return np.random.default_rng(0).integers(6, size=(2000, 5))


def alive(pid):
    """True if a process runs; a zombie does not."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{pid}/stat")
    return not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_episodes_equal_those_of_ale_py(actions):
    """ale-py's environment gives the same RAM, rewards, lives and ends at every step with the same
    seed, across the end of an episode."""
    reference = gymnasium.make("ALE/Breakout-v5", obs_type="ram")
    envs = ocjax.make_vec(_breakout(), 3, mode="raw", num_workers=2)
    want, _ = reference.reset(seed=12)
    observed, _ = envs.reset(seed=11)
    assert np.array_equal(observed[1], want)
    done, ends = False, 0
    for a in actions[:, 0] % 4:
        observed, reward, terminated, truncated, info = envs.step(np.array([0, a, 1]))
        if done:
            want, _ = reference.reset()
            assert (reward[1], terminated[1], truncated[1]) == (0, False, False)
            done = False
        else:
            want, r, done, cut, i = reference.step(a)
            assert (reward[1], terminated[1], truncated[1], info["lives"][1]) == (
                r,
                done,
                cut,
                i["lives"],
            )
        assert np.array_equal(observed[1], want)
        ends += done
    assert ends >= 1
    envs.close()
    reference.close()


@pytest.mark.parametrize("name", ["Berzerk", "DoubleDunk"])
def test_games_that_ale_starts_with_a_button(name):
    """ALE's own frame skip changes the beginning of these games, and ale-py's environment does not
    use it."""
    reference = gymnasium.make(f"ALE/{name}-v5", obs_type="ram", repeat_action_probability=0.0)
    envs = ocjax.make_vec(
        name,
        1,
        mode="raw",
        obs="ram",
        preset="deterministic-v4",
        full_action_space=True,
        num_workers=0,
    )
    observed, want = envs.reset(seed=5)[0][0], reference.reset(seed=5)[0]
    for action in range(18):
        assert np.array_equal(observed, want)
        observed, want = envs.step(np.array([action]))[0][0], reference.step(action)[0]
    envs.close()
    reference.close()


def _breakout():
    """The tests use only the game's ROM, so any game works."""
    return ocjax.load("Breakout") if "Breakout" in ocjax.games() else ocjax.load("Pong")


def test_rows_are_independent(actions):
    """An episode does not depend on the other emulators, the number of workers, or the recording of
    frames."""

    def step(pool, column):
        rams = []
        for a in actions[:60]:
            pool.send(a[column])
            pool.wait()
            rams.append(pool.ram.copy())
        pool.close()
        return np.stack(rams)

    game = ocjax.load("Pong")
    together = AlePool(game, 5, num_workers=2)
    together.reset([3, 4, 5, 6, 7])
    whole = step(together, slice(None))
    for i in (0, 3):
        alone = AlePool(game, 1, screens=("screen",), num_workers=min(i, 1))
        alone.reset([3 + i])
        assert np.array_equal(step(alone, slice(i, i + 1))[:, 0], whole[:, i])


def test_screens_are_the_last_two_emulated_frames(actions):
    game = ocjax.load("Pong")
    pool = AlePool(
        game, 2, Settings(repeat_action_probability=0), screens=("screen",), num_workers=1
    )
    pool.reset([0, 0])
    ale = ale_py.ALEInterface()
    ale.setFloat("repeat_action_probability", 0)
    ale.loadROM(ale_py.roms.get_rom_path("pong"))
    ale.reset_game()
    assert np.array_equal(pool.screen[0, 1], ale.getScreen())
    for a in actions[:40, 0]:
        pool.send(np.array([a, 0]))
        pool.wait()
        frames = []
        for _ in range(4):
            ale.act(pool.actions[a])
            frames.append(ale.getScreen())
        assert np.array_equal(pool.screen[0], frames[-2:])
    pool.close()


@pytest.mark.parametrize("skip", [1, 4, (1, 3)])
def test_pooled_frames_are_the_brighter_of_the_last_two_of_a_step(actions, skip):
    """The rule also holds directly after `restore_state` and at the beginning of an episode.

    Steps of one frame show that frame.
    """
    most = 25 * np.max(skip).item()
    settings = Settings(frame_skip=skip, repeat_action_probability=0.0, max_episode_frames=most)
    pool = AlePool(
        ocjax.load("Asteroids"), 2, settings, screens=("screen", "pooled"), num_workers=1
    )  # objects flicker
    shades = np.round(pool.game.palette @ [0.2989, 0.587, 0.114]).astype(
        np.uint8
    )  # as ALE converts colours

    def check():
        frames = shades[pool.screen]
        assert np.array_equal(pool.gray[:, 0], frames[:, 1])
        pooled = pool.started | (pool.frame_number - last > 1)
        brighter = np.where(pooled[:, None, None], frames.max(axis=1), frames[:, 1])
        assert np.array_equal(pool.pooled[:, 0], brighter)
        return (frames[:, 0] != frames[:, 1]).any()

    last = np.zeros(2, int)
    pool.reset([0, 1])
    check()
    saved, saved_last, changed = None, last, 0
    for k, row in enumerate(actions[:60, :2]):
        if k == 20:
            saved, saved_last = pool.clone_state(), last
        if k == 40:
            pool.restore_state(saved)
            last = saved_last
            check()
        last = pool.frame_number.copy()
        pool.send(row % len(pool.actions))
        pool.wait()
        changed += check()
    assert changed > 20
    pool.close()


@pytest.mark.parametrize("mode", slow_but(["rem", "both"], ["rem", "vem", "both", "raw"]))
def test_vector_env(mode, actions):
    envs = ocjax.make_vec("Pong", 5, mode=mode)
    assert isinstance(envs, gymnasium.vector.VectorEnv)
    assert envs.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    observed, info = envs.reset(seed=1)
    assert observed in envs.observation_space
    for a in actions[:5]:
        observed, reward, terminated, truncated, info = envs.step(a)
        assert observed in envs.observation_space
        assert reward.shape == terminated.shape == truncated.shape == info["lives"].shape == (5,)
    if mode == "rem":
        o = envs.game.rem(np.array(envs.pool.ram))
        assert np.array_equal(observed["xywh"], o.xywh)
        assert np.array_equal(observed["value"], o.value)
    if mode == "both":
        assert np.array_equal(
            observed["vem"]["xywh"], envs.game.vem(np.array(envs.pool.screen[:, 1])).xywh
        )
    copy = observed["rem"]["xywh"].copy() if mode == "both" else None
    envs.step(actions[9])
    if copy is not None:
        assert np.array_equal(copy, observed["rem"]["xywh"]), (
            "later steps must not change an observation"
        )
    envs.close()
    envs.close()


def test_seeds_and_partial_resets(actions):
    envs = ocjax.make_vec("Pong", 5, mode="raw")
    first = envs.reset(seed=[1, 2, 1, 2, 1])[0]
    assert np.array_equal(first[0], first[2])
    for a in actions[:150, :1]:
        observed = envs.step(np.repeat(a, 5))[0]
    assert np.array_equal(observed[0], observed[2])
    assert np.array_equal(observed[1], observed[3])
    assert not np.array_equal(observed[0], observed[1]), "sticky actions depend on the seed"
    mask = np.array([True, False, False, False, True])
    after = envs.reset(options={"reset_mask": mask})[0]
    assert np.array_equal(after[1:4], observed[1:4])
    assert np.array_equal(after[0], first[0])
    envs.close()


def test_wrong_arguments_are_refused():
    for kwargs, message in (
        ({"mode": "pixels"}, "mode must be one of"),
        ({"frame_skip": 0}, "at least 1"),
        ({"num_workers": -1}, "num_workers"),
        ({"repeat_action_probability": 1.5}, "repeat_action_probability"),
        ({"game_mode": 77}, "Pong has no mode 77; it has"),
    ):
        with pytest.raises(ValueError, match=message):
            ocjax.make_vec("Pong", 2, **kwargs)
    with pytest.raises(ocjax.errors.UnknownGameError):
        ocjax.make_vec("Pung", 2)
    envs = ocjax.make_vec("Pong", 2, mode="raw")
    for seed in (-1, [1], [1, 2, 3]):
        with pytest.raises(ValueError, match="seed must be"):
            envs.reset(seed=seed)
    for options, message in (
        ({"mask": 1}, "unknown options"),
        ({"reset_mask": np.ones(3, bool)}, "reset_mask must be"),
    ):
        with pytest.raises(ValueError, match=message):
            envs.reset(options=options)
    envs.reset(seed=0)
    for wrong in (np.zeros(3, int), np.zeros(2), np.array([0, 99]), np.array([-1, 0])):
        with pytest.raises(ValueError, match="actions must be"):
            envs.step(wrong)
    envs.close()
    with pytest.raises(WorkerError, match="closed"):
        envs.step(np.zeros(2, int))


def test_wrong_and_missing_roms_are_refused(tmp_path, monkeypatch):
    """Environments check the file that they load, from any source; `read_rom` returns the contents
    of the right one."""
    game = ocjax.load("Pong")
    installed = rom_files.rom_path("pong")
    assert installed == ale_py.roms.get_rom_path("pong")
    assert rom_files.read_rom("pong", game.md5) == installed.read_bytes()
    monkeypatch.setenv("ALE_ROMS_DIR", str(tmp_path))
    with pytest.raises(
        RomError, match=r"expected the ROM 'pong' at .*pong\.bin, which does not exist: install"
    ):
        ocjax.make_vec("Pong", 1)
    (tmp_path / "pong.bin").write_bytes(b"not Pong")
    with pytest.raises(
        RomError,
        match=r"expected the ROM 'pong' with md5 60e0ea3c.* has md5 [0-9a-f]{32}: reinstall",
    ):
        ocjax.make_vec("Pong", 1)
    monkeypatch.setattr(rom_files.importlib.util, "find_spec", lambda name: None)
    monkeypatch.delenv("ALE_ROMS_DIR")
    with pytest.raises(RomError, match="ale-py, which is not installed"):
        rom_files.rom_path("pong")


def test_roms_are_found_without_importing_ale_py():
    code = (
        "import sys; from ocjax.console import rom_files; "
        "print(rom_files.rom_path('pong').name, 'ale_py' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["pong.bin", "False"]


def test_killed_worker_is_reported():
    pool = AlePool(ocjax.load("Pong"), 4, num_workers=2)
    pool.reset([0] * 4)
    pids = [w.process.pid for w in pool._workers]
    os.kill(pids[1], signal.SIGKILL)
    with pytest.raises(WorkerError, match="environments 2-3 was killed by SIGKILL"):
        pool.send(np.zeros(4, int))
        pool.wait()
    assert pool.closed
    assert not any(alive(p) for p in pids)


def test_failing_worker_is_reported():
    def broken(ram):
        raise IndexError("no such byte")

    pool = AlePool(ocjax.load("Pong"), 2, num_workers=1, hook=broken)
    pool.reset([0, 0])
    pool.send(np.zeros(2, int))
    with pytest.raises(
        WorkerError,
        match=(
            r"environments 0-1 failed:[\s\S]*the hook tests\.envs\.test_envs\.\S*broken failed "
            r"in environment 0: IndexError"
        ),
    ):
        pool.wait()
    assert pool.closed


@pytest.mark.parametrize("how", slow_but([signal.SIGKILL], [signal.SIGINT, signal.SIGKILL, None]))
def test_workers_do_not_outlive_their_parent(how):
    """No worker and no shared memory remains after the parent is interrupted, is killed, or ends
    without close()."""
    code = textwrap.dedent("""
        import signal, sys, time, numpy as np, ocjax
        # A shell that runs the tests in its background ignores the signal.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        from ocjax.envs import AlePool
        pool = AlePool(ocjax.load("Pong"), 4, num_workers=2)
        pool.reset([0] * 4)
        print(*(w.process.pid for w in pool._workers), flush=True)
        while len(sys.argv) == 1:
            pool.send(np.zeros(4, int)); pool.wait()
    """)
    before = set(Path("/dev/shm").iterdir())
    command = [sys.executable, "-c", code, *(["end"] if how is None else [])]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as parent:
        pids = [int(p) for p in parent.stdout.readline().split()]
        assert len(pids) == 2
        if how is not None:
            time.sleep(0.3)
            parent.send_signal(how)
        _, errors = parent.communicate(timeout=20)
    if how == signal.SIGINT:
        assert errors.strip().endswith("KeyboardInterrupt")
    if how is None:
        assert errors == ""
    deadline = time.monotonic() + 5
    while any(alive(p) for p in pids) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(alive(p) for p in pids)
    assert set(Path("/dev/shm").iterdir()) <= before


@pytest.mark.parametrize("sticky", slow_but([0.25], [0.0, 0.25]))
def test_states_are_saved_and_restored(actions, sticky):
    """From a restored state the same actions give the same RAM, frames and rewards.

    Emulators outside the mask do not change.
    """
    settings = Settings(repeat_action_probability=sticky)
    pool = AlePool(
        ocjax.load("Breakout"), 4, settings, screens=("screen", "pooled", "rgb"), num_workers=2
    )
    names = (
        "ram",
        "screen",
        "gray",
        "pooled",
        "rgb",
        "reward",
        "lives",
        "frame_number",
        "episode_return",
        "episode_length",
    )

    def snapshot():
        return {name: getattr(pool, name).copy() for name in names}

    def step(some):
        out = []
        for a in some:
            pool.send(a % len(pool.actions))
            pool.wait()
            out.append(snapshot())
        return out

    def same(a, b, which=slice(None)):
        return all(np.array_equal(a[name][which], b[name][which]) for name in names)

    pool.reset([0, 1, 2, 3])
    step(actions[:100, :4])
    saved, before = pool.clone_state(), snapshot()
    first = step(actions[100:160, :4])
    pool.restore_state(saved)
    assert same(snapshot(), before)
    again = step(actions[100:160, :4])
    assert all(same(a, b) for a, b in zip(first, again, strict=True))
    late, some = snapshot(), np.array([True, False, False, True])
    pool.restore_state(pickle.loads(pickle.dumps(saved)), some)
    assert same(snapshot(), before, some)
    assert same(snapshot(), late, ~some)
    pool.restore_state(saved[2])
    assert np.array_equal(pool.ram, np.repeat(before["ram"][2:3], 4, axis=0))
    other = AlePool(
        ocjax.load("Breakout"), 4, settings, screens=("screen", "pooled", "rgb"), num_workers=0
    )
    other.restore_state(saved)  # this pool has never been reset
    other.send(actions[100, :4] % len(pool.actions))
    assert np.array_equal(other.ram, first[0]["ram"])
    assert np.array_equal(other.screen, first[0]["screen"])
    with pytest.raises(ValueError, match="must be 1 or 4 states"):
        pool.restore_state(saved[:3])
    with pytest.raises(ValueError, match="are of the ROM with md5"):
        AlePool(ocjax.load("Pong"), 4, num_workers=0).restore_state(saved)
    with pytest.raises(ValueError, match="saved without rgb"):
        pool.restore_state(
            dataclasses.replace(saved, rows={k: v for k, v in saved.rows.items() if k != "rgb"})
        )
    pool.close()


@pytest.mark.parametrize("settings", [Settings(max_episode_frames=120), PRESETS["dqn"]])
def test_preparing_the_next_game_changes_nothing(settings, actions):
    """Workers begin the next game while the pool does not wait for them.

    The results without workers are the same.
    """
    names = (
        "ram",
        "screen",
        "lives",
        "frame_number",
        "episode_return",
        "episode_length",
        "terminated",
        "truncated",
        "started",
    )
    histories = []
    for workers in (2, 0):
        pool = AlePool(
            ocjax.load("Breakout"),
            2,
            dataclasses.replace(settings, noop_max=5),
            screens=("screen",),
            num_workers=workers,
        )
        pool.reset([7, 8])
        history, saved = [], None

        def record(pool=pool, history=history):
            history.append({name: getattr(pool, name).copy() for name in names})

        for a in actions[:300, :2]:
            pool.send(a % len(pool.actions))
            pool.wait()
            record()
            if (pool.terminated | pool.truncated).any():
                time.sleep(0.02 * workers)  # long enough to begin the next game
                record()
                saved = pool.clone_state()
                pool.set_ram(255 - pool.ram, pool.truncated | (pool.terminated & (pool.lives == 0)))
                record()
        assert saved is not None
        pool.restore_state(saved)
        record()
        for a in actions[300:360, :2]:
            pool.send(a % len(pool.actions))
            pool.wait()
            record()
        pool.close()
        histories.append(history)
    assert len(histories[0]) == len(histories[1]) > 370
    for with_workers, without in zip(*histories, strict=True):
        for name, value in with_workers.items():
            assert np.array_equal(value, without[name]), name


def test_ram_can_be_written():
    pool = AlePool(
        ocjax.load("Pong"),
        3,
        Settings(repeat_action_probability=0),
        screens=("screen",),
        num_workers=2,
    )
    pool.reset([0, 0, 0])
    ram = pool.ram.copy()
    ram[:, 14] = 5, 6, 7  # the player's points
    pool.set_ram(ram, np.array([True, False, True]))
    assert pool.ram[:, 14].tolist() == [5, 0, 7]
    for _ in range(2):
        pool.send(np.zeros(3, int))
        pool.wait()
    vem = pool.game.vem(pool.screen[:, 1])
    assert np.asarray(vem.of("PlayerScore").value)[:, 0].tolist() == [5, 0, 7]
    pool.set_ram(ram[0])
    assert (pool.ram == ram[0]).all()
    for wrong, error in (
        (ram.astype(int), TypeError),
        (ram[:2], ValueError),
        (ram[0].tolist(), TypeError),
    ):
        with pytest.raises(error, match="ram must"):
            pool.set_ram(wrong)
    pool.close()


@pytest.mark.parametrize("workers", [0, 2])
def test_games_start_with_written_ram(workers):
    points = variations.Variation("Pong", "The player has 5 points.", {14: 5})
    settings, starts = Settings(max_episode_frames=40, noop_max=8), [points, None, points]
    pool = AlePool(
        ocjax.load("Pong"), 3, settings, screens=("screen",), num_workers=workers, starts=starts
    )
    pool.reset([0, 1, 2])
    games = 0
    for _ in range(25):
        if pool.started.any():
            assert pool.ram[:, 14].tolist() == [5, 0, 5]
            games += pool.started.sum()
        pool.send(np.zeros(3, int))
        pool.wait()
    assert games >= 6
    vem = pool.game.vem(pool.screen[:, 1])
    assert np.asarray(vem.of("PlayerScore").value)[:, 0].tolist() == [5, 0, 5]
    pool.close()
    with pytest.raises(ValueError, match="starts must have one entry per environment, 3, got 2"):
        AlePool(ocjax.load("Pong"), 3, starts=starts[:2])
    with pytest.raises(ValueError, match="is a variation of Riverraid"):
        AlePool(ocjax.load("Pong"), 1, starts=[variations.find("Riverraid:red_river")])


@pytest.mark.parametrize("workers", [0, 2])
def test_stepping_past_an_end_is_an_error_without_autoreset(workers):
    pool = AlePool(
        ocjax.load("Pong"),
        2,
        Settings(max_episode_frames=40),
        autoreset="disabled",
        num_workers=workers,
    )
    pool.reset([0, 0])
    with pytest.raises(
        (WorkerError, RuntimeError), match=r"the episodes of environments \[.*\] have ended: reset"
    ):
        for _ in range(20):
            pool.send(np.zeros(2, int))
            pool.wait()
    assert pool.truncated.all(), "the limit of 40 frames was reached first"
    assert pool.closed


def test_phases():
    pool = AlePool(ocjax.load("Breakout"), 1, PRESETS["dqn"], num_workers=0)
    emulator = pool._local.emulators[0]
    assert emulator.phase is Phase.UNLOADED
    pool.reset([1])
    assert emulator.phase is Phase.RUNNING
    phases = []
    for a in np.random.default_rng(0).integers(4, size=2_000):
        pool.send(np.array([a]))
        ended, over = bool(pool.terminated[0]), emulator.ale.game_over()
        assert emulator.phase is (
            Phase.RUNNING if not ended else Phase.GAME_OVER if over else Phase.LIFE_LOST
        )
        phases.append(emulator.phase)
        if emulator.phase is Phase.GAME_OVER:
            break
    assert phases.count(Phase.LIFE_LOST) == 4
    ram = pool.ram.copy()
    emulator.prepare_next()
    assert emulator.phase is Phase.NEXT_READY
    assert np.array_equal(pool.ram, ram), "the end of the game is still shown"
    pool.send(np.array([0]))
    assert emulator.phase is Phase.RUNNING
    assert pool.started.all()
    pool.close()


@pytest.mark.parametrize("workers", [0, 1])
def test_a_restored_end_starts_the_next_episode_with_same_step_autoreset(workers):
    """The restored end of an episode comes from a pool with next-step autoreset."""
    game, settings = ocjax.load("Pong"), Settings(max_episode_frames=40)
    source = AlePool(game, 1, settings, num_workers=0)
    source.reset([0])
    while not source.truncated[0]:
        source.send(np.zeros(1, int))
    pool = AlePool(game, 1, settings, autoreset="same step", num_workers=workers)
    pool.restore_state(source.clone_state())
    assert (pool.truncated[0], pool.started[0], pool.episode_length[0]) == (True, False, 10)
    time.sleep(0.05 * workers)  # long enough to begin the next game
    for length in range(3):
        pool.send(np.zeros(1, int))
        pool.wait()
        assert (pool.truncated[0], pool.started[0], pool.episode_length[0]) == (
            False,
            length == 0,
            length,
        )
    pool.close()


def test_the_start_of_emulators_is_reported(monkeypatch):
    monkeypatch.setattr(ale, "_SLOW_START", 0.001)
    monkeypatch.setattr(ale, "_REPORT_EVERY", 0.001)
    pool, reports = AlePool(ocjax.load("Pong"), 6, num_workers=2), []
    pool.reset([0] * 6, report=reports.append)
    assert len(set(reports)) > 1
    assert reports == sorted(reports)
    assert set(reports) <= set(range(7))
    pool.close()


def test_workers_import_neither_ocjax_nor_jax():
    """The hook runs in a worker and reports the imported modules."""

    def report(ram):
        raise ArithmeticError(sorted({"ale_py", "jax", "ocjax"} & set(sys.modules)))

    pool = AlePool(ocjax.load("Pong"), 1, hook=report, num_workers=1)
    pool.reset([0])
    pool.send(np.zeros(1, int))
    with pytest.raises(WorkerError, match=r"ArithmeticError: \['ale_py'\]"):
        pool.wait()


def test_worker_configuration_survives_json():
    pool = AlePool(
        ocjax.load("Pong"),
        3,
        Settings(frame_skip=(2, 5)),
        num_workers=0,
        screens=("gray",),
        game_mode=[0, None, 1],
    )
    config = pool._local.emulators[0].config
    assert WorkerConfig.from_json(config.to_json()) == config
    assert config.game_modes == (0, None, 1)
    assert config.frame_skip == (2, 5)
    pool.close()


def test_arrays_that_are_not_recorded_are_refused():
    pool = AlePool(ocjax.load("Pong"), 1, num_workers=0, screens=("gray",))
    assert pool.gray.shape == (1, 1, 210, 160)
    assert pool.arrays.final is None
    for name in ("screen", "pooled", "rgb"):
        with pytest.raises(ValueError, match=f"does not record '{name}': request it with screens"):
            getattr(pool, name)
    pool.close()
