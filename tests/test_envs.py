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
from ocjax.envs import PRESETS, AlePool, Protocol, RomError, WorkerError

gymnasium.register_envs(ale_py)


@pytest.fixture(scope="module")
def actions():
    return np.random.default_rng(0).integers(6, size=(2000, 5))


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{pid}/stat")
    return not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_same_episodes_as_ale_py(actions):
    """RAM, rewards, lives and ends of every step are those of ale-py's own environment with the same seed, through an episode's end."""
    reference = gymnasium.make("ALE/Breakout-v5", obs_type="ram")
    envs = ocjax.make_vec(_breakout(), 3, mode="raw", num_workers=2)
    want, _ = reference.reset(seed=12)
    seen, _ = envs.reset(seed=11)
    assert np.array_equal(seen[1], want)
    done, ends = False, 0
    for a in actions[:, 0] % 4:
        seen, reward, terminated, truncated, info = envs.step(np.array([0, a, 1]))
        if done:
            want, _ = reference.reset()
            assert (reward[1], terminated[1], truncated[1]) == (0, False, False)
            done = False
        else:
            want, r, done, cut, i = reference.step(a)
            assert (reward[1], terminated[1], truncated[1], info["lives"][1]) == (r, done, cut, i["lives"])
        assert np.array_equal(seen[1], want)
        ends += done
    assert ends >= 1
    envs.close()
    reference.close()


def _breakout():
    """Any game will do: only its ROM is run."""
    return ocjax.load("Breakout") if "Breakout" in ocjax.games() else ocjax.load("Pong")


def test_batch_is_its_rows(actions):
    """An environment's episode does not depend on its neighbours, on the number of workers, or on frames being taken."""

    def play(pool, column):
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
    whole = play(together, slice(None))
    for i in (0, 3):
        alone = AlePool(game, 1, screens=("screen",))
        alone.reset([3 + i])
        assert np.array_equal(play(alone, slice(i, i + 1))[:, 0], whole[:, i])


def test_screens_are_the_last_two_frames(actions):
    game = ocjax.load("Pong")
    pool = AlePool(game, 2, Protocol(repeat_action_probability=0), screens=("screen",), num_workers=1)
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


@pytest.mark.parametrize("mode", ["rem", "vem", "both", "raw"])
def test_vector_env(mode, actions):
    envs = ocjax.make_vec("Pong", 5, mode=mode)
    assert isinstance(envs, gymnasium.vector.VectorEnv)
    assert envs.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    seen, info = envs.reset(seed=1)
    assert seen in envs.observation_space
    for a in actions[:5]:
        seen, reward, terminated, truncated, info = envs.step(a)
        assert seen in envs.observation_space
        assert reward.shape == terminated.shape == truncated.shape == info["lives"].shape == (5,)
    if mode == "rem":
        o = envs.game.rem(np.array(envs.pool.ram))
        assert np.array_equal(seen["xywh"], o.xywh)
        assert np.array_equal(seen["value"], o.value)
    if mode == "both":
        assert np.array_equal(seen["vem"]["xywh"], envs.game.vem(np.array(envs.pool.screen[:, 1])).xywh)
    kept = seen["rem"]["xywh"].copy() if mode == "both" else None
    envs.step(actions[9])
    if kept is not None:
        assert np.array_equal(kept, seen["rem"]["xywh"]), "an observation must not change afterwards"
    envs.close()
    envs.close()


def test_seeds_and_partial_resets(actions):
    envs = ocjax.make_vec("Pong", 5, mode="raw")
    first = envs.reset(seed=[1, 2, 1, 2, 1])[0]
    assert np.array_equal(first[0], first[2])
    for a in actions[:150, :1]:
        seen = envs.step(np.repeat(a, 5))[0]
    assert np.array_equal(seen[0], seen[2])
    assert np.array_equal(seen[1], seen[3])
    assert not np.array_equal(seen[0], seen[1]), "sticky actions depend on the seed"
    mask = np.array([True, False, False, False, True])
    after = envs.reset(options={"reset_mask": mask})[0]
    assert np.array_equal(after[1:4], seen[1:4])
    assert np.array_equal(after[0], first[0])
    envs.close()


def test_wrong_arguments():
    for kwargs, message in (
        ({"mode": "pixels"}, "mode must be one of"),
        ({"frame_skip": 0}, "at least 1"),
        ({"num_workers": -1}, "num_workers"),
        ({"repeat_action_probability": 1.5}, "repeat_action_probability"),
        ({"game_mode": 77}, "Pong has no mode 77; it has"),
    ):
        with pytest.raises(ValueError, match=message):
            ocjax.make_vec("Pong", 2, **kwargs)
    with pytest.raises(ocjax.UnknownGameError):
        ocjax.make_vec("Pung", 2)
    envs = ocjax.make_vec("Pong", 2, mode="raw")
    for seed in (-1, [1], [1, 2, 3]):
        with pytest.raises(ValueError, match="seed must be"):
            envs.reset(seed=seed)
    for options, message in (({"mask": 1}, "unknown options"), ({"reset_mask": np.ones(3, bool)}, "reset_mask must be")):
        with pytest.raises(ValueError, match=message):
            envs.reset(options=options)
    envs.reset(seed=0)
    for wrong in (np.zeros(3, int), np.zeros(2), np.array([0, 99]), np.array([-1, 0])):
        with pytest.raises(ValueError, match="actions must be"):
            envs.step(wrong)
    envs.close()
    with pytest.raises(WorkerError, match="closed"):
        envs.step(np.zeros(2, int))


def test_other_rom_is_refused(tmp_path, monkeypatch):
    other = tmp_path / "pong.bin"
    other.write_bytes(b"not Pong")
    monkeypatch.setattr(ale_py.roms, "get_rom_path", lambda name: other)
    with pytest.raises(RomError, match="was written for the ROM with md5 60e0ea3c"):
        ocjax.make_vec("Pong", 1)


def test_killed_worker_is_reported():
    pool = AlePool(ocjax.load("Pong"), 4, num_workers=2)
    pool.reset([0] * 4)
    pids = [w.process.pid for w in pool._workers]
    os.kill(pids[1], signal.SIGKILL)
    start = time.monotonic()
    with pytest.raises(WorkerError, match="environments 2-3 was killed by SIGKILL"):
        pool.send(np.zeros(4, int))
        pool.wait()
    assert time.monotonic() - start < 1
    assert pool.closed
    assert not any(alive(p) for p in pids)


def test_failing_worker_is_reported():
    pool = AlePool(ocjax.load("Pong"), 2, num_workers=1)
    pool.reset([0, 0])
    pool.send(np.array([0, 1_000]))  # past the environment's own check
    with pytest.raises(WorkerError, match=r"environments 0-1 failed:[\s\S]*IndexError"):
        pool.wait()
    assert pool.closed


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL, None])
def test_workers_do_not_outlive_their_parent(how):
    """Interrupted, killed, or ended without close(): no worker and no shared memory stays behind."""
    code = textwrap.dedent("""
        import signal, sys, time, numpy as np, ocjax
        signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run in a shell's background
        from ocjax.envs import AlePool
        pool = AlePool(ocjax.load("Pong"), 4, num_workers=2)
        pool.reset([0] * 4)
        print(*(w.process.pid for w in pool._workers), flush=True)
        while len(sys.argv) == 1:
            pool.send(np.zeros(4, int)); pool.wait()
    """)
    before = set(Path("/dev/shm").iterdir())
    command = [sys.executable, "-c", code, *(["end"] if how is None else [])]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as parent:
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


@pytest.mark.parametrize("sticky", [0.0, 0.25])
def test_states_are_kept_and_restored(actions, sticky):
    """The same actions from a restored state give the same RAM, frames and rewards, from the first frame on; others stay as they are."""
    protocol = Protocol(repeat_action_probability=sticky)
    pool = AlePool(ocjax.load("Breakout"), 4, protocol, screens=("screen", "gray", "rgb"), num_workers=2)
    names = ("ram", "screen", "gray", "rgb", "reward", "lives", "frame_number", "episode_return", "episode_length")

    def now():
        return {name: getattr(pool, name).copy() for name in names}

    def play(some):
        out = []
        for a in some:
            pool.send(a % len(pool.actions))
            pool.wait()
            out.append(now())
        return out

    def same(a, b, which=slice(None)):
        return all(np.array_equal(a[name][which], b[name][which]) for name in names)

    pool.reset([0, 1, 2, 3])
    play(actions[:100, :4])
    saved, kept = pool.clone_state(), now()
    first = play(actions[100:160, :4])
    pool.restore_state(saved)
    assert same(now(), kept)
    again = play(actions[100:160, :4])
    assert all(same(a, b) for a, b in zip(first, again, strict=True))
    late, some = now(), np.array([True, False, False, True])
    pool.restore_state(pickle.loads(pickle.dumps(saved)), some)
    assert same(now(), kept, some)
    assert same(now(), late, ~some)
    pool.restore_state(saved[2])
    assert np.array_equal(pool.ram, np.repeat(kept["ram"][2:3], 4, axis=0))
    other = AlePool(ocjax.load("Breakout"), 4, protocol, screens=("screen", "gray", "rgb"), num_workers=0)
    other.restore_state(saved)  # a pool that was never reset
    other.send(actions[100, :4] % len(pool.actions))
    assert np.array_equal(other.ram, first[0]["ram"])
    assert np.array_equal(other.screen, first[0]["screen"])
    with pytest.raises(ValueError, match="must be 1 or 4 states"):
        pool.restore_state(saved[:3])
    with pytest.raises(ValueError, match="are of the ROM with md5"):
        AlePool(ocjax.load("Pong"), 4, num_workers=0).restore_state(saved)
    with pytest.raises(ValueError, match="saved without rgb"):
        pool.restore_state(dataclasses.replace(saved, rows={k: v for k, v in saved.rows.items() if k != "rgb"}))
    pool.close()


@pytest.mark.parametrize("protocol", [Protocol(max_episode_frames=120), PRESETS["dqn"]])
def test_next_games_are_prepared_unseen(protocol, actions):
    """Workers begin the next game while nobody waits: what is shown, written, saved and played is as without that."""
    names = ("ram", "screen", "lives", "frame_number", "episode_return", "episode_length", "terminated", "truncated", "started")
    stories = []
    for workers in (2, 0):
        pool = AlePool(ocjax.load("Breakout"), 2, dataclasses.replace(protocol, noop_max=5), screens=("screen",), num_workers=workers)
        pool.reset([7, 8])
        story, saved = [], None

        def tell(pool=pool, story=story):
            story.append({name: getattr(pool, name).copy() for name in names})

        for a in actions[:300, :2]:
            pool.send(a % len(pool.actions))
            pool.wait()
            tell()
            if (pool.terminated | pool.truncated).any():
                time.sleep(0.02 * workers)  # long enough to prepare
                tell()
                saved = pool.clone_state()
                pool.set_ram(255 - pool.ram, pool.truncated | (pool.terminated & (pool.lives == 0)))
                tell()
        assert saved is not None
        pool.restore_state(saved)
        tell()
        for a in actions[300:360, :2]:
            pool.send(a % len(pool.actions))
            pool.wait()
            tell()
        pool.close()
        stories.append(story)
    assert len(stories[0]) == len(stories[1]) > 370
    for with_workers, without in zip(*stories, strict=True):
        for name, value in with_workers.items():
            assert np.array_equal(value, without[name]), name


def test_ram_is_written():
    pool = AlePool(ocjax.load("Pong"), 3, Protocol(repeat_action_probability=0), screens=("screen",), num_workers=2)
    pool.reset([0, 0, 0])
    ram = pool.ram.copy()
    ram[:, 14] = 5, 6, 7  # the player's points
    pool.set_ram(ram, np.array([True, False, True]))
    assert pool.ram[:, 14].tolist() == [5, 0, 7]
    for _ in range(2):
        pool.send(np.zeros(3, int))
        pool.wait()
    vem = pool.game.vem(pool.screen[:, 1])
    assert np.asarray(vem.of(pool.game, "PlayerScore").value)[:, 0].tolist() == [5, 0, 7]
    pool.set_ram(ram[0])
    assert (pool.ram == ram[0]).all()
    for wrong, error in ((ram.astype(int), TypeError), (ram[:2], ValueError), (ram[0].tolist(), TypeError)):
        with pytest.raises(error, match="ram must"):
            pool.set_ram(wrong)
    pool.close()
