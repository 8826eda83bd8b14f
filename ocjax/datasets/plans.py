"""The plan of a dataset: everything that determines its bytes, and its division into shards."""

import dataclasses
import functools
import hashlib
import importlib.metadata
import json
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ocjax._extras import extras
from ocjax.emulators import ram_starts
from ocjax.emulators.checks import integer
from ocjax.emulators.ram_starts import Start
from ocjax.emulators.settings import settings
from ocjax.envs import Settings
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.play import policies

SEEDS = (0, 42)  # as in the OCAtari paper (Delfosse et al., 2024)
ENVS = 10  # instances that play side by side
RANDOM_PERCENT = 30  # default percentage of the states
SHARD_STATES, SEQUENCE_STATES = 10_000, 100  # limits; see `Plan`
MOST_SHARDS = 99_999  # shard names have five digits
MOST_STATES = MOST_SHARDS * SHARD_STATES
LEAST_F1 = 0.9  # of REM against VEM in a kept sequence
DATA = "data"  # the folder of the shards
LIBRARIES = ("ale-py", "jax", "numpy", "pillow", "pyarrow")


class DatasetError(ValueError):
    """A dataset cannot be made, read or continued. The message gives the reason."""


class Shard(NamedTuple):
    """A file of a dataset, which is played independently of the other files."""

    number: int
    seed: int  # seed of the dataset
    part: int  # number among the shards of the seed
    first: int  # number of its first state
    states: int

    @property
    def shares(self) -> list[int]:
        """The number of states of each instance."""
        return [self.states // ENVS + (i < self.states % ENVS) for i in range(ENVS)]


@dataclasses.dataclass(frozen=True)
class Plan:
    """Everything that determines the bytes of a dataset.

    Args:
        game: the game's name.
        md5: md5 of its ROM.
        states: number of states to play.
        seeds: each plays an equal fraction of the states.
        policies: name of each policy, and how many of the `ENVS` instances it plays.
        policy_files: SHA-256 of the policies that are files.
        shard_states: largest number of states in a file.
        sequence_states: largest number of successive states that are kept or dropped together.
        least_f1: sequences with a lower F1 of REM against VEM are dropped.
        settings: settings of the emulators, the fields of `ocjax.envs.Settings`.
        versions: versions of ocjax and of the libraries.
        code: digest of the source of ocjax, whose decoders extract the objects.
        starts: values that are written to the RAM when games begin, in rotation of the instances.
            Older datasets have none.
        policy_settings: settings for policies that were trained with other settings. Older datasets
            have none.
    """

    game: str
    md5: str
    states: int
    seeds: tuple[int, ...]
    policies: tuple[tuple[str, int], ...]
    policy_files: Mapping[str, str]
    shard_states: int
    sequence_states: int
    least_f1: float
    settings: Mapping[str, Any]
    versions: Mapping[str, str]
    code: str
    starts: tuple[Start, ...] = ()
    policy_settings: Mapping[str, Mapping[str, Any]] = dataclasses.field(default_factory=dict)

    def to_json(self) -> str:
        """The plan as JSON for `from_json`."""
        return json.dumps(dataclasses.asdict(self), indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> "Plan":
        """Read the JSON that `to_json` wrote; raises ValueError if it is damaged."""
        return cls.from_fields(json.loads(text))

    @classmethod
    def from_fields(cls, fields: Mapping[str, Any]) -> "Plan":
        """Make a plan from fields with JSON's types; raises ValueError if one is malformed."""
        known = [field.name for field in dataclasses.fields(cls)]
        given = {"starts": (), "policy_settings": {}, **fields}
        lacking = [name for name in known if name not in given]
        unknown = [name for name in given if name not in known]
        if lacking or unknown:
            raise ValueError(
                f"the plan lacks the fields {lacking}, and has the unknown fields "
                f"{reprlib.repr(unknown)}"
            )
        for name in ("seeds", "policies", "starts"):
            if not isinstance(given[name], list | tuple):
                raise ValueError(f"{name} must be a list, got {reprlib.repr(given[name])}")
            given[name] = tuple(
                tuple(entry) if isinstance(entry, list) else entry for entry in given[name]
            )
        return cls(**given)

    def __post_init__(self) -> None:
        for name in ("game", "md5", "code"):
            if not isinstance(getattr(self, name), str):
                raise ValueError(f"{name} must be a text, got {reprlib.repr(getattr(self, name))}")
        for name in ("policy_files", "versions"):
            entries = getattr(self, name)
            if not isinstance(entries, Mapping) or not all(
                isinstance(text, str) for text in entries.values()
            ):
                raise ValueError(f"{name} must map names to texts, got {reprlib.repr(entries)}")
        for name in ("states", "shard_states", "sequence_states"):
            integer(name, getattr(self, name), 1, MOST_STATES)
        _check_play(self)
        if self.num_shards > MOST_SHARDS:
            raise ValueError(
                f"a dataset has at most {MOST_SHARDS:,} files, got {self.num_shards:,}"
            )

    @property
    def num_shards(self) -> int:
        """The number of files."""
        each, rest = divmod(self.states, len(self.seeds))  # the first seeds play one state more
        of_first, of_others = self._shards_of(each + 1), self._shards_of(each)
        return rest * of_first + (len(self.seeds) - rest) * of_others

    def _shards_of(self, states: int) -> int:
        """The number of files of a seed that plays this many states."""
        return -(-states // self.shard_states)

    @functools.cached_property
    def shards(self) -> list[Shard]:
        """The files, in order."""
        out: list[Shard] = []
        first = 0
        for i, seed in enumerate(self.seeds):
            left = self.states // len(self.seeds) + (i < self.states % len(self.seeds))
            for part in range(self._shards_of(left)):
                states = min(left - part * self.shard_states, self.shard_states)
                out.append(Shard(len(out), seed, part, first, states))
                first += states
        return out

    def settings_of(self, policy: str) -> Settings:
        """The settings of the emulators that a policy plays."""
        return Settings(**self.policy_settings.get(policy, self.settings))

    def file(self, shard: Shard) -> Path:
        """The path of a shard in the dataset's folder."""
        return Path(DATA, f"train-{shard.number:05}-of-{self.num_shards:05}.parquet")


def _check_play(plan: Plan) -> None:
    _check_seeds(plan)
    _check_policies(plan)
    if (
        not isinstance(plan.least_f1, int | float)
        or isinstance(plan.least_f1, bool)
        or not 0 <= plan.least_f1 <= 1
    ):
        raise DatasetError(f"least_f1 must be between 0 and 1, got {plan.least_f1!r}")
    if not all(isinstance(start, Mapping) for start in plan.starts):
        raise ValueError(f"a start must map names to values, got {reprlib.repr(plan.starts)}")
    _check_settings(plan)


def _check_seeds(plan: Plan) -> None:
    for seed in plan.seeds:
        integer("a seed", seed, 0, 2**31 - 1)
    if not plan.seeds or len(set(plan.seeds)) < len(plan.seeds):
        raise DatasetError(
            f"seeds must be distinct, and at least one, got {reprlib.repr(plan.seeds)}"
        )


def _check_policies(plan: Plan) -> None:
    for policy in plan.policies:
        if not isinstance(policy, tuple) or len(policy) != 2 or not isinstance(policy[0], str):
            raise ValueError(
                f"a policy must be a name and a number of instances, got {reprlib.repr(policy)}"
            )
        integer(f"the instances of the policy {policy[0]}", policy[1], 1, ENVS)
    if sum(n for _, n in plan.policies) != ENVS:
        raise ValueError(
            f"the policies must have {ENVS} instances, got {reprlib.repr(plan.policies)}"
        )


def _check_settings(plan: Plan) -> None:
    """Check the settings of all policies, which must have the same actions."""
    names = [name for name, _ in plan.policies]
    if not isinstance(plan.policy_settings, Mapping) or not set(plan.policy_settings) <= set(names):
        raise ValueError(
            "policy_settings must map names of the policies to settings, got "
            f"{reprlib.repr(plan.policy_settings)}"
        )
    try:
        every = [plan.settings_of(name) for name in names]
    except TypeError as error:
        raise ValueError(f"the settings are malformed: {error}") from error
    if len({one.full_action_space for one in every}) > 1:
        raise ValueError(
            "all policies of a dataset must have the same actions, but full_action_space differs "
            "in their settings"
        )


def plan(
    game: Game | str,
    states: int,
    seeds: Sequence[int] = SEEDS,
    policies: Mapping[str, int] | None = None,
    least_f1: float = LEAST_F1,
    starts: Sequence[Start] = (),
) -> Plan:
    """Plan a dataset of a game.

    Args:
        game: the game, with its display, or its name.
        states: number of states to play.
        seeds: each plays an equal fraction of the states.
        policies: percentage of the states that each policy plays, by name; see
            `ocjax.play.policies.make_policy`. By default, 30 % random actions, and 70 % the trained
            policy that ships with the game, or held random actions.
        least_f1: sequences with a lower F1 of REM against VEM are dropped.
        starts: values that are written to the RAM when a game begins, by the name of a field of the
            game's `Ram` (`ocjax ram map GAME`) or the number of a byte, such as `{"level": 2}`. The
            instances use the starts in rotation; an empty start writes nothing.

    Raises:
        DatasetError: a ValueError; the percentages are not multiples of 10 that add up to 100, a
            seed occurs twice, or the least F1 is not between 0 and 1.
        UnknownGameError: a ValueError; no game has that name.
        PolicyError: a ValueError; a policy does not exist or does not fit the game.
        ValueError: another number is out of range, or a start names an unknown field or byte.
    """
    game = registry.as_game(game)
    chosen = default_policies(game) if policies is None else policies
    if sum(chosen.values()) != 100 or any(p <= 0 or p % (100 // ENVS) for p in chosen.values()):
        raise DatasetError(
            f"the percentages of the policies must be multiples of {100 // ENVS} that add up to "
            f"100, got {dict(chosen)}"
        )
    played = {name: _settings_of_policy(name, game) for name in chosen}
    return Plan(
        game=game.name,
        md5=game.md5,
        states=integer("states", states, 1, MOST_STATES),
        seeds=tuple(integer("a seed", seed, 0, 2**31 - 1) for seed in seeds),
        policies=tuple((name, percent * ENVS // 100) for name, percent in chosen.items()),
        policy_files={
            name: _digest_of_policy(name, game)
            for name in chosen
            if name not in ("random", "repeat")
        },
        shard_states=SHARD_STATES,
        sequence_states=SEQUENCE_STATES,
        least_f1=float(least_f1),
        settings=whole_games(None).to_dict(),
        versions=versions(),
        code=code(),
        starts=ram_starts.checked(game, starts),
        policy_settings={
            name: own.to_dict() for name, own in played.items() if own != whole_games(None)
        },
    )


def default_policies(game: Game) -> dict[str, int]:
    """The percentage of the states that each policy plays."""
    other = policies.TRAINED if (policies.SHIPPED / f"{game.name}.npz").exists() else "repeat"
    return {"random": RANDOM_PERCENT, other: 100 - RANDOM_PERCENT}


def whole_games(trained: Settings | None) -> Settings:
    """A training's settings (None: the preset "dqn") with whole games and true rewards."""
    return dataclasses.replace(trained or settings("dqn"), clip_rewards=False, episodic_life=False)


def _settings_of_policy(name: str, game: Game) -> Settings:
    return whole_games(policies.needs(name, game).settings)


def _digest_of_policy(name: str, game: Game) -> str:
    path = policies.find(name, game)
    policies.read(path, game)  # fail before the play if the policy cannot play
    return hashlib.sha256(path.read_bytes()).hexdigest()


def versions() -> dict[str, str]:
    """Versions of ocjax and of the libraries that determine the bytes of a dataset."""
    with extras():
        return {name: importlib.metadata.version(name) for name in ("ocjax", *LIBRARIES)}


@functools.cache
def code() -> str:
    """A digest of the source of ocjax; versions with equal digests extract equal objects."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    # `rglob` does not follow the link to the games
    paths = (
        *root.rglob("*.py"),
        *(root / "extractors").rglob("*.py"),
    )
    files = {path.relative_to(root).as_posix(): path for path in paths}
    for name in sorted(name for name in files if "__pycache__" not in name):
        digest.update(name.encode() + b"\0" + hashlib.sha256(files[name].read_bytes()).digest())
    return digest.hexdigest()
