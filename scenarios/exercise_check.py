"""What is wrong in an exercise that its schema cannot see: wrong names."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anatomy.abstract import SCENES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.variants import with_findings, with_variants
from anatomy.tissue import Label
from scenarios.coverage.sites import SIDES, SITE_NAMES
from scenarios.endoscope import Endoscope, tip_frame
from scenarios.tasks.checks import (
    Problem,
    nearest,
    order_problems,
    place_problems,
    sentence,
)
from scenarios.tasks.head_parts import PART_NAMES, Head
from scenarios.tasks.rules import rule_of
from scenarios.tasks.situation import Situation
from scenarios.tasks.task import Follow, Inject, KeepAway, Remove, Survey, Task
from system import UserError
from system.line_finder import toml_line

if TYPE_CHECKING:
    from scenarios.scenario import Scenario

TISSUES = tuple(label.name.lower().replace("_", " ") for label in Label)
"""Names of `surgery.patient.VolumeLedger`."""

SITES = (*SITE_NAMES, *(f"{site}, {side}" for site in SITE_NAMES for side in SIDES))
"""Names of sites of mucosa, of both sides together and of one."""

FAR_MM = 1e4
"""Far from every head, in each direction."""

ROLES = ("scope", "tool", "both hands", "patient")


@dataclass(frozen=True, slots=True)
class HeadNames:
    """Name what a head has: landmarks, hazards, walls of bone, sites of mucosa.

    hazards, walls, sites: None where nobody knows them.
    """

    landmarks: Collection[str]
    hazards: Collection[str] | None = None
    walls: Collection[str] | None = None
    sites: Collection[str] | None = None


def file_problems(
    scenario: "Scenario", others: Collection[str] = ()
) -> Iterator[Problem]:
    """Yield what is wrong whatever the head is; others: names of exercises."""
    yield from order_problems(scenario.tasks)
    tasks = [task.name for task in scenario.tasks]
    for n, task in enumerate(scenario.tasks):
        if isinstance(task, Remove):
            for name in task.tissues:
                yield from _unknown(("tasks", n, "tissues", name), "tissue", TISSUES)
            for name in task.parts:
                yield from _unknown(("tasks", n, "parts", name), "part", PART_NAMES)
        if isinstance(task, Survey):
            for name, percent in task.sites.items():
                site = ("tasks", n, "sites", name)
                yield from _unknown(site, "site", SITES)
                if not 0.0 < percent <= 100.0:
                    text = f"A site is seen by 0 to 100 percent, got {percent:g}."
                    yield Problem(site, text)
        if isinstance(task, Follow):
            for ring in task.rings:
                if abs(np.linalg.norm(ring.axis) - 1.0) > 1e-2:
                    text = f"A ring's axis must be a unit vector, got {ring.axis}."
                    yield Problem(("tasks", n, "rings"), text)
    for name in scenario.marks.tasks:
        yield from _unknown(("pass", "tasks"), "task", tasks, name)
    yield from _start_problems(scenario)
    yield from _catalogue_problems(scenario)
    for name in scenario.needs:
        if name not in others:
            yield from _unknown(("needs",), "exercise", others, name)


def head_problems(scenario: "Scenario", head: HeadNames) -> Iterator[Problem]:
    """Yield what names places, hazards, walls or sites that a head does not have."""
    for name in scenario.targets:
        yield from _unknown(("targets",), "landmark", head.landmarks, name)
    yield from place_problems(scenario.tasks, head.landmarks)
    for n, task in enumerate(scenario.tasks):
        if isinstance(task, KeepAway) and head.hazards is not None:
            for name in task.hazards:
                at = ("tasks", n, "hazards")
                yield from _unknown(at, "hazard", head.hazards, name)
        if isinstance(task, Remove) and head.walls is not None:
            for name in task.walls:
                yield from _unknown(("tasks", n, "walls", name), "wall", head.walls)
        if isinstance(task, Survey) and head.sites is not None:
            for name in task.sites:
                site = ("tasks", n, "sites", name)
                yield from _unknown(site, "site of this head's", head.sites)


def untouched_problems(
    tasks: Sequence[Task], head: Head, landmarks: Mapping[str, NDArray[np.float64]]
) -> Iterator[Problem]:
    """Yield tasks that ask for what the head lacks, or are done before they are begun.

    head: before anybody operated. landmarks: ``(3,)`` LPS mm by name, all that are
    named.
    """
    away = tip_frame(np.full(3, FAR_MM), np.array([0.0, 1.0, 0.0]))
    camera = Endoscope().camera(away, 0.0, (8, 8))
    idle = Situation(0.0, away[:3, 3], camera, head.distance)
    for n, task in enumerate(tasks):
        if isinstance(task, Remove):
            for name in task.parts:
                if head.part(name) is None:
                    text = f"This head has no {name!r}, which {task.name!r} names."
                    yield Problem(("tasks", n, "parts", name), text)
        rule = rule_of(task, landmarks, head)
        rule.step(idle, 0.0)
        if rule.progress >= 1.0 and not rule.is_kept:
            text = f"The task {task.name!r} is done before it is begun: {rule.lacks}"
            yield Problem(("tasks", n), text)


def refuse(file: Path, content: bytes, problems: Iterable[Problem]) -> None:
    """Raise UserError for the first problem, with file and line."""
    for problem in problems:
        raise UserError(told(file, content, problem))


def told(file: Path, content: bytes, problem: Problem) -> str:
    """Return a problem as a line: file, line, what is wrong."""
    line = toml_line(content.decode(), list(problem.at))
    return f"{file}, line {line}: {sentence(problem)}"


def _unknown(
    at: tuple[str | int, ...],
    what: str,
    known: Collection[str],
    name: str | None = None,
) -> Iterator[Problem]:
    """Yield a problem where a name, or the last key, is none of the known."""
    word = str(at[-1]) if name is None else name
    if word not in known:
        near = nearest(word, known) or f"; there are: {', '.join(sorted(known))}"
        yield Problem(at, f"There is no {what} {word!r}{near}")


def _start_problems(scenario: "Scenario") -> Iterator[Problem]:
    start = scenario.start
    if (start.tip_mm is None) != (start.axis is None):
        yield Problem(("start",), "A start has both a tip_mm and an axis, or neither.")
    elif start.axis is not None and not np.linalg.norm(start.axis) > 0.0:
        yield Problem(("start", "axis"), "The axis of the start has no length.")
    head = scenario.head
    has_polyps = head.polyps_right or head.polyps_left
    has_parameters = head.variants or has_polyps or head.disease or head.patients
    if (head.case or head.scene) and has_parameters:
        text = "Only a phantom is drawn and has variants and disease; leave them out."
        yield Problem(("head", "case" if head.case else "scene"), text)
    if head.scene:
        yield from _unknown(("head", "scene"), "scene", SCENES, head.scene)
    for key, give, words in (
        ("variants", with_variants, head.variants),
        ("disease", with_findings, head.disease),
    ):
        try:
            give(PhantomParameters(), words)
        except UserError as error:
            yield Problem(("head", key), str(error)[:1].upper() + str(error)[1:])


def _catalogue_problems(scenario: "Scenario") -> Iterator[Problem]:
    """Yield what names tools or metrics that there are not."""
    used = [(("tasks", n, "tool"), task.tool) for n, task in _injections(scenario)]
    if scenario.tools or used:
        from scenarios.instruments import INSTRUMENTS

        for name in scenario.tools:
            yield from _unknown(("tools",), "instrument", INSTRUMENTS, name)
        for at, name in used:
            yield from _unknown(at, "instrument", INSTRUMENTS, name)
    if scenario.marks.metrics:
        from scenarios.metrics import DEFINITIONS
        from scenarios.metrics.scope_view import OF_TARGETS

        known = {definition.name for definition in DEFINITIONS}
        for n, limit in enumerate(scenario.marks.metrics):
            row = ("pass", "metrics", n)
            # those of one hazard carry its name
            name = limit.name.partition(":")[0]
            yield from _unknown((*row, "name"), "metric", known, name)
            if limit.role:
                yield from _unknown((*row, "role"), "role", ROLES, limit.role)
            if limit.least is None and limit.most is None:
                text = f"The metric {limit.name!r} needs least, most or both."
                yield Problem(row, text)
            if name in OF_TARGETS and not scenario.targets:
                text = f"The metric {name!r} is measured for targets; name them."
                yield Problem((*row, "name"), text)


def _injections(scenario: "Scenario") -> Iterator[tuple[int, Inject]]:
    for n, task in enumerate(scenario.tasks):
        if isinstance(task, Inject):
            yield n, task
