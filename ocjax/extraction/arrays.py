"""What the extraction methods accept beside the arrays of JAX and NumPy."""

from typing import Any

import jax
import numpy as np

_HOST = (
    1,
    3,
)  # DLPack's numbers of the processor's memory, and of that which is pinned for a graphics card


def as_array(x: Any) -> Any:
    """The array itself, or a uint8 tensor of another library, such as PyTorch, as an array that
    shares its memory.

    Raises:
        TypeError: it is a masked array.
    """
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
