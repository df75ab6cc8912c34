"""The words of the `.rl` dialect, each in a sentence for the reader who points at it."""

from __future__ import annotations

from collections.abc import Mapping

RL_KEYWORDS: Mapping[str, str] = {
    "include": '`include "FILE"`: another file.',
    "skillset": "`skillset NAME { ... }`: everything a robot, or one of its subsystems, can do. A file holds one.",
    "type": "`type Name`: a type that the robot's middleware knows.",
    "parameter": "`parameter name: T`: a value that is set once.",
    "data": "`data name: T period 0.5`: what the functional layer publishes.",
    "period": "A period, in seconds unless `ms` says otherwise.",
    "sec": "Seconds.",
    "ms": "Milliseconds.",
    "resource": "`resource name { state { A B }  initial A  transition all }`: a state machine that skills share.",
    "state": "`state { A B }`: the states of a resource.",
    "initial": "The state in which a resource starts.",
    "transition": "`transition { A -> B }`, or `transition all` for those between any two states.",
    "all": "Transitions between any two states.",
    "event": "`event name { guard ...  effect resource -> STATE }`: a change from outside the skills.",
    "guard": "What has to hold.",
    "effect": "`effect resource -> STATE`, or several changes in braces, applied as a whole or not at all.",
    "skill": "`skill name { ... }`: one capability of the robot, with what it needs, takes and may end with.",
    "input": "`input name: T`: the parameters of a goal.",
    "output": "`output name: T`: what a result carries.",
    "precondition": "`precondition name: resource == STATE`: what has to hold to start.",
    "start": "`start resource -> STATE`: what is applied at the start, in one step with the preconditions.",
    "invariant": "`invariant name { guard ...  effect ... }`: what has to hold while the skill runs, "
    "and what is applied when it breaks.",
    "progress": "`progress { period 1.0  message name: T }`: feedback while the skill runs.",
    "message": "`message name: T`: what the feedback carries.",
    "interrupt": "`interrupt { interrupting true  effect ... }`: what is applied after an interruption.",
    "interrupting": "Whether stopping takes time.",
    "success": "`success name { effect ... }`: a way to end well.",
    "failure": "`failure name { effect ... }`: a way to fail.",
    "postcondition": "What has to hold after the effect.",
    "and": "Both sides hold.",
    "or": "At least one side holds.",
    "not": "The predicate does not hold.",
    "true": "Holds always.",
    "false": "Never holds.",
}
