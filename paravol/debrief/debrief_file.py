"""Write the debrief of a recorded session: one HTML file that needs nothing else."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from paravol.debrief.events import events_of, worth_a_picture
from paravol.debrief.findings import Findings, gather
from paravol.debrief.head_picture import head_picture
from paravol.debrief.page import PageContext, page, tip_pieces
from paravol.debrief.pictures import (
    NO_PICTURES,
    DebriefOrder,
    Picture,
    draw_pictures,
)
from paravol.patient import PatientScene, Progress, load_patient, no_progress
from paravol.scoring.session_scoring import assessment_of, fitting_rubric
from paravol.sessions.session_setup import flown_scenario
from paravol.slices.coverage_map import coverage_picture
from scenarios.bundle import read_recording
from scenarios.rubrics import load_rubric
from system import UserError, whole_file


@dataclass(frozen=True, slots=True)
class WrittenDebrief:
    """Tell what was written.

    session: its name. events: with an entry. percent: of the rubric's points, None
    without a total.
    """

    out: Path
    session: str
    rubric: str
    percent: float | None
    verdict: str
    events: int
    pictures: int
    size_bytes: int


def write_debrief(
    order: DebriefOrder,
    progress: Progress = no_progress,
    say: Callable[[str], None] = print,
    patient: PatientScene | None = None,
) -> WrittenDebrief:
    """Write the page of a session, whole or not at all.

    The same session and order give the same bytes. say: told a sentence when there is
    something to know. patient: the one flown through, where it is loaded already.
    UserError as in `session_metrics`.
    """
    if not 0 <= order.pictures <= 200:
        raise UserError(f"--pictures must lie in 0 to 200, got {order.pictures}.")
    recording = read_recording(order.folder)
    scenario = flown_scenario(order.folder, recording.info, order.case)
    rubric = load_rubric(order.rubric) if order.rubric else fitting_rubric(recording)
    patient = patient or load_patient(scenario, progress)
    findings = gather(
        order.folder,
        scenario,
        recording,
        patient,
        compare=order.compare,
        settings=rubric.settings,
        progress=progress,
    )
    events = events_of(findings)
    pictures, head, seen = NO_PICTURES, Markup(""), None
    if order.quality is not None:
        head = _head(findings, order.threads)
        # before the pictures, for which the session goes back
        seen = _seen(findings)
        drawn = worth_a_picture(events, order.pictures)
        pictures = draw_pictures(order, findings, drawn, progress, say)
    assessment = assessment_of(order.folder, rubric, findings.metrics)
    text = page(PageContext(findings, events, pictures, head, assessment, seen))
    with whole_file(order.out) as beside:
        beside.write_text(text, "utf-8")
    told = sum(event.is_told for event in events)
    count = len(pictures.of_events) + (2 if pictures.wounds else 0)
    return WrittenDebrief(
        order.out,
        findings.name,
        assessment.rubric,
        assessment.percent,
        str(assessment.verdict),
        told,
        count,
        len(text.encode()),
    )


def _seen(findings: Findings) -> Picture | None:
    watch, patient = findings.followed.coverage, findings.patient
    if watch is None or patient.scene.surface is None:
        return None
    pixels = coverage_picture(
        watch, patient.scene.surface.distance, dict(patient.landmarks)
    )
    return Picture.of(pixels)


def _head(findings: Findings, threads: int) -> Markup:
    pieces = tip_pieces(findings.metrics.measured.scope)
    if not pieces or findings.patient.scene.surface is None:
        return Markup("")
    return head_picture(findings.patient, pieces, threads)
