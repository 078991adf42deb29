"""A table whose fields lie apart in memory."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Fields:
    """Arrays (n, ...) by field name, which stands for the structured array (n,) that they would make together.

    `Columns` takes it as its data: what is written once need not be put together first, which for a filter's output
    costs as much memory and time as computing it. Names give arrays; positions give structured rows.
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._arrays = dict(arrays)
        self.dtype = np.dtype([(name, array.dtype, array.shape[1:]) for name, array in self._arrays.items()])
        self.shape = next(iter(self._arrays.values())).shape[:1]

    def __len__(self) -> int:
        return int(self.shape[0])

    def __getitem__(self, which: Any) -> NDArray[Any]:
        if isinstance(which, str):
            return self._arrays[which]
        picked = {name: array[which] for name, array in self._arrays.items()}
        result = np.empty(next(iter(picked.values())).shape[:1], self.dtype)
        for name, values in picked.items():
            result[name] = values
        return result

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        whole = self[:]
        return whole if dtype is None else whole.astype(dtype)

    def alone(self, name: str) -> NDArray[np.void]:
        """One field as a structured array of that field alone, without a copy where the field lies in one piece."""
        array = self._arrays[name]
        kind = np.dtype([(name, array.dtype, array.shape[1:])])
        return np.ascontiguousarray(array).reshape(len(self), -1).view(kind)[:, 0]
