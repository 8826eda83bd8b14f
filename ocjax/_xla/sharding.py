"""Extraction from sharded arrays: each device processes its part of the batch.

The compiler does not find this division: VEM's loops and the loop over chunks would communicate.
"""

from collections.abc import Callable
from typing import Any

import jax
from jax.experimental.custom_partitioning import custom_partitioning
from jax.sharding import AbstractMesh, AxisType, NamedSharding, PartitionSpec, use_abstract_mesh


def by_device(f: Callable[[jax.Array], Any], rank: int) -> Callable[[jax.Array], Any]:
    """Apply a function to traced arrays, following their sharding along the batch.

    Args:
        f: maps `[..., *tail]` to a pytree of arrays `[..., *rest]`; states are independent.
        rank: number of axes of `tail`. The array is gathered along these axes if it is divided
            there.
    """
    partitioned = _partitioned(f, rank)

    def call(x: jax.Array) -> Any:
        sharding = jax.typeof(x).sharding
        axes = zip(sharding.mesh.axis_names, sharding.mesh.axis_types, strict=True)
        explicit = tuple(name for name, kind in axes if kind == AxisType.Explicit)
        if not explicit:
            return partitioned(x)
        out = NamedSharding(sharding.mesh, PartitionSpec(*sharding.spec[: x.ndim - rank]))
        return jax.sharding.auto_axes(partitioned, axes=explicit, out_sharding=out)(x)

    return call


def _partitioned(f: Callable[[jax.Array], Any], rank: int) -> Callable[[jax.Array], Any]:
    """Add a rule for dividing a function along axes with a sharding that the compiler chooses."""

    def rule(mesh: Any, operands: Any, results: Any) -> tuple[str, dict[str, Any]]:
        """Name all axes: "b0 t0 -> b0 r0_0 r0_1, b0 r1_0" for two results; only b0 is divided."""
        batch = [f"b{i}" for i in range(operands[0].rank - rank)]
        tail = [f"t{i}" for i in range(rank)]
        rest = [
            [f"r{k}_{i}" for i in range(result.rank - len(batch))]
            for k, result in enumerate(results)
        ]
        text = f"{' '.join(batch + tail)} -> {', '.join(' '.join(batch + names) for names in rest)}"
        return text, {
            "need_replication_factors": (*tail, *(name for names in rest for name in names))
        }

    def partition(mesh: Any, operands: Any, results: Any) -> tuple[Any, Any, Any, Any]:
        x = operands[0]
        sharding = NamedSharding(x.sharding.mesh, PartitionSpec(*x.sharding.spec[: x.ndim - rank]))
        return mesh, on_one_device, jax.tree.map(lambda _: sharding, results), (sharding,)

    def on_one_device(x: jax.Array) -> Any:
        # Without this, JAX 0.12 gives new arrays the sharding of a mesh that the caller has set
        # (`jax.set_mesh`).
        with use_abstract_mesh(AbstractMesh((), ())):
            return f(x)

    divided = custom_partitioning(f)
    divided.def_partition(partition, sharding_rule=rule)
    return divided
