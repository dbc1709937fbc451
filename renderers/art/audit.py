"""What must hold between ranks, whatever is on its way: the protocol's invariants.

For those who see all ranks at once: tests, the simulation. What one rank can see of
itself it checks alone (`Node.check`); docs/ranks.md lists both under their numbers.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from renderers.art.cache import CellState
from renderers.art.messages import CELL_KINDS, Message, MessageKind
from renderers.art.node import Node


def audit(
    nodes: Sequence[Node[Any]],
    flying: Iterable[Message],
    cells: Iterable[int] | None = None,
) -> None:
    """Raise AssertionError when an invariant of migrating cells is broken.

    flying: every message sent and not handled. cells: those to look at; None for all
    that anybody holds or lists.
    """
    about: dict[int, list[Message]] = {}
    for message in flying:
        if message.kind in CELL_KINDS:
            about.setdefault(message.cell, []).append(message)
    if about and all(node.is_finished for node in nodes):
        raise AssertionError(f"all ranks are done, and yet {about} are on their way")
    _bounds(nodes, about)
    if cells is None:
        held = {cell for node in nodes for cell in node.cache.cells()}
        cells = held | {cell for node in nodes for cell in node.directory.entries}
    for cell in cells:
        _owners(nodes, cell, about.get(cell, []))
        _listed(nodes, cell, about.get(cell, []))


def _owners(nodes: Sequence[Node[Any]], cell: int, flying: list[Message]) -> None:
    owners = [node.rank for node in nodes if node.cache.owns(cell)]
    assert owners, f"nobody owns cell {cell}"
    versions = {n.cache.version(cell) for n in nodes if n.cache.holds(cell)}
    assert len(versions) == 1, f"cell {cell} is held as generations {versions} left it"
    listed = nodes[nodes[0].directory.home(cell)].directory.owner(cell)
    assert listed in owners, f"cell {cell}: owner {listed} is listed, {owners} own it"
    for rank in owners:
        # One has accepted and the home does not know, or gave up and was not told yet.
        # Beyond three ranks both can happen at once: to an owner, to the next, to ...
        passing = any(
            (m.kind is MessageKind.ADOPTED and m.aux and m.source == rank)
            or (m.kind is MessageKind.INVALIDATE and m.target == rank)
            for m in flying
        )
        assert rank == listed or passing, f"cell {cell} is owned by {rank}, too"


def _listed(nodes: Sequence[Node[Any]], cell: int, flying: list[Message]) -> None:
    home = nodes[nodes[0].directory.home(cell)]
    leaving = {m.target for m in flying if m.kind is MessageKind.INVALIDATE}
    asking = {m.source for m in flying if m.kind is MessageKind.REQUEST}
    listed = home.directory.listed(cell)
    for node in nodes:
        state = node.cache.state(cell)
        if state is CellState.PENDING:
            counts = node.rank not in asking
        else:
            counts = node.cache.holds(cell) and node.rank not in leaving
        assert counts == (node.rank in listed), (
            f"rank {node.rank} has cell {cell} {state.name}, "
            f"its home lists {sorted(listed)}"
        )


def _bounds(nodes: Sequence[Node[Any]], about: dict[int, list[Message]]) -> None:
    data: Counter[int] = Counter()
    control: Counter[int] = Counter()
    for messages in about.values():
        for message in messages:
            kind = data if message.kind is MessageKind.DATA else control
            kind[message.target] += 1
    # Each rank has `most_pending` requests and as many wishes to drop a cell open. Of
    # a request one message is under way, and of a wish; one more where the old owner
    # is told to go while the adopter's copy is asked for.
    for node in nodes:
        most = node.most_pending
        assert data[node.rank] <= most, "more cells are coming than were asked for"
        assert control[node.rank] <= 2 * most * len(nodes), "too many messages"
