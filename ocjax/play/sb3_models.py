"""Reading policies from models of Stable-Baselines3 (`.zip`).

Only the weights are read; code in the files never runs. Reading needs PyTorch, but not
Stable-Baselines3.
"""

import io
import re
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ocjax._extras import require
from ocjax._files import npz
from ocjax.emulators.settings import settings
from ocjax.envs import Dqn, Vector
from ocjax.extraction.game import Game
from ocjax.extraction.registry import load
from ocjax.play.policy_files import LARGEST, MOST_BYTES, layers_of
from ocjax.play.saved import PolicyError, SavedPolicy

PRESET = "dqn"  # for models, which lack the settings of their training
MEMBER = "policy.pth"
MOST_PICKLED = 2**20  # bytes of the description of the tensors
SUPPORTED = (
    'PPO, A2C and DQN with CnnPolicy on obs="dqn" or with MlpPolicy on obs="vector", with '
    "discrete actions, without custom feature extractors "
    "and without additional layers after the convolutions"
)
_EXTRACTOR = r"features_extractor\.(cnn\.[024]|linear\.0)"
_ACTOR_CRITIC = re.compile(
    rf"((pi_|vf_)?{_EXTRACTOR}|mlp_extractor\.(policy|value)_net\.\d+|action_net|value_net)"
    r"\.(weight|bias)"
)
_DQN = re.compile(rf"q_net(_target)?\.({_EXTRACTOR}|q_net\.\d+)\.(weight|bias)")


class _Architecture(NamedTuple):
    layers: list[str]  # names of the modules, in order
    network: str  # name in `ocjax.play.networks`
    sampled: bool


def read(path: str | Path, game: Game) -> SavedPolicy:
    """Read a model that `model.save` of Stable-Baselines3 wrote, with the preset "dqn"."""
    state = _weights(path)
    found = _architecture(path, set(state))
    arrays: dict[str, np.ndarray] = {}
    for i, module in enumerate(found.layers):
        weights = state[f"{module}.weight"]
        arrays |= {
            f"w{i}": weights.T if weights.ndim == 2 else weights,
            f"b{i}": state.get(f"{module}.bias", np.zeros(0)),
        }
    known: dict[str, Any] = {
        "sampled": found.sampled,
        "settings": settings(PRESET),
        "preset": PRESET,
        "network": found.network,
    }
    if found.network == "nature_cnn":
        kind = Dqn()
        return SavedPolicy(
            game,
            layers_of(path, game, arrays, found.network, (kind.stack, *kind.size)),
            kind,
            **known,
        )
    inputs = arrays["w0"].shape[0] if arrays["w0"].ndim else 0
    game = _with_inputs(path, game, inputs)
    layers = layers_of(path, game, arrays, found.network, (inputs,))
    return SavedPolicy(
        game, layers, Vector(), np.zeros(inputs, np.float32), np.ones(inputs, np.float32), **known
    )


def _with_inputs(path: str | Path, game: Game, inputs: int) -> Game:
    whole = game if game.hud else load(game.name)
    choices = {len(Vector().features_of(chosen)): chosen for chosen in (whole.without_hud(), whole)}
    if inputs not in choices:
        few, many = min(choices), max(choices)
        raise PolicyError(
            f'{path}: the model must have the inputs of obs="vector" of {game.name}, {many} or, '
            f"with hud=False, {few}, got {inputs}"
        )
    return choices[inputs]


def _architecture(path: str | Path, names: set[str]) -> _Architecture:
    if names and all(map(_ACTOR_CRITIC.fullmatch, names)):
        prefix, head, activation, sampled = "features_extractor", ["action_net"], "mlp", True
        hidden = _numbered(names, "mlp_extractor.policy_net")
    elif names and all(map(_DQN.fullmatch, names)):
        prefix, head, activation, sampled = "q_net.features_extractor", [], "relu_mlp", False
        hidden = _numbered(names, "q_net.q_net")
    else:
        raise PolicyError(f"{path}: this kind of model is not supported; supported are {SUPPORTED}")
    convolutions = [f"{prefix}.cnn.{i}" for i in (0, 2, 4)] + [f"{prefix}.linear.0"]
    is_cnn = f"{convolutions[0]}.weight" in names
    layers = (convolutions if is_cnn else []) + hidden + head
    lacking = [module for module in layers if f"{module}.weight" not in names]
    if lacking or not layers or (is_cnn and sampled and hidden):
        raise PolicyError(f"{path}: this kind of model is not supported; supported are {SUPPORTED}")
    return _Architecture(layers, "nature_cnn" if is_cnn else activation, sampled)


def _numbered(names: set[str], prefix: str) -> list[str]:
    found = {
        name.removesuffix(".weight")
        for name in names
        if name.startswith(f"{prefix}.") and name.endswith(".weight")
    }
    return sorted(found, key=lambda module: int(module.rpartition(".")[2]))


def _weights(path: str | Path) -> dict[str, np.ndarray]:
    torch = require("torch")
    try:
        data = _member(Path(path))
        state = torch.load(io.BytesIO(data), map_location="cpu", weights_only=True)
        tensors = {
            name: tensor
            for name, tensor in state.items()
            if isinstance(name, str) and _is_plain(torch, tensor)
        }
    except Exception as error:  # a damaged file can fail anywhere in zipfile, zlib and PyTorch
        text = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        raise PolicyError(
            f"{path} is not a readable model of Stable-Baselines3 (.zip with {MEMBER}): {text}"
        ) from error
    if len(tensors) < len(state):
        raise PolicyError(f"{path}: {MEMBER} must hold named tensors of numbers, and some are not")
    size = sum(4 * tensor.numel() for tensor in tensors.values())
    if size > MOST_BYTES:
        raise PolicyError(
            f"{path} holds {size:,} bytes of weights, and at most {MOST_BYTES:,} are read"
        )
    arrays = {name: tensor.detach().to(torch.float32).numpy() for name, tensor in tensors.items()}
    for name, array in arrays.items():
        if not (np.abs(array) < LARGEST).all():
            raise PolicyError(f"{path}: {name[:100]!r} must hold finite numbers below {LARGEST:g}")
    return arrays


def _is_plain(torch: Any, tensor: Any) -> bool:
    return (
        isinstance(tensor, torch.Tensor)
        and tensor.layout == torch.strided
        and tensor.device.type == "cpu"
        and tensor.is_floating_point()
    )


def _member(path: Path) -> bytes:
    """The bytes of the policy's weights, another zip archive, after a check of their size."""
    if not path.is_file():
        raise ValueError("it is no regular file")
    with zipfile.ZipFile(path) as archive:
        if MEMBER not in archive.namelist():
            raise ValueError(f"it has no {MEMBER}")
        info = archive.getinfo(MEMBER)
        npz.check_member(archive, info)
        _check_size(info.file_size, 2 * MOST_BYTES)
        data = archive.read(info)
    with zipfile.ZipFile(io.BytesIO(data)) as inner:
        infos = inner.infolist()
        if any(
            info.compress_type != zipfile.ZIP_STORED or info.file_size > len(data) for info in infos
        ):
            raise ValueError(f"{MEMBER} is compressed")
        _check_size(sum(info.file_size for info in infos), 2 * MOST_BYTES)
        _check_size(
            max((info.file_size for info in infos if info.filename.endswith(".pkl")), default=0),
            MOST_PICKLED,
        )
    return data


def _check_size(size: int, most: int) -> None:
    if not 0 <= size <= most:
        raise ValueError(f"{MEMBER} has {size:,} bytes, and at most {most:,} are read")
