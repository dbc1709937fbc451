"""What is to be done now: the open tasks, how far they are, a hint when asked for."""

from collections.abc import Sequence

from PySide6.QtWidgets import QLabel, QProgressBar, QVBoxLayout, QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.plain_label import PlainLabel, paragraph
from app.window.scaling import hold, lay
from app.window.texts import later, tr
from paravol.guide import GuideMark
from scenarios import Scenario
from scenarios.tasks import Status, TaskState
from scenarios.tasks.task import KeepAway

ALL_DONE = later("All tasks are done. {end} ends the flight.")
SHOWN = 2
"""Tasks at once; what must only be kept comes last."""


class TaskPanel(QWidget):
    """Show the tasks of an exercise; hidden where there are none."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        self._scenario = scenario
        self._tasks = {task.name: task for task in scenario.tasks}
        self._states: tuple[TaskState, ...] = ()
        self._has_hint = False
        self._column = lay(QVBoxLayout(self), 0, gap=3)
        self._count = PlainLabel(name="caption", wraps=True)
        self._way = ""
        self._lines: list[tuple[QLabel, QProgressBar]] = []
        self._column.addWidget(self._count)
        for _ in range(SHOWN):
            line, bar = paragraph("", "task"), QProgressBar()
            bar.setTextVisible(False)
            hold(bar, setFixedHeight=5)
            bar.setRange(0, 100)
            self._column.addWidget(line)
            self._column.addWidget(bar)
            self._lines.append((line, bar))
        self._hint = PlainLabel(wraps=True)
        self._column.addWidget(self._hint)
        self.setVisible(bool(scenario.tasks))
        self.show_states(tuple(TaskState(task.name) for task in scenario.tasks))

    def show_states(self, states: Sequence[TaskState]) -> None:
        """Show how the tasks stand; only what has changed is laid out anew."""
        states = tuple(states)
        if states == self._states or not self._tasks:
            return
        self._states = states
        self._tell()

    def _tell(self) -> None:
        """Show how the tasks stand, and how far the place is."""
        states = self._states
        done = sum(state.status is Status.DONE for state in states)
        failed = [state for state in states if state.status is Status.FAILED]
        text = tr("{done} of {count} tasks done", done=done, count=len(states))
        if failed:
            text += tr(
                " · {count} failed: {why}", count=len(failed), why=tr(failed[-1].why)
            )
        _set_text(self._count, text + self._way)
        shown = self._open()[:SHOWN]
        for (line, bar), state in zip(
            self._lines, [*shown, *[None] * SHOWN], strict=False
        ):
            bar.setVisible(state is not None)
            line.setVisible(state is not None)
            if state is not None:
                _set_text(line, tr(self._tasks[state.name].title))
                bar.setValue(round(100 * state.progress))
        if not shown and done + len(failed) == len(states):
            self._lines[0][0].setVisible(True)
            _set_text(self._lines[0][0], tr(ALL_DONE, end=KEYS.label(Act.END)))
        self._tell_hint()

    def show_way(self, guide: GuideMark | None, *, is_on: bool) -> None:
        """Say which place the task is about, and how far it is.

        is_on: somebody wants to know.
        """
        way = ""
        if guide is not None:
            way = tr(" · {way} to {place}", way=tr(guide.text()), place=tr(guide.what))
        elif self._open() and not is_on:
            way = tr(" · {guide} shows the way", guide=KEYS.label(Act.GUIDE))
        if way != self._way:
            self._way = way
            self._tell()

    @property
    def has_hint(self) -> bool:
        """Return whether the hint is shown."""
        return self._has_hint

    def switch_hint(self) -> None:
        """Show the hint to what is to be done now, or take it away."""
        self._has_hint = not self._has_hint
        self._tell_hint()

    @property
    def hint(self) -> str:
        """Return what helps now."""
        for state in self._open():
            if self._tasks[state.name].hint:
                return tr(self._tasks[state.name].hint)
        hints = " ".join(tr(hint) for hint in self._scenario.hints)
        return hints or tr("There is no hint for this.")

    def _open(self) -> list[TaskState]:
        """Return the open tasks, those that must only be kept at the end."""
        found = [state for state in self._states if state.status is Status.OPEN]
        return sorted(found, key=lambda state: self._is_kept(state.name))

    def _is_kept(self, name: str) -> bool:
        return isinstance(self._tasks[name], KeepAway)

    def _tell_hint(self) -> None:
        self._hint.setVisible(self._has_hint)
        _set_text(
            self._hint, tr("Hint: {hint}", hint=self.hint) if self._has_hint else ""
        )


def _set_text(label: QLabel, text: str) -> None:
    if label.text() != text:
        label.setText(text)
