"""The mission process of `recovery.py`: flies the mapping mission once for each question.

recovery_system.py starts it: recovery_mission.py ENDPOINT ROBOT SKILLSET_FILE
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from peer_process import serve

from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl import load
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.processes.node_host import SWITCH_INTERVAL

PATIENCE = 60.0


def main() -> None:
    """Fly until standard input ends."""
    endpoint, robot, file = sys.argv[1:]
    skillset = load(Path(file))
    sys.setswitchinterval(SWITCH_INTERVAL)

    def fly(question: dict[str, Any]) -> dict[str, Any]:
        bus = ZenohBus("mission", robot, endpoint)
        node = MissionNode(MISSION, skillset, MISSION.read_options({}))
        node.attach(bus)
        over = bus.run_until(lambda: node.over, PATIENCE)
        bus.close()
        return {"over": over, "phase": str(node.status.phase)}

    serve(fly)


if __name__ == "__main__":
    main()
