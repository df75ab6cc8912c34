"""All tags of tree files."""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.bt_missions.xml.conditions import LOOKING
from skillwing.bt_missions.xml.flow_control import FLOW_CONTROL
from skillwing.bt_missions.xml.installed_nodes import installed_nodes
from skillwing.bt_missions.xml.node_type import NodeType
from skillwing.bt_missions.xml.plans import PLANNING
from skillwing.bt_missions.xml.skills import skill_types
from skillwing.bt_missions.xml.structure import STRUCTURE
from skillwing.dsl.model import Skillset


def node_types(skillset: Skillset) -> Mapping[str, NodeType]:
    """Node types by tag: those of other packages, one per skill, and our own. Of two with one name the last counts."""
    own = (*STRUCTURE, *FLOW_CONTROL, *LOOKING, *PLANNING)
    return {each.tag: each for each in (*installed_nodes(), *skill_types(skillset), *own)}
