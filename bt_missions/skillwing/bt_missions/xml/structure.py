"""Controls and decorators: BehaviorTree.CPP's names for the nodes of py_trees and `subtrees/`.

`Sequence` and `Fallback` continue with the child that runs. The `Reactive` ones tick every child again at each tick. A
`Parallel` here ends with the first child that fails.
"""

from __future__ import annotations

from collections.abc import Mapping

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import FailureIsSuccess, Inverter, Repeat, Retry, SuccessIsFailure, SuccessIsRunning

from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside
from skillwing.bt_missions.subtrees.decorators import Deadline
from skillwing.bt_missions.subtrees.lease import DEFAULT_PATIENCE, WithLease
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.bt_missions.subtrees.pausing import Pausable, StateChange, WhileGranted
from skillwing.bt_missions.xml.node_type import Category, NodeConfig, NodeType, Port, PortError, milliseconds_text
from skillwing.bt_missions.xml.values import attribute_text


def _make_while_granted(config: NodeConfig) -> Behaviour:
    def change(value: object) -> StateChange:
        words = str(value).split()
        if len(words) != 2:
            raise PortError(f"`ended_by` is `{value}`; it takes a resource and one of its states.")
        return StateChange(*words)

    resource, states = config.text("resource"), config.words("states")
    return WhileGranted(
        config.name,
        config.context,
        config.children[0],
        resource=resource,
        states=states,
        patience=config.number("patience"),
        ended_by=config.value("ended_by", change, StateChange(resource, next(iter(states), ""))),
    )


def _describe_while_granted(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, WhileGranted):
        return None
    return {
        "resource": node.resource,
        "states": " ".join(node.states),
        "patience": attribute_text(node.patience),
        "ended_by": " ".join(node.ended_by),
    }


def _make_pausable(config: NodeConfig) -> Behaviour:
    condition, meanwhile, body = config.children
    return Pausable(config.name, config.context, condition, meanwhile, body)


def _make_with_lease(config: NodeConfig) -> Behaviour:
    lease, body, *stay = config.children
    if not isinstance(lease, SkillAction):
        raise PortError(f"The first child of `{config.name}` has to be a skill: its running goal is the lease.")
    return WithLease(config.name, config.context, lease, body, *stay, patience=config.number("patience"))


def _describe_with_lease(node: Behaviour) -> Mapping[str, str] | None:
    return {"patience": attribute_text(node.patience)} if isinstance(node, WithLease) else None


HOLDING = (
    NodeType(
        "WithLease",
        Category.CONTROL,
        _make_with_lease,
        _describe_with_lease,
        (Port("patience", "longest wait for the lease, in seconds", "double", attribute_text(DEFAULT_PATIENCE)),),
        children=(2, 3),
    ),
    NodeType(
        "WhileGranted",
        Category.DECORATOR,
        _make_while_granted,
        _describe_while_granted,
        (
            Port("resource", "name of the resource; skills that need it are held in all other states"),
            Port("states", "states in which the skills may run"),
            Port("patience", "longest hold, in seconds of robot time", "double"),
            Port("ended_by", "a resource and a state; this change during a hold ends the mission"),
        ),
    ),
    NodeType(
        "Pausable",
        Category.CONTROL,
        _make_pausable,
        lambda node: {} if isinstance(node, Pausable) else None,
        children=(3,),
    ),
)


ALL = -1


def _sequence(tag: str, *, memory: bool) -> NodeType:
    return NodeType(
        tag,
        Category.CONTROL,
        make=lambda config: Sequence(config.name, memory=memory, children=list(config.children)),
        describe=lambda node: {} if type(node) is Sequence and node.memory == memory else None,
        standard=True,
    )


def _fallback(tag: str, *, memory: bool) -> NodeType:
    return NodeType(
        tag,
        Category.CONTROL,
        make=lambda config: Selector(config.name, memory=memory, children=list(config.children)),
        describe=lambda node: {} if type(node) is Selector and node.memory == memory else None,
        standard=True,
    )


def _make_parallel(config: NodeConfig) -> Behaviour:
    needed = config.count("success_count")
    if config.count("failure_count") != 1:
        config.problems.append("`failure_count` has to be 1: a parallel ends with the first child that fails.")
    if needed == 1:
        policy: ParallelPolicy.Base = ParallelPolicy.SuccessOnOne()
    elif needed in (ALL, len(config.children)):
        policy = ParallelPolicy.SuccessOnAll()
    else:
        policy = ParallelPolicy.SuccessOnAll()
        config.problems.append(f"`success_count` is {needed}; it takes 1, or -1 for all children.")
    return Parallel(config.name, policy=policy, children=list(config.children))


def _describe_parallel(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, Parallel) or isinstance(node.policy, ParallelPolicy.SuccessOnSelected):
        return None
    one = isinstance(node.policy, ParallelPolicy.SuccessOnOne)
    return {"success_count": "1" if one else str(ALL), "failure_count": "1"}


def _make_alongside(config: NodeConfig) -> Behaviour:
    *companions, until = config.children
    return alongside(config.name, *companions, until=until)


def _describe_alongside(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, Parallel) or not isinstance(node.policy, ParallelPolicy.SuccessOnSelected):
        return None
    return {} if list(node.policy.children) == node.children[-1:] else None


def _make_on_ending(config: NodeConfig) -> Behaviour:
    attempt, then = config.children
    return OnEnding(config.name, attempt, config.words("endings"), then)


def _make_timeout(config: NodeConfig) -> Behaviour:
    return Deadline(config.name, config.context, config.seconds("msec"), config.children[0])


def _describe_timeout(node: Behaviour) -> Mapping[str, str] | None:
    return {"msec": milliseconds_text(node.seconds)} if isinstance(node, Deadline) else None


def _make_retry(config: NodeConfig) -> Behaviour:
    attempts = config.count("num_attempts")
    if attempts < 1:
        # BehaviorTree.CPP would try for ever, so that a node after it would never start.
        config.problems.append(f"`num_attempts` is {attempts}; a mission has to end: it takes 1 or more.")
    return Retry(config.name, config.children[0], num_failures=attempts)


def _decorator(tag: str, kind: type[FailureIsSuccess | Inverter | SuccessIsFailure | SuccessIsRunning]) -> NodeType:
    return NodeType(
        tag,
        Category.DECORATOR,
        make=lambda config: kind(config.name, config.children[0]),
        describe=lambda node: {} if type(node) is kind else None,
        standard=True,
    )


STRUCTURE = (
    _sequence("Sequence", memory=True),
    _sequence("ReactiveSequence", memory=False),
    _fallback("Fallback", memory=True),
    _fallback("ReactiveFallback", memory=False),
    NodeType(
        "Parallel",
        Category.CONTROL,
        _make_parallel,
        _describe_parallel,
        (
            Port("success_count", "number of children that have to succeed: 1, or -1 for all", "int", "-1"),
            Port("failure_count", "number of failed children with which it fails: 1", "int", "1"),
        ),
        standard=True,
    ),
    NodeType(
        "ParallelAll",
        Category.CONTROL,
        make=lambda config: ParallelAll(config.name, config.children),
        describe=lambda node: {} if isinstance(node, ParallelAll) else None,
        standard=True,
    ),
    # Not a standard node: a companion that succeeds does not end it.
    NodeType("Alongside", Category.CONTROL, _make_alongside, _describe_alongside),
    NodeType(
        "OnEnding",
        Category.CONTROL,
        _make_on_ending,
        lambda node: {"endings": " ".join(node.endings)} if isinstance(node, OnEnding) else None,
        (Port("endings", "endings of a skill in the first child, such as `NR S_BLOCKED`, that start the second"),),
        children=(2,),
    ),
    *HOLDING,
    _decorator("Inverter", Inverter),
    _decorator("ForceSuccess", FailureIsSuccess),
    _decorator("ForceFailure", SuccessIsFailure),
    _decorator("KeepRunningUntilFailure", SuccessIsRunning),
    NodeType(
        "RetryUntilSuccessful",
        Category.DECORATOR,
        _make_retry,
        describe=lambda node: {"num_attempts": str(node.num_failures)} if isinstance(node, Retry) else None,
        ports=(Port("num_attempts", "number of attempts, 1 or more", "int"),),
        standard=True,
    ),
    NodeType(
        "Repeat",
        Category.DECORATOR,
        make=lambda config: Repeat(config.name, config.children[0], num_success=config.count("num_cycles")),
        describe=lambda node: {"num_cycles": str(node.num_success)} if isinstance(node, Repeat) else None,
        ports=(Port("num_cycles", "number of successes; -1 for ever", "int"),),
        standard=True,
    ),
    NodeType(
        "Timeout",
        Category.DECORATOR,
        _make_timeout,
        _describe_timeout,
        (Port("msec", "limit in milliseconds of robot time; then the child is halted and this fails", "unsigned"),),
        standard=True,
    ),
)
