"""What the window says of tasks."""

import pytest
from PySide6.QtWidgets import QApplication, QLabel

from app.window.panels.task_panel import ALL_DONE, TaskPanel
from scenarios import Scenario
from scenarios.tasks import Status, TaskState
from scenarios.tasks.task import KeepAway, Reach

TASKS = (
    KeepAway(
        name="safe",
        title="Keep away",
        hazards=("orbit",),
        margin_mm=1.0,
        most_dose_s=1.0,
    ),
    Reach(name="go", title="Go there", place=(0, 0, 0), radius_mm=1.0, hint="Ahead."),
)


@pytest.fixture
def panel(application: QApplication) -> TaskPanel:
    return TaskPanel(Scenario("s", "S", tasks=TASKS, hints=("Slowly.",)))


def texts(panel: TaskPanel) -> list[str]:
    labels = panel.findChildren(QLabel)
    return [label.text() for label in labels if not label.isHidden()]


def test_what_is_to_be_done_comes_before_what_is_to_be_kept(panel: TaskPanel) -> None:
    panel.show_states(
        [TaskState("safe", Status.OPEN, 1.0), TaskState("go", Status.OPEN, 0.5)]
    )
    assert texts(panel) == ["0 of 2 tasks done", "Go there", "Keep away"]
    panel.switch_hint()
    assert "Hint: Ahead." in texts(panel)
    panel.switch_hint()
    assert "Hint: Ahead." not in texts(panel)


def test_failures_say_why_and_the_end_is_told(panel: TaskPanel) -> None:
    panel.show_states(
        [
            TaskState("safe", Status.FAILED, 0.0, why="orbit was hurt"),
            TaskState("go", Status.DONE, 1.0),
        ]
    )
    assert texts(panel) == [
        "1 of 2 tasks done · 1 failed: orbit was hurt",
        ALL_DONE.format(end="Q"),
    ]
    panel.switch_hint()
    assert "Hint: Slowly." in texts(panel)


def test_an_exercise_without_tasks_has_no_panel(panel: TaskPanel) -> None:
    assert TaskPanel(Scenario("s", "S")).isHidden()
