"""The configuration of a training run: game, inputs, environments and hyperparameters.

This module does not need the extra `rl`.
"""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal, get_args

from ocjax.emulators import ram_starts
from ocjax.emulators.checks import integer, is_integer
from ocjax.emulators.hooks import named_hooks
from ocjax.emulators.ram_starts import Start
from ocjax.emulators.settings import Settings, settings
from ocjax.emulators.start import variants
from ocjax.envs import Vector
from ocjax.extraction.game import Game
from ocjax.extraction.registry import load
from ocjax.play.networks import Groups, groups_of

FEATURES = ("x", "y", "dx", "dy", "nx", "ny", "mx", "my", "orientation", "valid")
# Positions on a fixed grid are constant, and relative to the player they all change at once: in
# Breakout, 108 bricks would hide the ball.
GRID_FEATURES = ("valid",)
PRESET = "dqn"
MOST = 2**31 - 1  # limit of seeds and hyperparameters
MOST_HISTORY = 1_000

Inputs = Literal["objects", "pixels"]
ObjectNetwork = Literal["deep_sets", "mlp"]


class TrainingError(ValueError):
    """A training cannot be started or continued."""


def _hyperparameter(default: float, meaning: str) -> Any:
    return dataclasses.field(default=default, metadata={"help": meaning})


@dataclasses.dataclass(frozen=True)
class Hyperparameters:
    """Hyperparameters of PPO, the same for all games; the metadata entry `help` explains each one.

    The OCAtari paper's values (`EXPERIMENTS["paper"]`) learn more slowly per frame: after 1.3
    million frames, they reach -18.4 points in Pong, and the defaults -17.0. Learning rate, clipping
    range and entropy coefficient fall linearly to 0 over the training: an entropy bonus would later
    keep the policy from choosing between actions with similar values.
    """

    num_envs: int = _hyperparameter(
        64, "Environments, an even number: half of them step while the policy acts in the others."
    )
    horizon: int = _hyperparameter(32, "Steps of a rollout.")
    epochs: int = _hyperparameter(4, "Passes over a rollout.")
    minibatch: int = _hyperparameter(256, "Samples of a gradient step; divides num_envs * horizon.")
    learning_rate: float = _hyperparameter(1e-3, "Initial step size of Adam.")
    clip: float = _hyperparameter(0.2, "Initial clipping range of probability ratios.")
    gamma: float = _hyperparameter(0.99, "Discount factor.")
    gae_lambda: float = _hyperparameter(0.95, "Decay of generalised advantage estimation.")
    value_coefficient: float = _hyperparameter(1.0, "Weight of the value loss.")
    entropy_coefficient: float = _hyperparameter(0.01, "Initial weight of the entropy bonus.")
    max_grad_norm: float = _hyperparameter(0.5, "Gradients are scaled down to this norm.")

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            checked = (
                integer(field.name, value, 1, MOST)
                if field.type is int
                else _positive(field.name, value)
            )
            object.__setattr__(self, field.name, checked)
        for name in ("gamma", "gae_lambda"):
            if getattr(self, name) > 1:
                raise ValueError(f"{name} must be at most 1, got {getattr(self, name)}")
        if self.num_envs % 2:
            raise ValueError(
                "num_envs must be even, because halves of the environments take turns, got "
                f"{self.num_envs}"
            )
        if self.num_envs * self.horizon % self.minibatch:
            raise ValueError(
                f"minibatch must divide num_envs * horizon = {self.num_envs * self.horizon}, got "
                f"{self.minibatch}"
            )


def _positive(name: str, value: Any) -> float:
    or_zero = name == "entropy_coefficient"
    known = isinstance(value, int | float) and not isinstance(value, bool) and value <= MOST
    if known and (value > 0 or (value == 0 and or_zero)):
        return float(value)
    raise ValueError(
        f"{name} must be positive{' or 0' * or_zero} and at most {MOST:,}, got {value!r}"
    )


@dataclasses.dataclass(frozen=True)
class Config:
    """The configuration of a training.

    Args:
        game: the game's name in any of the usual spellings.
        seed: seed of the environments, the network and the actions.
        inputs: "objects" (from RAM, without the display) or "pixels" (the last four grey frames).
        preset: the settings of the environments. Rewards are never clipped, but scaled by the
            spread of the returns.
        hyperparameters: the hyperparameters of PPO.
        features: the features of each slot, by their names in `ocjax.envs.Vector`, in pixels. This
            and the next three are for "objects".
        grid_features: the features of slots of fixed grids; with None, the same as for others.
        history: number of states that the policy sees.
        network: "deep_sets" (the slots of a category share weights; it takes one state) or "mlp".
        variations: names of variations of the game, which apply together; see
            `ocjax.emulators.variations`.
        game_mode: ale-py's number of the mode; by default the game's own.
        game_difficulty: ale-py's number of the difficulty; by default the game's own.
        starts: values to write to the RAM when a game begins, by the name of a field of the game's
            `Ram` (`ocjax ram map GAME`) or the number of a byte, such as `{"level": 2}`. The
            environments use the starts in rotation; an empty start writes nothing.
    """

    game: str
    seed: int = 0
    inputs: Inputs = "objects"
    preset: str = PRESET
    hyperparameters: Hyperparameters = dataclasses.field(default_factory=Hyperparameters)
    features: tuple[str, ...] = FEATURES
    grid_features: tuple[str, ...] | None = GRID_FEATURES
    history: int = 1
    network: ObjectNetwork = "deep_sets"
    variations: tuple[str, ...] = ()
    game_mode: int | None = None
    game_difficulty: int | None = None
    starts: tuple[Start, ...] = ()

    def __post_init__(self) -> None:
        game = load(self.game)
        if self.inputs not in get_args(Inputs):
            raise ValueError(f"inputs must be {' or '.join(get_args(Inputs))}, got {self.inputs!r}")
        if not isinstance(self.hyperparameters, Hyperparameters):
            raise ValueError(
                "hyperparameters must be an instance of Hyperparameters, got "
                f"{self.hyperparameters!r}"
            )
        _check_preset(self.preset)
        checked = {
            "game": game.name,
            "seed": integer("seed", self.seed, 0, MOST),
            "features": _names("features", self.features),
            "grid_features": None
            if self.grid_features is None
            else _names("grid_features", self.grid_features),
            "history": integer("history", self.history, 1, MOST_HISTORY),
            "variations": _variations(game, self.variations),
            "starts": ram_starts.checked(game, self.starts),
            **_variant(game, self.game_mode, self.game_difficulty),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        if self.network not in get_args(ObjectNetwork):
            raise ValueError(
                f"network must be {' or '.join(get_args(ObjectNetwork))}, got {self.network!r}"
            )
        _ = self.groups  # raises ValueError for unknown or unsupported features

    @classmethod
    def of(
        cls,
        experiment: str,
        game: str,
        hyperparameters: Mapping[str, float] | None = None,
        **changes: Any,
    ) -> "Config":
        """The configuration of an experiment, by its name in `EXPERIMENTS`, with changes."""
        if experiment not in EXPERIMENTS:
            raise ValueError(f"experiment must be {' or '.join(EXPERIMENTS)}, got {experiment!r}")
        fields = {"hyperparameters": Hyperparameters(), **EXPERIMENTS[experiment], **changes}
        fields["hyperparameters"] = dataclasses.replace(
            fields["hyperparameters"], **(hyperparameters or {})
        )
        return cls(game, **fields)

    @property
    def vector(self) -> Vector:
        """The observation of "objects"."""
        return Vector(
            self.features, grid_features=self.grid_features, history=self.history, normalize=False
        )

    @property
    def groups(self) -> Groups:
        """The groups of the observation, for the network "deep_sets"."""
        return (
            groups_of(load(self.game).without_hud(), self.vector)
            if self.network == "deep_sets"
            else ()
        )

    @property
    def settings(self) -> Settings:
        """The settings of the environments."""
        return dataclasses.replace(settings(self.preset), clip_rewards=False)

    def to_json(self) -> str:
        """The configuration as JSON."""
        return json.dumps(dataclasses.asdict(self), indent=2) + "\n"


def _check_preset(preset: Any) -> None:
    if not isinstance(preset, str):
        raise ValueError(f"preset must be a name, got {preset!r}")
    skip = settings(preset).frame_skip
    if not isinstance(skip, int):
        raise TrainingError(
            f"training needs a preset with a fixed frame skip, such as {PRESET}: {preset} draws "
            f"one of {skip} for each step"
        )


def _variant(game: Game, mode: Any, difficulty: Any) -> dict[str, int | None]:
    """Check the mode and the difficulty; the ROM is only loaded if one of them is given."""
    given = {"game_mode": mode, "game_difficulty": difficulty}
    if mode is None and difficulty is None:
        return given
    for (name, value), known in zip(given.items(), variants(game), strict=True):
        if value is not None and not (is_integer(value) and value in known):
            raise ValueError(f"{game.name} has no {name} {value!r}; it has {known}")
    return {name: None if value is None else int(value) for name, value in given.items()}


def _names(field: str, value: Any) -> tuple[str, ...]:
    if (
        isinstance(value, str)
        or not isinstance(value, Sequence)
        or not all(isinstance(name, str) for name in value)
    ):
        raise ValueError(f"{field} must be a sequence of names, got {value!r}")
    return tuple(value)


def _variations(game: Game, value: Any) -> tuple[str, ...]:
    names = _names("variations", value)
    named_hooks(names, game.name)
    return tuple(name.rpartition(":")[2] for name in names)


# Experiments by name, with the fields of `Config` that differ from its defaults. The paper is
# Delfosse et al. (2024). It lacks `max_grad_norm`, which is 0.5 as in CleanRL's ppo_atari.py.
EXPERIMENTS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "default": {},
        "paper": {
            "hyperparameters": Hyperparameters(
                num_envs=8,
                horizon=128,
                epochs=3,
                minibatch=256,
                learning_rate=2.5e-4,
                clip=0.1,
                gamma=0.99,
                gae_lambda=0.95,
                value_coefficient=1.0,
                entropy_coefficient=0.01,
                max_grad_norm=0.5,
            ),
            "features": ("x", "y"),
            "grid_features": None,
            "history": 2,
            "network": "mlp",
        },
    }
)
