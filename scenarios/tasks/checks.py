"""What is wrong among tasks that their schema cannot see.

A problem is where it stands in the file and a sentence, so that an editor finds it.
"""

import difflib
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from scenarios.tasks.task import Follow, Open, Place, Task


@dataclass(frozen=True, slots=True)
class Problem:
    """What is wrong; at: keys and indices of where it stands in the file."""

    at: tuple[str | int, ...]
    text: str


def nearest(word: str, known: Iterable[str]) -> str:
    """Return the question for the nearest known word, "" where none is near."""
    found = difflib.get_close_matches(word, list(known), 1)
    return f"; did you mean {found[0]!r}?" if found else ""


def order_problems(tasks: Sequence[Task]) -> Iterator[Problem]:
    """Yield tasks of one name, and those that come after what there is not."""
    names = [task.name for task in tasks]
    for n, task in enumerate(tasks):
        if task.name in names[:n]:
            text = f"Two tasks are named {task.name!r}; give each its own."
            yield Problem(("tasks", n, "name"), text)
        for before in task.after:
            if before not in names[:n]:
                text = (
                    f"The task {task.name!r} comes after {before!r}, which is no task "
                    f"before it{nearest(before, names[:n])}"
                )
                yield Problem(("tasks", n, "after"), text)


def place_problems(
    tasks: Sequence[Task], landmarks: Collection[str]
) -> Iterator[Problem]:
    """Yield places that a head does not have."""
    for n, task in enumerate(tasks):
        for key, place in _places_of(task):
            if isinstance(place, str) and place not in landmarks:
                text = (
                    f"The task {task.name!r} names the place {place!r}, which this "
                    f"head does not have{nearest(place, landmarks)}"
                )
                yield Problem(("tasks", n, key), text)


def sentence(problem: Problem) -> str:
    """Return what is wrong with its full stop."""
    end = "" if problem.text.endswith((".", "?")) else "."
    return problem.text + end


def _places_of(task: Task) -> Iterator[tuple[str, Place]]:
    """Yield the places that a task names, with the keys they stand at."""
    if isinstance(task, Follow):
        for ring in task.rings:
            yield "rings", ring.place
    elif isinstance(task, Open):
        yield "start", task.start
        yield "end", task.end
    else:
        place: Place | None = getattr(task, "place", None)
        if place is not None:
            yield "place", place
