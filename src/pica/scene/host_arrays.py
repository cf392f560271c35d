"""Arrays and tensors of other libraries, as NumPy has them."""

from typing import Any

import numpy as np

_ON_HOST = 1, 3
"""Device types whose memory the processor reads (DLPack: kDLCPU, kDLCUDAHost)."""


def host_array(values: Any) -> Any:
    """A tensor as an array: anything with `__dlpack__`, such as those of PyTorch, JAX and CuPy. Others as they are.

    Memory of the processor is shared, not copied; that of a card is copied to the host. A tensor that requires a
    gradient is detached. Raises what the other library raises.
    """
    if isinstance(values, np.ndarray) or not hasattr(values, "__dlpack__"):
        return values
    if hasattr(values, "detach"):  # PyTorch
        values = values.detach()
    if values.__dlpack_device__()[0] in _ON_HOST:
        return np.from_dlpack(values)
    for copy in ("cpu", "get"):  # PyTorch; CuPy
        if hasattr(values, copy):
            return np.asarray(getattr(values, copy)())
    return values  # JAX: np.asarray copies it to the host
