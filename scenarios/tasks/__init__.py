"""What a trainee is asked to do, and whether it was done."""

from scenarios.tasks.engine import Status, TaskEngine, TaskEvent, TaskState
from scenarios.tasks.situation import Situation
from scenarios.tasks.task import Task

__all__ = ["Situation", "Status", "Task", "TaskEngine", "TaskEvent", "TaskState"]
