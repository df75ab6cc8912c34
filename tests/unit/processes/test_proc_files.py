"""Process data from `/proc`."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys

import psutil
import pytest

from skillwing.services.processes.proc_files import listener, port_of, started, usage

NOBODY = 2**22 + 1


def test_usage_is_what_others_measure() -> None:
    found, expected = usage(os.getpid()), psutil.Process()
    assert found is not None
    times = expected.cpu_times()
    assert found.cpu == pytest.approx(times.user + times.system, abs=1.0)
    assert found.memory == pytest.approx(expected.memory_info().rss, rel=0.5)
    assert not found.stopped


def test_a_process_that_is_stopped_is_known() -> None:
    with subprocess.Popen(["sleep", "60"]) as process:
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        found = usage(process.pid)
        process.kill()
    assert found is not None
    assert found.stopped


def test_a_process_that_is_no_more_has_no_usage() -> None:
    assert usage(NOBODY) is None
    assert started(NOBODY) is None


@pytest.mark.parametrize(("family", "host"), [(socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")])
def test_who_listens_at_a_port_is_found(family: socket.AddressFamily, host: str) -> None:
    with socket.socket(family) as server:
        server.bind((host, 0))
        server.listen()
        found = listener(server.getsockname()[1])
        assert found is not None
        assert found.pid == os.getpid()
        assert found.name is not None
        assert found.who.startswith(f"Process {os.getpid()} (`")


def test_a_port_where_nobody_listens_is_free() -> None:
    with socket.socket() as client:
        client.bind(("127.0.0.1", 0))
        assert listener(client.getsockname()[1]) is None


def test_a_python_module_is_named_by_its_module() -> None:
    command = [sys.executable, "-m", "http.server", "--bind", "127.0.0.1", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, "PYTHONUNBUFFERED": "1"}) as process:
        try:
            assert process.stdout is not None
            port = int(process.stdout.readline().split()[5])
            found = listener(port)
        finally:
            process.kill()
    assert found is not None
    assert (found.pid, (found.name or "").endswith("-m http.server")) == (process.pid, True)


@pytest.mark.parametrize(
    ("endpoint", "port"),
    [("tcp/127.0.0.1:7447", 7447), ("tcp/[::1]:7447", 7447), ("tcp/far.example:7447", None), ("tcp/x", None)],
)
def test_only_ports_of_this_machine_are_looked_at(endpoint: str, port: int | None) -> None:
    assert port_of(endpoint) == port
