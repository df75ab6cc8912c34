"""Processes among which a benchmark shares out its flights."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from skillwing.services.processes.child import SINGLE_THREADED


def workers(count: int) -> ProcessPoolExecutor:
    """So many at once, each a fresh interpreter on a core of its own."""
    os.environ.update(SINGLE_THREADED)  # what they inherit; too late for this process, which computes nothing meanwhile
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))
