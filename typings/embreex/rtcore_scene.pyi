# Only the query that `rays.py` uses.
import numpy as np
from numpy.typing import NDArray

class EmbreeScene:
    def run(
        self,
        vec_origins: NDArray[np.float32],
        vec_directions: NDArray[np.float32],
        dists: float | NDArray[np.float32] | None = None,
        query: str = "INTERSECT",
    ) -> NDArray[np.float32]: ...
