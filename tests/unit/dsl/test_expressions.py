"""Laws of predicates: how they are judged and how they print."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl.expressions import (
    And,
    Comparison,
    Environment,
    Expression,
    Implies,
    Literal,
    Name,
    NamedValue,
    Not,
    Or,
    UnboundNameError,
    evaluate,
    names_used,
    to_text,
)
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.parser import parse_file

numbers = st.integers(-(10**9), 10**9) | st.floats(-1e99, 1e99)
states = st.sampled_from(["FREE", "USED", "BROKEN"])
resource_names = st.sampled_from(["axes", "sensor"])
data_names = st.sampled_from(["battery", "height", "wind"])

on_states = st.builds(
    Comparison,
    st.sampled_from(["==", "!="]),
    resource_names.map(lambda name: Name(name, "resource")),
    states.map(NamedValue),
)
on_numbers = st.builds(
    Comparison,
    st.sampled_from(["==", "!=", "<", "<=", ">", ">="]),
    data_names.map(lambda name: Name(name, "data")),
    numbers.map(Literal),
)


def composed(leaves: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    return st.recursive(
        leaves,
        lambda inner: (
            st.builds(Not, inner)
            | st.builds(And, inner, inner)
            | st.builds(Or, inner, inner)
            | st.builds(Implies, inner, inner)
        ),
        max_leaves=12,
    )


predicates = composed(on_states | on_numbers | st.booleans().map(Literal))
state_environments = st.fixed_dictionaries({"axes": states, "sensor": states})
complete_data = st.fixed_dictionaries({"battery": numbers, "height": numbers, "wind": numbers})
environments = st.builds(Environment, state_environments, complete_data)


@given(predicates, predicates, environments)
def test_de_morgan(left: Expression, right: Expression, environment: Environment) -> None:
    assert evaluate(Not(And(left, right)), environment) == evaluate(Or(Not(left), Not(right)), environment)
    assert evaluate(Not(Or(left, right)), environment) == evaluate(And(Not(left), Not(right)), environment)


@given(predicates, predicates, environments)
def test_implication_is_or_not(left: Expression, right: Expression, environment: Environment) -> None:
    assert evaluate(Implies(left, right), environment) == evaluate(Or(Not(left), right), environment)


@given(predicates, environments, st.sets(data_names))
def test_a_predicate_over_an_absent_datum_is_false(
    predicate: Expression, environment: Environment, absent: set[str]
) -> None:
    known = {name: value for name, value in environment.data.items() if name not in absent}
    partial = Environment(environment.resources, known)
    if names_used(predicate, "data") & absent:
        assert not evaluate(predicate, partial)
        assert not evaluate(Not(predicate), partial)
    else:
        assert evaluate(predicate, partial) == evaluate(predicate, environment)


raw_names = st.sampled_from(["axes", "battery", "position.z", "FREE", "state", "initial"]).map(Name)
raw_operands = raw_names | (numbers | st.booleans() | st.text()).map(Literal)
raw_comparisons = st.builds(Comparison, st.sampled_from(["==", "!=", "<", "<=", ">", ">="]), raw_operands, raw_operands)


@given(composed(raw_comparisons | raw_operands))
def test_printed_text_reads_back_as_the_same_expression(expression: Expression) -> None:
    text = f"skillset s {{ skill k {{ precondition {{ p: data=({to_text(expression)}) }} }} }}"
    parsed = parse_file(text, "f")
    assert parsed.diagnostics == ()
    assert parsed.root is not None
    (skill,) = parsed.root.elements
    assert isinstance(skill, syntax.SkillSyntax)
    (section,) = skill.sections
    assert isinstance(section, syntax.PreconditionSection)
    assert section.checks[0].predicate.expression == expression


def test_only_needed_parentheses_are_printed() -> None:
    a, b, c = (Name(name) for name in "abc")
    assert to_text(Or(And(a, b), Not(c))) == "a and b or not c"
    assert to_text(And(Or(a, b), Not(And(a, c)))) == "(a or b) and not (a and c)"
    assert to_text(Implies(a, Implies(b, c))) == "a => b => c"
    assert to_text(Implies(Implies(a, b), c)) == "(a => b) => c"


def test_fields_of_mappings_and_of_objects() -> None:
    class Vector:
        z = 3.0

    above = Comparison(">", Name("position.z", "data"), Name("target.z", "input"))
    assert evaluate(above, Environment(data={"position": Vector()}, inputs={"target": {"z": 2.0}}))
    assert not evaluate(above, Environment(data={"position": {"z": 1.0}}, inputs={"target": {"z": 2.0}}))


def test_an_unbound_resource_is_an_error_and_not_false() -> None:
    name = Name("axes", "resource")
    try:
        evaluate(Comparison("==", name, NamedValue("FREE")), Environment())
    except UnboundNameError as error:
        assert error.name is name
    else:
        raise AssertionError("a missing resource was judged")
