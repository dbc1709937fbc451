"""What must hold between ranks, whatever is on its way: the protocol's invariants.

For those who see all ranks at once: tests, the simulation. What one rank can see of
itself it checks alone (`Node.check`); docs/ranks.md lists both under their numbers.
"""

from collections import Counter
from collections.abc import Iterable, Sequence

from renderers.art.cells.cache import CellState
from renderers.art.ranks.directory import ON_DISK, Directory
from renderers.art.ranks.messages import CELL_KINDS, Message, MessageKind
from renderers.art.ranks.node import Node
from renderers.art.ranks.rays import P


def audit(
    nodes: Sequence[Node[P]],
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
    having: dict[int, list[Node[P]]] = {}
    if cells is None:
        for node in nodes:
            for cell in node.cache.cells():
                having.setdefault(cell, []).append(node)
        cells = having.keys() | {c for node in nodes for c in node.directory.entries}
    else:
        cells = list(cells)
        for cell in cells:
            having[cell] = [n for n in nodes if n.cache.state(cell)]
    for cell in cells:
        home = nodes[nodes[0].directory.home(cell)].directory
        _owners(home, having.get(cell, []), cell, about.get(cell, []))
        _listed(home, having.get(cell, []), cell, about.get(cell, []))


def _owners(
    home: Directory, having: list[Node[P]], cell: int, flying: list[Message]
) -> None:
    owners = [node.rank for node in having if node.cache.owns(cell)]
    versions = {n.cache.version(cell) for n in having if n.cache.holds(cell)}
    assert len(versions) <= 1, f"cell {cell} is held as generations {versions} left it"
    listed = home.owner(cell)
    if listed == ON_DISK:
        assert not owners, f"cell {cell} is in the file, and yet {owners} own it"
        return
    assert owners, f"nobody owns cell {cell}"
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


def _listed(
    home: Directory, having: list[Node[P]], cell: int, flying: list[Message]
) -> None:
    leaving = {m.target for m in flying if m.kind is MessageKind.INVALIDATE}
    asking = {m.source for m in flying if m.kind is MessageKind.REQUEST}
    listed = home.listed(cell)
    counts = set()
    for node in having:
        # A pending cell counts once its request was handled, one that is here until
        # the word to drop it is under way.
        pending = node.cache.state(cell) is CellState.PENDING
        if node.rank not in (asking if pending else leaving):
            counts.add(node.rank)
    assert counts == listed, (
        f"cell {cell} is at ranks {sorted(counts)}, its home lists {sorted(listed)}"
    )


def _bounds(nodes: Sequence[Node[P]], about: dict[int, list[Message]]) -> None:
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
