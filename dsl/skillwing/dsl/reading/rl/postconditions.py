"""Postconditions of `.rl` files, which are evaluated before the effect of their result.

In a skillset a postcondition is evaluated after the effect, in the same atomic step. For resources that the effect
leaves alone this is the same. What a postcondition requires of the others is left out. So no end is refused that is
valid in the `.rl` file.
"""

from __future__ import annotations

from collections.abc import Collection

from skillwing.dsl.expressions import And, Expression, Implies, Not, Or, references


def names_in(expression: Expression) -> frozenset[str]:
    """The names in an expression: of resources and of states."""
    return frozenset(name.path for name in references(expression))


def without(expression: Expression, changed: Collection[str]) -> Expression | None:
    """The part of a condition that does not depend on the changed resources; None if nothing is left.

    It holds whenever the whole condition holds.
    """
    found = _part(expression, frozenset(changed), True)
    return None if isinstance(found, bool) else found


def _part(expression: Expression, changed: frozenset[str], positive: bool) -> Expression | bool:
    """A condition that follows from the expression, or from which it follows if it is not `positive`."""
    match expression:
        case Not(operand):
            return _negated(_part(operand, changed, not positive))
        case And(left, right):
            return _joined(_part(left, changed, positive), _part(right, changed, positive))
        case Or(left, right):
            return _either(_part(left, changed, positive), _part(right, changed, positive))
        case Implies(left, right):
            condition, consequence = _part(left, changed, not positive), _part(right, changed, positive)
            if isinstance(condition, bool) or isinstance(consequence, bool):
                return _either(_negated(condition), consequence)
            return Implies(condition, consequence)
        case _:
            return expression if changed.isdisjoint(names_in(expression)) else positive


def _negated(condition: Expression | bool) -> Expression | bool:
    return not condition if isinstance(condition, bool) else Not(condition)


def _joined(left: Expression | bool, right: Expression | bool) -> Expression | bool:
    if isinstance(left, bool):
        return right if left else False
    if isinstance(right, bool):
        return left if right else False
    return And(left, right)


def _either(left: Expression | bool, right: Expression | bool) -> Expression | bool:
    if isinstance(left, bool):
        return True if left else right
    if isinstance(right, bool):
        return True if right else left
    return Or(left, right)
