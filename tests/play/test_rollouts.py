import itertools
import json

import numpy as np
import pytest

import ocjax
from ocjax.envs import AlePool, settings
from ocjax.play import policies, rollouts
from ocjax.play.stepping import steps
from tests.support.states import ROOT

PONG = ocjax.load("Pong")
SCORES = json.loads((ROOT / "docs" / "scoreboard.json").read_text("utf-8"))
GAMES_PLAYED = 20


def documented():
    """Mean and standard error of the returns of each policy that ships, by its game."""
    games = SCORES["protocol"]["games"]
    return {
        row["game"]: (row["mean"], row["deviation"] / games**0.5)
        for row in SCORES["rows"]
        if row["agent"] == "ocjax"
    }


def test_all_policies_are_documented():
    assert documented().keys() == {path.stem for path in policies.SHIPPED.glob("*.npz")}


@pytest.mark.slow
@pytest.mark.parametrize("name", documented())
def test_trained_play_reaches_the_documented_return(name):
    mean, error = documented()[name]
    tape = rollouts.rollout(
        ocjax.load(name), 2 * GAMES_PLAYED, policy="trained", seed=2000, num_envs=GAMES_PLAYED
    )
    returns = tape.rewards.reshape(GAMES_PLAYED, 2)[:, -1]  # at the ends of games
    assert tape.ends.reshape(GAMES_PLAYED, 2)[:, -1].all()
    own_error = returns.std(ddof=1) / GAMES_PLAYED**0.5
    assert abs(returns.mean() - mean) <= 3 * np.hypot(error, own_error)


def test_settings_of_the_policy():
    own = policies.needs("trained", PONG).settings
    tape = rollouts.rollout(PONG, 4, policy="trained", num_envs=2, whole_games=False)
    assert own.fire_reset
    assert own.episodic_life
    assert tape.settings == own.to_dict() | {"clip_rewards": False}
    assert tape.frame_skip == own.frame_skip
    other = rollouts.rollout(
        PONG,
        4,
        policy="trained",
        num_envs=2,
        whole_games=False,
        frame_skip=2,
        repeat_action_probability=0.25,
    )
    assert other.settings == tape.settings | {"frame_skip": 2, "repeat_action_probability": 0.25}
    random = rollouts.rollout(PONG, 4, num_envs=2)
    assert random.settings == rollouts.DEFAULT.to_dict()


@pytest.mark.parametrize(
    ("count", "lengths"), [(1, [5]), (4, [3, 2, 7]), (10, [10]), (10, [9, 30])]
)
def test_sample_of_complete_games(count, lengths):
    states = [(game, t == n - 1) for game, n in enumerate(lengths) for t in range(n)]
    counts = np.zeros(len(states))
    for seed in range(400):
        sampler = rollouts._Sampler(count, np.random.default_rng(seed))
        for t, (_, last) in enumerate(states):
            assert not sampler.complete
            sampler.add(lambda t=t: {"t": t}, last=last)
            if sampler.complete:
                break
        kept = [state["t"] for state in sampler.states]
        counts[kept] += 1
        assert len(kept) == count
        assert kept == sorted(set(kept))
        assert states[kept[-1]][1]
        games = [states[t][0] for t in kept]
        assert [state["resets"] for state in sampler.states] == [
            g not in games[:i] for i, g in enumerate(games)
        ]
    played = np.flatnonzero(counts)[-1]
    expected = 400 * (count - 1) / max(played, 1)
    assert (abs(counts[:played] - expected) <= 5 * expected**0.5).all()


def test_fire_after_a_lost_life():
    """The ball is soon back in play, even if the policy never presses FIRE."""
    game = ocjax.load("Breakout")
    pool = AlePool(game, 2, settings("dqn", episodic_life=False), num_workers=0)
    pool.reset([0, 1])
    rams, lives = [], []
    for _ in itertools.islice(steps(pool, lambda seen: np.zeros(2, int)), 300):
        rams.append(pool.ram.copy())
        lives.append(pool.lives.copy())
    pool.close()
    ball = np.asarray(game.rem(np.array(rams)).of("Ball").valid)[..., 0]
    assert (np.min(lives, axis=0) < 3).all()
    gaps = "".join("-" if valid else "." for valid in ball[:, 0]).split("-")
    assert max(map(len, gaps)) <= 15  # agent steps in a second
