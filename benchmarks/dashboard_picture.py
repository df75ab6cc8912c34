"""A picture of the dashboard from a recording, as the native viewer draws it, on a machine without a screen.

    python benchmarks/dashboard_picture.py runs/pictures/recording.rrd docs/images/dashboard.png --at 60

Needs a Vulkan driver, of which Mesa's software one will do (Debian: mesa-vulkan-drivers, fonts-dejavu-core).
"""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun_cli
from rerun.experimental import ViewerClient

from skillwing.services.recording.mission_view import TIMELINE

VIEWER = Path(rerun_cli.__file__).with_name("rerun")
"""The viewer itself: the `rerun` script is a wrapper, which leaves it behind when it is killed."""
SIZE = "1600x900"
PATIENCE = 60.0
"""Wall seconds for the viewer to come up, and to load the recording."""
DRAWN_WITHIN = 8.0
"""Wall seconds that a viewer which draws on the processor takes to settle after a jump in time."""


class NoPictureError(Exception):
    """The viewer did not come up, or does not show the recording; says why."""


@contextmanager
def viewer(recording: Path) -> Iterator[ViewerClient]:
    """A headless viewer that has loaded a recording. Raises NoPictureError."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [str(VIEWER), "--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", SIZE]
    with subprocess.Popen([*command, "--hide-welcome-screen", str(recording)], stderr=subprocess.PIPE) as process:
        try:
            yield _connected(process, f"rerun+http://127.0.0.1:{port}/proxy")
        finally:
            process.kill()


def _connected(process: subprocess.Popen[bytes], url: str) -> ViewerClient:
    deadline, reason = time.monotonic() + PATIENCE, "it does not answer"
    while time.monotonic() < deadline:
        if process.poll() is not None:
            told = process.stderr.read().decode(errors="replace").strip() if process.stderr else ""
            raise NoPictureError(f"The viewer has ended: {told.splitlines()[-1] if told else process.returncode}")
        try:
            client = ViewerClient.connect(url)
            state = client.get_state()
        except (ConnectionError, RuntimeError) as error:
            reason = str(error)
        else:
            if state.recordings and not state.loading:
                return client
            reason = "it does not get the recording"
        time.sleep(0.5)
    raise NoPictureError(f"The viewer shows nothing after {PATIENCE:g} s: {reason}.")


def main() -> int:
    """Take one picture."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--at", type=float, required=True, metavar="SECONDS", help="robot time of the picture")
    options = parser.parse_args()
    if not options.recording.is_file():
        parser.error(f"there is no recording {options.recording}")
    try:
        with viewer(options.recording) as shown:
            shown.set_time(TIMELINE, duration=options.at, play_state="paused")
            time.sleep(DRAWN_WITHIN)
            shown.save_screenshot(str(options.picture))
    except NoPictureError as error:
        sys.exit(str(error))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
