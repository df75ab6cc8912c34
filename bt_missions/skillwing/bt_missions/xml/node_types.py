"""All tags of tree files."""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.bt_missions.xml.conditions import LOOKING
from skillwing.bt_missions.xml.flow_control import FLOW_CONTROL
from skillwing.bt_missions.xml.node_type import NodeType
from skillwing.bt_missions.xml.plans import PLANNING
from skillwing.bt_missions.xml.skills import skill_types
from skillwing.bt_missions.xml.structure import STRUCTURE
from skillwing.dsl.model import Skillset


def node_types(skillset: Skillset) -> Mapping[str, NodeType]:
    """Node types by tag: one per skill, and those of all robots. A skill never replaces another tag of its name."""
    own = (*STRUCTURE, *FLOW_CONTROL, *LOOKING, *PLANNING)
    return {each.tag: each for each in (*skill_types(skillset), *own)}
