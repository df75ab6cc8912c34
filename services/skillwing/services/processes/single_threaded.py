"""How processes are kept from taking more than one core each for sums of small matrices.

What the system has to do is shared out among its processes. The libraries below numpy would share out each product of
two matrices as well, among as many threads as there are cores. With the matrices of a filter that gains no time: the
threads wait for each other, and take the other cores from other processes while they do.
"""

from __future__ import annotations

from typing import Final

SINGLE_THREADED: Final[dict[str, str]] = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
}
"""What the environment of such a process has to say from its beginning on."""
