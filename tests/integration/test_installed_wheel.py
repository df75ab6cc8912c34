"""A wheel, installed without the repository: campaigns fly from any folder, by the same code."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from skillwing.evaluation.campaign.flight_code import flight_code

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
ROOT = Path(__file__).parents[2]
FLIES = """
import json, sys
from skillwing.evaluation.campaign.flight_code import PACKAGE, flight_code
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.judged_flight import fly
from skillwing.evaluation.flights.plan import FlightPlan

plan = FlightPlan(mission="mapping", world="courtyard", seed=0, condition=Condition.NONE, alternative=True,
                  options={"instead": "land"}, label="abort")
result = fly(plan, longest=0.5)
print(json.dumps({"package": str(PACKAGE[0]), "digest": flight_code().digest, "error": result.error}))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that a wheel of the repository was unpacked into."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(folder)]
    subprocess.run([*build, str(ROOT)], check=True, capture_output=True)
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as file:
        file.extractall(folder / "site")
    keep_compiled_loops(folder / "site")
    return folder / "site"


def keep_compiled_loops(site: Path) -> None:
    """Take the machine code of the simulator's loops from the repository: Numba knows it by the age of their files.

    Without it the flight would compile for six seconds.
    """
    for code in ROOT.glob("sim_mujoco/skillwing/**/__pycache__/*.nb[ic]"):
        folder = site / code.parent.relative_to(ROOT / "sim_mujoco")
        source = code.parent.parent / f"{code.name.partition('.')[0]}.py"
        if source.is_file():
            folder.mkdir(exist_ok=True)
            shutil.copy2(code, folder)
            shutil.copystat(source, folder.parent / source.name)


def test_an_installed_wheel_flies_from_any_folder_by_the_same_code(wheel: Path, tmp_path: Path) -> None:
    libraries = sysconfig.get_path("purelib")
    # -S leaves out the .pth file of the editable installation, and with it the repository.
    code = f"import sys; sys.path[:0] = [{str(wheel)!r}, {libraries!r}]\n{FLIES}"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-S", "-c", code], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True
    )
    found = json.loads(done.stdout.splitlines()[-1])
    assert found == {"package": str(wheel / "skillwing"), "digest": flight_code().digest, "error": ""}
