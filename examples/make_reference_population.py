"""Make `scenarios/rubrics/populations/NAME.json`: metrics of generated runs of skill.

    python examples/make_reference_population.py first_flight
    python examples/make_reference_population.py --runs 5 --jobs 4   # all exercises
    python examples/make_reference_population.py hoops --keep RUNS --out here

No person flew these runs. Each follows a plan as a hand of a stated skill might: in
submovements of least jerk along the way, with pauses and ways back, off the planned way
by a slow wander, with tremor and the noise of an arm. The plan is the path that comes
with an exercise, or what `paravol.exercises.scripted_hand` does in it. The figures of
`SKILLS` are assumptions, chosen so that time and path differ between groups about as
much as published groups do (experts take half of novices' time and path); they are no
measurement of anybody. --keep leaves the recorded sessions in folders by group.
"""

import argparse
import json
import multiprocessing
import re
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from devices import ProbePath, Registration, load_probe_path
from paravol.exercises.scripted_hand import ScriptedHand
from paravol.inputs.jaw import Jaw
from paravol.inputs.pose_completer import AWAY_MM, PATH_WORK, path_instrument
from paravol.patient import PatientScene, load_patient, no_progress
from paravol.scoring.session_metrics import session_metrics
from paravol.sessions.session_setup import build_session, describe_session, operate_on
from scenarios import Sample, Scenario, load_scenario, tip_frame
from scenarios.bundle import EditRecord, EventRecord, SampleRecord, SessionRecorder
from scenarios.instrument_state import EMPTY_HAND
from scenarios.metrics import Metric, Settings
from scenarios.rubrics import load_rubric
from scenarios.rubrics.population import Group, Population, Quantiles
from system import whole_file

Floats = NDArray[np.float64]

EXERCISES = (
    "first_flight",
    "first_operation",
    "hoops",
    "path-following",
    "steady-hold",
    "centring",
)
"""Those with a path, and of the others those that a scope does alone in open air."""

SEED = 24
RUNS = 20
RATE_HZ = 100.0
SLOW_HZ, TREMOR_HZ = np.linspace(0.1, 1.0, 12), np.linspace(8.0, 12.0, 5)
ARM_MM = 0.05
"""Noise of an axis of the tip, as counts of an arm make it."""

SLOWER = 3.0
"""A scripted hand plans its way at 60 mm/s, which nobody flies at."""

BLIND = "breaches"
"""A generated hand wanders without seeing what is near: what it hurt tells nothing of
skill, and a band of injuries nobody should be shown."""

OUT = Path(__file__).parents[1] / "scenarios/rubrics/populations"
SOURCE = "generated runs, not people: examples/make_reference_population.py"


@dataclass(frozen=True, slots=True)
class Skill:
    """How a hand moves.

    pace: time by the planned path's. step_s: length of a submovement, of the planned
    path. pause_s: mean between two. back: share of submovements that go back.
    wander_mm, wander_deg: rms off the planned way. tremor_mm: rms of 8 to 12 Hz.
    spread: of all of these between runs, as standard deviation of their logarithms.
    """

    name: str
    pace: float
    step_s: float
    pause_s: float
    back: float
    wander_mm: float
    wander_deg: float
    tremor_mm: float
    spread: float


SKILLS = (
    Skill("expert", 1.0, 4.0, 0.05, 0.02, 0.15, 0.2, 0.03, 0.15),
    Skill("intermediate", 1.3, 2.0, 0.15, 0.08, 0.5, 0.6, 0.05, 0.22),
    Skill("novice", 1.6, 1.0, 0.3, 0.15, 1.1, 1.3, 0.08, 0.3),
)


def main() -> None:
    """Generate, measure, sum up, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("exercises", nargs="*", default=EXERCISES, help="names")
    parser.add_argument("--keep", type=Path, help="leave the sessions here, by group")
    parser.add_argument("--runs", type=int, default=RUNS, help="of each group")
    parser.add_argument("--out", type=Path, default=OUT, help="folder to write to")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    options = parser.parse_args()
    scratch = tempfile.TemporaryDirectory()
    spawned = multiprocessing.get_context("spawn")
    with scratch, ProcessPoolExecutor(options.jobs, mp_context=spawned) as executor:
        for exercise in options.exercises:
            place = (options.keep or Path(scratch.name)) / exercise
            runs = {
                skill: [
                    executor.submit(measured_run, exercise, place, skill, number)
                    for number in range(options.runs)
                ]
                for skill in SKILLS
            }
            groups = []
            for skill, waiting in runs.items():
                values: dict[str, list[float]] = {}
                for done in waiting:
                    for name, value in done.result():
                        values.setdefault(name, []).append(value)
                found = {name: quantiles(values[name]) for name in sorted(values)}
                groups.append(Group(skill.name, options.runs, found))
                print(exercise, skill.name, flush=True)
            write(exercise, tuple(groups), options.out / f"{exercise}.json")


def operates(path: ProbePath) -> bool:
    """Return whether a path's tool takes tissue."""
    return bool(np.any(path.buttons & PATH_WORK))


@cache
def usual_settings(exercise: str) -> Settings:
    """Return the thresholds of the rubric by which such a session is scored."""
    scenario, folder = load_scenario(exercise)
    path = load_probe_path(folder / scenario.path) if scenario.path else None
    cuts = path is not None and operates(path)
    return load_rubric("operation" if cuts else "endoscopy").settings


@cache
def flown(exercise: str) -> tuple[Scenario, PatientScene, ProbePath]:
    """Return an exercise, its head and the plan in it, made once in each process."""
    scenario, folder = load_scenario(exercise)
    patient = load_patient(scenario, no_progress)
    return scenario, patient, plan(scenario, folder, patient)


def measured_run(
    exercise: str, place: Path, skill: Skill, number: int
) -> list[tuple[str, float]]:
    """Record one run and return its values by name."""
    scenario, patient, path = flown(exercise)
    bundle = place / skill.name / f"{skill.name}_{number:03d}.paravol"
    record(bundle, scenario, patient, path, skill, number)
    found = session_metrics(bundle, settings=usual_settings(exercise), patient=patient)
    return list(summary(found.metrics))


def plan(scenario: Scenario, folder: Path, patient: PatientScene) -> ProbePath:
    """Return the way that runs follow: the exercise's path, or a scripted hand's."""
    if scenario.path:
        return load_probe_path(folder / scenario.path)
    hand = ScriptedHand(scenario, patient, operates=False)
    hand.do_all()
    did = hand.samples
    at_s = SLOWER * (np.array([s.time_s for s in did]) - did[0].time_s)
    poses = np.array([s.device_from_tip for s in did])
    roll_deg = np.degrees(np.unwrap(np.radians([s.roll_deg for s in did])))
    columns = np.column_stack([poses[:, :3, 3], -poses[:, :3, 2], roll_deg])
    even_s = np.arange(0.0, at_s[-1], 0.05)
    even = np.stack([np.interp(even_s, at_s, c) for c in columns.T], axis=1)
    axis = even[:, 3:6] / np.linalg.norm(even[:, 3:6], axis=1, keepdims=True)
    count = len(even_s)
    return ProbePath(
        scenario.name,
        even_s,
        even[:, :3],
        axis,
        even[:, 6],
        np.tile(AWAY_MM, (count, 1)),
        np.tile([0.0, 1.0, 0.0], (count, 1)),
        np.zeros(count, np.int64),
    )


def record(
    bundle: Path,
    scenario: Scenario,
    patient: PatientScene,
    path: ProbePath,
    skill: Skill,
    number: int,
) -> None:
    """Write one generated run as a session; the same number gives the same bits."""
    registration = Registration(np.eye(4), 0.2, np.zeros(0))
    info = describe_session(
        scenario, patient, registration, size=64, has_instrument=False
    )
    # where nobody takes anything, the head stays as it is: stepped much faster
    cuts = operates(path)
    info = msgspec.structs.replace(info, operated=cuts, has_instrument=cuts)
    operation = None
    if cuts:
        patient, operation = operate_on(patient)
    session = build_session(scenario, patient, np.eye(4), (64, 64), operation)
    jaw = Jaw()
    with SessionRecorder(bundle, info) as recorder:
        for held in run(path, skill, number, has_hand=bool(scenario.path)):
            tool = held.instrument
            closed = max(jaw.at(held.time_s, tool.is_working), tool.jaw)
            sample = replace(held, instrument=replace(tool, jaw=closed))
            session.step(sample)
            recorder.add(SampleRecord.of(sample, session.reading))
            if operation is not None:
                operation.take_changes()
                for edit in operation.take_edits():
                    recorder.add(EditRecord.of(edit))
                for injury in operation.take_injuries():
                    at_s, text = injury.time_s, injury.structure
                    recorder.add(EventRecord(at_s, "injury", text))
        recorder.close({"score": session.score()})


def run(
    path: ProbePath, skill: Skill, number: int, *, has_hand: bool = True
) -> Iterator[Sample]:
    """Yield the samples of one run along a path; has_hand: it has a second one."""
    names = [one.name for one in SKILLS]
    place = names.index(skill.name) if skill.name in names else len(names)
    rng = np.random.default_rng([SEED, place, number])
    at_s = progress(path.duration_s, skill, drawn(skill.pace, skill, rng), rng)
    count = len(at_s)
    off_mm = unsteady(count, skill, rng)
    turn = np.radians(drawn(skill.wander_deg, skill, rng)) * waves(count, SLOW_HZ, rng)
    tool_mm = np.zeros((count, 3))
    if operates(path):
        # the second hand is as steady as the first, by numbers of its own
        second = np.random.default_rng([SEED, place, number, 1])
        tool_mm += unsteady(count, skill, second)
    for n, time_s in enumerate(at_s):
        on = path.sample(float(time_s))
        axis = on.axis + np.cross(turn[n], on.axis)
        yield Sample(
            n / RATE_HZ,
            tip_frame(on.tip_mm + off_mm[n], axis / np.linalg.norm(axis)),
            on.roll_deg,
            on.instrument_tip_mm + tool_mm[n],
            on.instrument_axis,
            0,
            path_instrument(on) if has_hand else EMPTY_HAND,
            scope_deg=on.scope_deg,
        )


def drawn(value: float, skill: Skill, rng: np.random.Generator) -> float:
    """Return a value as it is in one run."""
    return value * float(np.exp(skill.spread * rng.standard_normal()))


def unsteady(count: int, skill: Skill, rng: np.random.Generator) -> Floats:
    """Return how far a tip is off its way, ``(count, 3)`` mm."""
    off_mm = drawn(skill.wander_mm, skill, rng) * waves(count, SLOW_HZ, rng)
    off_mm += drawn(skill.tremor_mm, skill, rng) * waves(count, TREMOR_HZ, rng)
    off_mm += ARM_MM * rng.standard_normal((count, 3))
    return off_mm


def progress(
    duration_s: float, skill: Skill, pace: float, rng: np.random.Generator
) -> Floats:
    """Return where on the planned path the hand is, s, sample by sample."""
    pieces, at = [np.zeros(1)], 0.0
    while at < duration_s:
        step = drawn(skill.step_s, skill, rng)
        to = at + step * (-0.6 if rng.random() < skill.back else 1.0)
        to = float(np.clip(to, 0.0, duration_s))
        count = max(round(abs(to - at) * pace * RATE_HZ), 2)
        u = np.arange(1, count + 1) / count
        smooth = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        # a hand that does not stop goes evenly; one that does starts anew each time
        even = max(0.0, 1.0 - skill.pause_s / 0.2)
        pieces.append(at + (to - at) * (even * u + (1.0 - even) * smooth))
        rest = round(rng.exponential(skill.pause_s) * RATE_HZ)
        pieces.append(np.full(rest, to))
        at = to
    return np.concatenate(pieces)


def waves(count: int, hertz: Floats, rng: np.random.Generator) -> Floats:
    """Return sines of random phase, ``(count, 3)``, of rms 1 along an axis."""
    time_s = np.arange(count) / RATE_HZ
    phase = rng.uniform(0.0, 2.0 * np.pi, (3, len(hertz)))
    angle = 2.0 * np.pi * hertz * time_s[:, None, None] + phase
    total: Floats = np.sin(angle).sum(axis=2) * np.sqrt(2.0 / len(hertz))
    return total


def summary(metrics: list[Metric]) -> Iterator[tuple[str, float]]:
    """Yield a run's values by role/name, and those of many details combined."""
    many: dict[str, list[float]] = {}
    for metric in metrics:
        if metric.value is None:
            continue
        name = f"{metric.role}/{metric.name}"
        family, colon, _ = name.partition(": ")
        if family.endswith(f"/{BLIND}"):
            continue
        yield name, metric.value
        if colon:
            many.setdefault(family, []).append(metric.value)
    for family, values in many.items():
        yield f"{family} (sum)", sum(values)
        yield f"{family} (largest)", max(values)
        yield f"{family} (smallest)", min(values)


def quantiles(values: list[float]) -> Quantiles:
    """Return 10, 50 and 90 % of values, to six digits."""
    three = (float(f"{q:.6g}") for q in np.quantile(values, (0.1, 0.5, 0.9)))
    low, middle, high = three
    return Quantiles(low, middle, high, len(values))


def write(scenario: str, groups: tuple[Group, ...], file: Path) -> None:
    """Write the groups' quantiles, atomically, a line for each value."""
    settings = usual_settings(scenario)
    population = Population(SOURCE, True, scenario, SEED, settings, groups)
    text = json.dumps(msgspec.to_builtins(population), indent=1)

    def one_line(numbers: "re.Match[str]") -> str:
        return "[" + re.sub(r",\s+", ", ", numbers[1]) + "]"

    text = re.sub(r"\[\s+([^][{}]*?)\s+\]", one_line, text)
    with whole_file(file) as beside:
        beside.write_text(text + "\n", "utf-8")


if __name__ == "__main__":
    main()
