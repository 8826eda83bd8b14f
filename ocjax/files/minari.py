"""Write new Minari datasets, and copies of existing ones with objects.

A dataset appears when it is complete. Pictures are stored without compression, because JPEG,
Minari's default, changes colours.
"""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ocjax._extras import require
from ocjax.files import writing
from ocjax.files.inputs import MINARI, InputError, load_minari, minari_id
from ocjax.files.outputs import Blocks

# the storage writes these itself
FIXED = (
    "observation_space",
    "action_space",
    "env_spec",
    "data_format",
    "jpeg_encoding",
)
COUNTED = ("total_episodes", "total_steps", "dataset_size")  # the storage counts these
INFO = "objects"


def path_of(name: str) -> Path:
    """The folder of a new Minari dataset, named "minari:ID"."""
    identifier = minari_id(name)
    path = Path(require("minari.storage").get_dataset_path(identifier))
    if path.exists():
        raise InputError(
            f"there is a Minari dataset {identifier} already: use another ID, or `minari delete "
            f"{identifier}`"
        )
    require("h5py")
    namespace, namespaces = identifier.rpartition("/")[0], require("minari.namespace")
    if namespace and namespace not in namespaces.list_local_namespaces():
        namespaces.create_namespace(namespace)
    return path


@contextlib.contextmanager
def new_dataset(
    name: str, spaces: Mapping[str, Any], metadata: Mapping[str, Any]
) -> Iterator[Callable[..., None]]:
    """Write a Minari dataset, which appears at the end if no error occurs.

    Args:
        name: its ID after "minari:".
        spaces: arguments of Minari's storage: `observation_space`, `action_space`, and optionally
            `env_spec` and `data_format`.

    Yields:
        A function that adds an episode, with the fields of Minari's `EpisodeBuffer`.
    """
    with writing.complete_folder(path_of(name)) as unfinished:
        storage = require("minari.dataset.minari_storage").MinariStorage.new(
            unfinished / "data", jpeg_encoding=False, **spaces
        )
        own = {
            "dataset_id": name.removeprefix(MINARI),
            "minari_version": require("minari").__version__,
        }
        storage.update_metadata({**metadata, **own})
        buffer = require("minari.data_collector.episode_buffer").EpisodeBuffer
        yield lambda **fields: storage.update_episodes([buffer(**fields)])


def copy_with_objects(source: str, name: str, blocks: Blocks) -> None:
    """Copy a Minari dataset, and add the objects of each step to its infos.

    Args:
        source, name: the IDs of the dataset and of the new one, after "minari:".
        blocks: the objects of the observations of all episodes, in their order.
    """
    dataset, *_ = load_minari(source.removeprefix(MINARI))
    storage, known = dataset.storage, dict(dataset.storage.metadata)
    spaces = {
        "observation_space": storage.observation_space,
        "action_space": storage.action_space,
        "env_spec": dataset.env_spec,
        "data_format": known["data_format"],
    }
    metadata = {key: value for key, value in known.items() if key not in (*FIXED, *COUNTED)} | {
        INFO: blocks.facts
    }
    objects, indices = _Objects(blocks), dataset.episode_indices
    with new_dataset(name, spaces, metadata) as add:
        for episode, facts in zip(
            storage.get_episodes(indices), storage.get_episode_metadata(indices), strict=True
        ):
            fields = ("observations", "actions", "rewards", "terminations", "truncations")
            infos = dict(episode.get("infos") or {}) | {
                INFO: objects.take(len(episode["rewards"]) + 1)
            }
            add(
                **{key: episode[key] for key in fields},
                infos=infos,
                seed=facts.get("seed"),
                options=facts.get("options"),
            )


class _Objects:
    """The fields of `Objects`, taken from blocks in the order of the rows."""

    def __init__(self, blocks: Blocks) -> None:
        self._parts = (block.padded(rows, blocks.game) for _, rows, block in blocks)
        self._left: list[dict[str, np.ndarray]] = []

    def take(self, rows: int) -> dict[str, np.ndarray]:
        """The next rows, at least one."""
        while sum(len(part["valid"]) for part in self._left) < rows:
            self._left.append(next(self._parts))
        joined = {
            name: np.concatenate([part[name] for part in self._left]) for name in self._left[0]
        }
        self._left = [{name: a[rows:] for name, a in joined.items()}]
        return {name: a[:rows] for name, a in joined.items()}
