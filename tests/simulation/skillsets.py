"""Simulated skillsets: small, and each made for certain errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from skillwing.dsl import parse
from skillwing.dsl.model import Skill, Skillset


@dataclass(frozen=True)
class Subject:
    """A skillset, and the facts that hold in any run.

    exclusive: state of each exclusive resource exactly while one grant holds it. data: two values of each datum, with
    which guards hold and fail.
    """

    skillset: Skillset
    exclusive: Mapping[str, str]
    data: Mapping[str, tuple[float, float]]

    @cached_property
    def takes(self) -> dict[str, frozenset[str]]:
        """Exclusive resources that the start effect of each skill takes."""
        return {skill.name: self._taken_by(skill) for skill in self.skillset.skills}

    @cached_property
    def extern(self) -> tuple[tuple[str, str], ...]:
        """Resources, each with every state to which the functional layer may try to bring it."""
        return tuple(
            (resource.name, state)
            for resource in self.skillset.resources
            if resource.name not in self.exclusive
            for state in resource.states
        )

    def _taken_by(self, skill: Skill) -> frozenset[str]:
        transitions = skill.transitions(skill.preconditions.success)
        return frozenset(name for name, state in transitions if self.exclusive.get(name) == state)


EXCLUSIVE = Subject(
    parse(
        """
        skillset exclusive {
            data { battery: float64 [%] period=1.0 }
            resource authority { initial ON  extern ON -> OFF  extern OFF -> ON }
            resource axes { initial FREE  FREE -> USED  USED -> FREE }
            skill move {
                progress=0.5 { left: float64 [m] }
                input { speed: float64 [m/s] in 0.1..3.0 = 1.0 modifiable }
                output { at: float64 [m] }
                effect { take: axes -> USED  release: axes -> FREE }
                precondition {
                    authority: resource=(authority == ON)
                    free: resource=(axes == FREE)
                    charged: data=(battery > 15.0)
                    success take
                }
                invariant {
                    authority: resource=(authority == ON) violation=release
                    charged: data=(battery > 10.0) violation=release
                }
                interrupt { apply=release timeout=1.0 }
                result { success DONE: apply=release  failure STUCK: apply=release post resource=(authority == ON) }
            }
            skill turn {
                deadline=3.0
                effect { take: axes -> USED  release: axes -> FREE }
                precondition { free: resource=(axes == FREE)  success take }
                invariant { authority: resource=(authority == ON) violation=release }
                interrupt { apply=release timeout=0.5 }
                result { success ALIGNED: apply=release }
            }
        }
        """
    ),
    exclusive={"axes": "USED"},
    data={"battery": (80.0, 5.0)},
)

CHAIN = Subject(
    parse(
        """
        skillset chain {
            resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
            resource sensor { initial IDLE  IDLE -> LIVE  LIVE -> IDLE }
            resource chart { initial IDLE  IDLE -> LIVE  LIVE -> IDLE }
            resource pilot { initial IDLE  IDLE -> LIVE  LIVE -> IDLE }
            event storm { guard resource=(power == ON)  effect { power -> OFF } }
            skill sense {
                owner_lost=continue
                effect { take: sensor -> LIVE  release: sensor -> IDLE }
                precondition { free: resource=(sensor == IDLE)  success take }
                invariant { power: resource=(power == ON) violation=release }
                interrupt { apply=release timeout=0.5 }
                result { success END: apply=release }
            }
            skill map {
                effect { take: chart -> LIVE  release: chart -> IDLE }
                precondition { sees: resource=(sensor == LIVE and chart == IDLE)  success take }
                invariant { sees: resource=(sensor == LIVE) violation=release }
                interrupt { apply=release timeout=0.5 }
                result { success END: apply=release }
            }
            skill fly {
                effect { take: pilot -> LIVE  release: pilot -> IDLE }
                precondition { knows: resource=(chart == LIVE and pilot == IDLE)  success take }
                invariant { knows: resource=(chart == LIVE) violation=release }
                interrupt { apply=release timeout=1.0 }
                result { success THERE: apply=release post resource=(chart == LIVE)  failure BLOCKED: apply=release }
            }
        }
        """
    ),
    exclusive={"sensor": "LIVE", "chart": "LIVE", "pilot": "LIVE"},
    data={},
)

LEAK = Subject(
    parse(
        """
        skillset leak {
            resource lid {
                state { SHUT OPEN JAMMED }
                initial SHUT
                extern SHUT -> OPEN
                extern OPEN -> SHUT
                extern * -> JAMMED
                extern JAMMED -> SHUT
            }
            resource arm { initial FREE  FREE -> USED  USED -> FREE  USED -> DIRTY  DIRTY -> FREE }
            skill grasp {
                dispatch_timeout=0.5
                effect { take: arm -> USED  release: arm -> FREE  spoil: arm -> DIRTY }
                precondition { free: resource=(arm == FREE)  success take }
                invariant { lid: resource=(lid != JAMMED) violation=spoil }
                interrupt { apply=release timeout=0.5 }
                lost { apply=spoil }
                result { success HELD: apply=release post resource=(lid == OPEN)  failure DROPPED: apply=spoil }
            }
            skill wash {
                deadline=2.0
                effect { begin {}  clean: arm -> FREE }
                precondition { dirty: resource=(arm == DIRTY)  success begin }
                interrupt { apply=begin timeout=0.5 }
                result { success CLEAN: apply=clean }
            }
        }
        """
    ),
    exclusive={"arm": "USED"},
    data={},
)

STREAMS = Subject(
    parse(
        """
        skillset streams {
            data { link: float64 [Mbit/s] period=0.5  depth: float64 [m] period=1.0 }
            resource camera { initial FREE  FREE -> USED  USED -> FREE }
            resource radio { initial FREE  FREE -> USED  USED -> FREE }
            skill stream {
                progress=0.5 { rate: float64 [Hz] }
                effect { take { camera -> USED  radio -> USED }  release { camera -> FREE  radio -> FREE } }
                precondition { free: resource=(camera == FREE and radio == FREE)  linked: data=(link > 1.0)
                               success take }
                invariant { linked: data=(link > 0.5) violation=release }
                interrupt { apply=release timeout=1.0 }
                result { failure FPS_LOST: apply=release }
            }
            skill look {
                effect { take: camera -> USED  release: camera -> FREE }
                precondition { free: resource=(camera == FREE)  success take }
                invariant { deep: data=(depth > 0.5) violation=release }
                interrupt { apply=release timeout=1.0 }
                result { success SEEN: apply=release }
            }
            skill talk {
                owner_lost=continue
                effect { take: radio -> USED  release: radio -> FREE }
                precondition { free: resource=(radio == FREE)  success take }
                interrupt { apply=release timeout=0.5 }
                result { success SAID: apply=release post data=(link > 1.0) }
            }
        }
        """
    ),
    exclusive={"camera": "USED", "radio": "USED"},
    data={"link": (5.0, 0.1), "depth": (3.0, 0.2)},
)

SUBJECTS: Mapping[str, Subject] = {each.skillset.name: each for each in (EXCLUSIVE, CHAIN, LEAK, STREAMS)}
