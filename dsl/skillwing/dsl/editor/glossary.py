"""Glossary: the meaning of the words of each dialect, in a sentence or two of Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from skillwing.dsl.reading.dialect import dialect_of


@dataclass(frozen=True, slots=True)
class Glossary:
    """The keywords of a dialect, its built-in types, and the values that some keywords take, by keyword."""

    keywords: Mapping[str, str]
    types: Mapping[str, str]
    choices: Mapping[str, Mapping[str, str]]

    def meaning(self, word: str, behind: str = "") -> str | None:
        """The meaning of a word. behind: the keyword of which it may be a value."""
        return self.choices.get(behind, {}).get(word) or self.keywords.get(word) or self.types.get(word)


_SKILLSET_KEYWORDS: Mapping[str, str] = {
    "skillset": "`skillset NAME { ... }`: everything a robot, or one of its subsystems, can do. A file holds one.",
    "type": "`type Name { field: T ... }`: a structure.",
    "enum": "`enum Name { A B C }`: one of the values.",
    "data": "`data { name: T [unit] in 0.0..5.0 period=0.1 }`: what the functional layer publishes. "
    "`data=( ... )`: a predicate over data and inputs, false while one of the data is stale.",
    "period": "The promised publishing period in seconds. After three of them without a value a datum is stale.",
    "in": "`in 0.1..5.0`: the range of a number; both bounds belong to it.",
    "resource": "`resource name { initial A  A -> B }`: a state machine that skills and the functional layer share. "
    "`resource=( ... )`: a predicate over states.",
    "state": "`state { A B }`: the states of a resource, where the transitions alone do not say.",
    "initial": "The state in which a resource starts.",
    "extern": "A transition that only the functional layer takes; skills take all others.",
    "event": "`event name { guard resource=( ... ) effect { ... } }`: extern transitions that fire together.",
    "guard": "What has to hold for an event to fire.",
    "skill": "`skill name { ... }`: one capability of the robot, with what it needs, takes and may end with.",
    "input": "`input { name: T }`: the parameters of a goal.",
    "modifiable": "`input { name: T modifiable }`: an input that a client can change while the goal runs.",
    "output": "`output { name: T }`: what a result carries.",
    "progress": "`progress=0.5 { name: T }`: feedback each 0.5 s while the skill runs.",
    "deadline": "The longest run in seconds.",
    "dispatch_timeout": "The longest time in seconds that `on_dispatch` may take.",
    "owner_lost": "`owner_lost=continue`: what becomes of a goal when the client that started it is gone.",
    "effect": "`effect { name: resource -> STATE }`: named changes, each applied as a whole or not at all.",
    "precondition": "`precondition { name: resource=( ... )  success effect }`: what has to hold to start. "
    "The effect of the start is applied in the same atomic step.",
    "success": "In `precondition`: the effect of the start. In `result`: a way to end well.",
    "failure": "In `precondition`: the effect of a refusal. In `result`: a way to fail.",
    "invariant": "`invariant { name: resource=( ... ) violation=effect }`: what has to hold while the skill runs.",
    "violation": "The effect that is applied when the invariant breaks.",
    "result": "`result { success NAME: apply=effect }`: the ways to end.",
    "apply": "The effect that is applied.",
    "post": "`post resource=( ... )`: what has to hold after the effect, judged in the same atomic step.",
    "interrupt": "`interrupt { apply=effect timeout=2.0 }`: what is applied once an interrupted skill has stopped.",
    "timeout": "After how many seconds an interruption is forced.",
    "lost": "`lost { apply=effect }`: what happens to resources when the skill's manager dies.",
    "and": "Both sides hold.",
    "or": "At least one side holds.",
    "not": "The predicate does not hold.",
    "true": "The `bool` that is true.",
    "false": "The `bool` that is false.",
}

_SKILLSET_TYPES: Mapping[str, str] = {
    "bool": "`true` or `false`.",
    "string": 'A text, written `"like this"`.',
    "float32": "A number in single precision; NaN and infinity are refused.",
    "float64": "A number in double precision; NaN and infinity are refused.",
} | {
    f"{sign}int{bits}": f"A whole number from {low} to {high}."
    for bits in (8, 16, 32, 64)
    for sign, low, high in (("", -(2 ** (bits - 1)), 2 ** (bits - 1) - 1), ("u", 0, 2**bits - 1))
}

_OWNER_POLICIES: Mapping[str, str] = {
    "interrupt": "The goal is interrupted. So it is where nothing is said.",
    "continue": "The goal goes on.",
}

_RL_KEYWORDS: Mapping[str, str] = {
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

_BY_GRAMMAR = {
    "skillset/skillset.lark": Glossary(_SKILLSET_KEYWORDS, _SKILLSET_TYPES, {"owner_lost": _OWNER_POLICIES}),
    "rl/rl.lark": Glossary(_RL_KEYWORDS, {}, {}),
}


def glossary_of(file: str) -> Glossary:
    """The glossary of the dialect in which a file of that name is written."""
    return _BY_GRAMMAR[dialect_of(file).grammar]
