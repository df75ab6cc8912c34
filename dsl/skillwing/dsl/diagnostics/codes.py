"""Every problem the language reports: its code, its severity, a title, and an explanation with the way out.

A code never changes its meaning and is never reused; new ones are added at the end of their group.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal as OneOf
from typing import TypeAlias

Severity: TypeAlias = OneOf["error", "warning"]


@dataclass(frozen=True, slots=True)
class Code:
    """One kind of problem."""

    name: str
    severity: Severity
    title: str
    explanation: str


_TABLE = (
    # --- syntax
    Code(
        "SW001",
        "error",
        "missing closing bracket",
        "A block or a parenthesis is opened and never closed. The message names the block and the line it opens on.",
    ),
    Code(
        "SW002",
        "error",
        "unexpected word",
        "Something stands where the language has no place for it. The help says what may stand there.",
    ),
    Code(
        "SW003",
        "error",
        "misspelt word of the language",
        "A word resembles a word of the language that fits here, such as `precondtion` for `precondition`.",
    ),
    Code(
        "SW004",
        "error",
        "unreadable character",
        "A character that the language does not use, a string or a comment that is never closed.",
    ),
    Code(
        "SW005",
        "error",
        "missing or wrong punctuation",
        "A sign such as `:`, `=` or `->` is missing, or another one stands in its place.",
    ),
    Code(
        "SW006",
        "error",
        "not a skillset",
        "A file holds one skillset, `skillset NAME { ... }`, and nothing outside it.",
    ),
    # --- names
    Code("SW010", "error", "unknown resource", "No `resource` of this name is declared in the skillset."),
    Code(
        "SW011", "error", "unknown state", "The resource has no such state in its transitions or its `state { }` list."
    ),
    Code(
        "SW012",
        "error",
        "unknown effect",
        "The skill has no such effect; effects belong to the skill that declares them.",
    ),
    Code("SW013", "error", "unknown type", "The type is neither built in nor declared with `type` or `enum`."),
    Code(
        "SW014",
        "error",
        "unknown datum or input",
        "A `data=(...)` predicate names neither a datum nor an input of the skill.",
    ),
    Code("SW015", "error", "unknown field or value", "The structure has no such field, or the enum no such value."),
    Code("SW016", "error", "declared twice", "Two elements of one kind in one place have the same name."),
    Code("SW017", "error", "section given twice", "A skill has each of its sections at most once."),
    Code(
        "SW018",
        "error",
        "name not usable",
        "The name is a word of Python or starts with an underscore, so that no code could be generated for it.",
    ),
    Code(
        "SW019",
        "error",
        "names collide in generated code",
        "Two different names become the same Python class, for instance skills `go_to` and `goTo`.",
    ),
    # --- types, units, ranges
    Code(
        "SW020",
        "error",
        "comparison of different things",
        "The two sides of a comparison have different types, or the operator has no meaning for them.",
    ),
    Code("SW021", "error", "malformed unit", "Units are written like `[m]`, `[m/s]`, `[m/s^2]`, `[1/s]`, `[%]`."),
    Code(
        "SW022", "error", "impossible range", "A range stands on numbers only, runs from low to high and fits its type."
    ),
    Code(
        "SW023",
        "error",
        "default does not fit",
        "The default has another type than the field or lies outside its range.",
    ),
    Code(
        "SW024",
        "error",
        "type contains itself",
        "A structure that holds itself, directly or through others, has no size.",
    ),
    Code("SW025", "error", "not a duration", "Periods, timeouts and deadlines are seconds and greater than zero."),
    Code("SW026", "error", "impossible array", "The length of an array is at least one."),
    Code(
        "SW027",
        "error",
        "wrong kind of predicate",
        "`resource=(...)` speaks of resources only, `data=(...)` of data and inputs only; "
        "what needs both is written as two checks.",
    ),
    Code("SW028", "error", "not a predicate", "Only a boolean datum or input may stand without a comparison."),
    Code("SW029", "error", "nested too deeply", "A predicate or a type is nested beyond what anybody could read."),
    # --- resources
    Code("SW030", "error", "no single initial state", "A resource has exactly one `initial STATE`."),
    Code("SW031", "error", "unreachable state", "No chain of transitions leads from the initial state to this state."),
    # --- effects and events
    Code(
        "SW040",
        "error",
        "effect drives an extern transition",
        "Extern transitions belong to the functional layer. A skill may only take internal ones.",
    ),
    Code(
        "SW041",
        "error",
        "no such transition",
        "The resource has no transition into that state that could be taken here.",
    ),
    Code(
        "SW042",
        "error",
        "effect can never apply",
        "Where the skill applies the effect, the resource can only be in states that have no such transition.",
    ),
    Code(
        "SW043", "error", "resource changed twice", "An effect is one atomic step: it brings a resource to one state."
    ),
    Code(
        "SW044",
        "error",
        "event drives an internal transition",
        "Events are external; internal transitions belong to skills.",
    ),
    # --- logic
    Code(
        "SW050",
        "error",
        "precondition never holds",
        "No states of the resources named satisfy it: the skill can never start.",
    ),
    Code(
        "SW051",
        "error",
        "invariant never holds",
        "No states of the resources named satisfy it: the skill can never run.",
    ),
    Code(
        "SW052",
        "error",
        "postcondition never holds",
        "No states of the resources named satisfy it, or none after the effect.",
    ),
    Code(
        "SW053",
        "error",
        "invariant false from the start",
        "Whenever the preconditions hold and the start effect is applied, this invariant is false at once.",
    ),
    Code(
        "SW054",
        "error",
        "preconditions contradict each other",
        "Each can hold, all together cannot: the skill can never start.",
    ),
    Code(
        "SW055", "error", "guard never holds", "No states of the resources named satisfy it: the event can never fire."
    ),
    # --- results and ends
    Code(
        "SW060",
        "error",
        "no interrupt effect",
        "The results apply different effects, so the file has to say which one an interruption applies.",
    ),
    Code("SW062", "error", "half-marked results", "Either every result says `success` or `failure`, or none does."),
    # --- warnings
    Code(
        "SW080",
        "warning",
        "resource leak",
        "The skill can end with a resource still taken, and nothing in the skillset can bring it back.",
    ),
    Code("SW081", "warning", "unused effect", "Nothing applies the effect."),
    Code("SW082", "warning", "unused resource", "No skill and no event names the resource."),
    Code("SW083", "warning", "unused type", "Nothing has this type."),
    Code(
        "SW084",
        "warning",
        "start effect may not apply",
        "The preconditions admit a state from which the start effect has no transition; such a start would fail.",
    ),
    Code(
        "SW085",
        "warning",
        "invariant may be false from the start",
        "The preconditions admit a state in which the invariant is false; such a goal would end at once.",
    ),
    # --- files in ONERA's robot language
    Code(
        "SW090",
        "warning",
        "type that holds nothing",
        "The file names a type and does not say what it holds: a structure without fields.",
    ),
    Code(
        "SW091",
        "warning",
        "parameter read as something else",
        "A parameter of a skill is read as an input, one of the skillset as a datum.",
    ),
    Code(
        "SW092",
        "error",
        "nothing is included",
        "A file holds one whole skillset; `include` is not followed.",
    ),
    Code(
        "SW093",
        "warning",
        "postcondition of an interruption",
        "An interruption cannot fail, so its postcondition is not judged.",
    ),
    Code(
        "SW094",
        "warning",
        "interruption that changes nothing",
        "The results apply different effects and there is no `interrupt`, so an interruption applies none.",
    ),
    Code(
        "SW095",
        "warning",
        "postcondition judged after the effect",
        "A postcondition speaks of a resource that the effect of the same result changes.",
    ),
    Code(
        "SW096",
        "warning",
        "name of a postcondition",
        "Several postconditions are joined; their names are not kept.",
    ),
)

CODES = {code.name: code for code in _TABLE}
