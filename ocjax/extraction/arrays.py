"""Conversion of other libraries' arrays for the extraction methods."""

from typing import Any

import jax
import numpy as np

# DLPack device types: CPU memory, and pinned CPU memory for a GPU.
_HOST = 1, 3


def as_array(x: Any) -> Any:
    """Return an array as it is, or convert a uint8 tensor of another library without a copy."""
    if isinstance(x, np.ma.MaskedArray):
        raise TypeError(
            f"masked arrays are not supported, got one of {x.dtype} {list(x.shape)}: give "
            "x.data, or x.filled(value)"
        )
    if (
        isinstance(x, jax.Array | np.ndarray)
        or not hasattr(x, "__dlpack__")
        or not str(x.dtype).endswith(".uint8")
    ):
        return x
    return np.from_dlpack(x) if x.__dlpack_device__()[0] in _HOST else jax.dlpack.from_dlpack(x)


def require_uint8(name: str, array: Any) -> None:
    """Check that an argument is a uint8 array."""
    if not hasattr(array, "dtype") or array.dtype != np.uint8:
        raise TypeError(
            f"{name} must be a uint8 array, got {getattr(array, 'dtype', type(array).__name__)}"
            f"{_remedy(array)}"
        )


def _remedy(array: Any) -> str:
    if isinstance(array, list | tuple):
        return ": use numpy.asarray(x, numpy.uint8)"
    if isinstance(array, np.ndarray | jax.Array) and np.issubdtype(array.dtype, np.integer):
        return ": use x.astype(numpy.uint8)"
    return ""
