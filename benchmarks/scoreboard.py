"""Let agents play complete games, and write the scoreboard.

    python benchmarks/scoreboard.py [GAME ...] [--variations]
    python benchmarks/scoreboard.py GAME --policy FILE --agent NAME [--seeds N]

Without games, all games with a shipped agent are played; the others keep their rows. `--policy`
plays a saved policy instead, and adds its row under the agent's name. `--variations` only measures
the drops of the mean returns under the variations of each game. Each game's results are written to
docs/scoreboard.json and docs/scoreboard.md at once.

The protocol: 30 complete games with seeds from 1000, frame skip 4, 1 to 30 no-op frames at the
start, at most 108,000 emulated frames; without sticky actions and, in a second column, with them
(p = 0.25).
"""

import argparse
import dataclasses
import sys

import _scores
import jax
import numpy as np
from _scores import GAMES, OWN, SEED, STICKY, Row

import ocjax
from ocjax.emulators import variations
from ocjax.extraction.game import Game
from ocjax.play import policies, varied
from ocjax.play.games import play
from ocjax.play.rollouts import rollout

VARIATION_GAMES = 10
LEVEL_SAMPLES = 16  # states of each game
LEVELS = {  # the field of the RAM that counts the levels, one by one
    "BeamRider": "sector",
    "ChopperCommand": "wave",
    "Defender": "wave",
    "DonkeyKong": "board",
    "Enduro": "day",
    "Frostbite": "level",
    "Galaxian": "round",
    "Hero": "level",
    "Kangaroo": "level",
    "Phoenix": "rounds",
    "Pooyan": "round",
    "Qbert": "round",
    "Riverraid": "level",
    "Robotank": "day",
    "Tutankham": "level",
    "UpNDown": "level",
}


def level(game: Game, policy: str) -> int | None:
    """The highest level in complete games, counted from 1.

    Each game contributes some of its states, and the last one.
    """
    if game.name not in LEVELS:
        return None
    start = rollout(game, GAMES, policy=policy, seed=SEED, num_envs=GAMES, whole_games=False)
    tape = rollout(game, GAMES * LEVEL_SAMPLES, policy=policy, seed=SEED, num_envs=GAMES)
    first = _numbers(game, start.rams).min()
    return int(1 + _numbers(game, tape.rams).max() - first)


def _numbers(game: Game, rams: np.ndarray) -> np.ndarray:
    """The levels of states, int32 `[n]`."""
    return np.array(jax.vmap(lambda ram: getattr(game.ram(ram), LEVELS[game.name]))(rams))


def measure(name: str, policy: str, agent: str, seeds: int) -> Row:
    """Play a game."""
    game = ocjax.load(name)
    played = play(game, policy, GAMES, seed=SEED).returns
    sticky = play(game, policy, GAMES, seed=SEED, repeat_action_probability=STICKY).returns
    random = play(game, "random", GAMES, seed=SEED).returns
    return Row(
        agent=agent,
        game=game.name,
        frames=policies.read(policies.find(policy, game), game).frames,
        seeds=seeds,
        mean=_mean(played),
        deviation=_deviation(played),
        sticky_mean=_mean(sticky),
        sticky_deviation=_deviation(sticky),
        random=_mean(random),
        random_deviation=_deviation(random),
        level=level(game, policy),
    )


def _mean(returns: np.ndarray) -> float:
    return round(float(returns.mean()), 4)


def _deviation(returns: np.ndarray) -> float:
    return round(float(returns.std(ddof=1)), 4)


def with_drops(row: Row) -> Row:
    """A row with the drops under the variations of its game."""
    game = ocjax.load(row.game)
    names = [*variations.of(game.name)]
    if not names:
        return row
    found = varied.compare(game, policies.TRAINED, names, VARIATION_GAMES, seed=SEED)
    drops = {one.name: one.drop for one in found if one.name != varied.ORIGINAL}
    return dataclasses.replace(row, drops=drops)


def publish(row: Row) -> None:
    """Add a row to the data and the page."""
    _scores.add(row)
    _scores.write_page(_scores.read_rows())


def main() -> None:
    """Play, and update the scoreboard after each game."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", metavar="GAME", help="default: all with an agent")
    parser.add_argument("--policy", default=policies.TRAINED, help="file of a saved policy")
    parser.add_argument("--agent", default=OWN, help="name of the agent")
    parser.add_argument("--seeds", type=int, default=1, help="training runs of the agent")
    parser.add_argument(
        "--variations", action="store_true", help="measure the drops under variations"
    )
    arguments = parser.parse_args()
    if (arguments.policy == policies.TRAINED) != (arguments.agent == OWN):
        parser.error("--policy and --agent belong together: give both or neither")
    ocjax.use_compilation_cache()
    shipped = sorted(path.stem for path in policies.SHIPPED.glob("*.npz"))
    for name in arguments.games or shipped:
        row = (
            with_drops(_scores.find(OWN, name))
            if arguments.variations
            else measure(name, arguments.policy, arguments.agent, arguments.seeds)
        )
        publish(row)
        print(row, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
