"""Worker processes of a benchmark."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from skillwing.services.processes.child import SINGLE_THREADED


def workers(count: int) -> ProcessPoolExecutor:
    """Pool of `count` single-threaded processes, each a new interpreter."""
    os.environ.update(SINGLE_THREADED)  # the workers inherit it; too late for this process, which only waits
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))
