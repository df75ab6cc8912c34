# Only what the simulator uses.
from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

class EmbreeScene:
    def __init__(self, *, robust: bool = ...) -> None: ...
    @overload
    def run(
        self,
        vec_origins: NDArray[np.float32],
        vec_directions: NDArray[np.float32],
        dists: float | NDArray[np.float32] | None = None,
        query: str = "INTERSECT",
        output: None = None,
    ) -> NDArray[np.float32]: ...
    @overload
    def run(
        self,
        vec_origins: NDArray[np.float32],
        vec_directions: NDArray[np.float32],
        dists: float | NDArray[np.float32] | None = None,
        query: str = "INTERSECT",
        *,
        output: Literal[True],
    ) -> dict[str, NDArray[np.float32]]: ...
