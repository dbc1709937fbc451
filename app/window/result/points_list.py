"""Where a score's points come from, part by part."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QProgressBar

from app.window.plain_label import paragraph
from app.window.scaling import Scaled, hold, lay, scale_all
from app.window.texts import tr
from paravol.debrief.advice import amount
from paravol.scoring.verdict_texts import points_text
from scenarios.rubrics import Assessment, RubricPart, Standing


class PointsList(QFrame, Scaled):
    """Show an assessment's parts, and what bounds its total."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("card")
        self._grid = lay(QGridLayout(self), 12, gap=(12, 3))
        self._grid.setColumnStretch(1, 1)

    def show_assessment(self, assessment: Assessment) -> None:
        """Show every part with its points and its reason."""
        row = 0
        self._put(paragraph(tr("Where the points come from"), "subheading"), row, 0, 3)
        row += 1
        self._put(paragraph(tr(points_text(assessment))), row, 0, 3)
        for fail in assessment.fails:
            row += 1
            text = tr(
                "{why}: at most {most_percent:g} points in all.",
                why=tr(fail.why),
                most_percent=fail.most_percent,
            )
            self._put(paragraph(text, "alarm"), row, 0, 3)
        for part in assessment.parts:
            row += 1
            bar = QProgressBar()
            bar.setTextVisible(False)
            hold(bar, setFixedWidth=110)
            bar.setRange(0, 1000)
            share = part.points / part.most_points if part.most_points else 0.0
            bar.setValue(round(1000 * share))
            bar.setAccessibleName(f"{tr(part.title)}: {part_points_text(part)}")
            self._put(bar, row, 0)
            self._put(paragraph(tr(part.title), "body"), row, 1)
            points = paragraph(part_points_text(part), "figure")
            points.setAlignment(Qt.AlignmentFlag.AlignRight)
            self._put(points, row, 2)
            row += 1
            self._put(paragraph(reason_text(part)), row, 1, 2)
        for remark in assessment.remarks:
            if remark in points_text(assessment):
                continue
            row += 1
            self._put(paragraph(tr(remark)), row, 0, 3)
        scale_all(self, self.scale)

    def _put(
        self, widget: QLabel | QProgressBar, row: int, at: int, span: int = 1
    ) -> None:
        self._grid.addWidget(widget, row, at, 1, span)


def part_points_text(part: RubricPart) -> str:
    """Return a part's points."""
    if not part.counts:
        return tr("not counted")
    return tr(
        "{points:.1f} of {most_points:g}",
        points=part.points,
        most_points=part.most_points,
    )


def reason_text(part: RubricPart) -> str:
    """Return what a part's points were given for, in words."""
    if not part.counts:
        return tr("Not counted: {reason}", reason=tr(part.reason or part.standing))
    assert part.standing is Standing.SCORED
    full = [value for value, percent in part.thresholds if percent >= 100.0]
    none = [value for value, percent in part.thresholds if percent <= 0.0]
    text = f"{tr(part.source)}: {tr(amount(part))}"
    if full and none:
        text += tr(
            "; full points at {full:g}, none at {none:g}",
            full=full[0],
            none=none[0],
        )
    return (
        tr("{text}. No points: {withheld}", text=text, withheld=tr(part.withheld))
        if part.withheld
        else text
    )
