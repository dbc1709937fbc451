from benchmarks.plan import SUITES
from benchmarks.suites.art_scaling import ScalingPlan


def test_tasks_have_names_of_their_own() -> None:
    for quick in (True, False):
        tasks = ScalingPlan(quick).tasks()
        assert len({task.key for task in tasks}) == len(tasks)
        assert {task.case.split("/")[0] for task in tasks} >= {
            "table1",
            "figure4",
            "ways",
        }
    assert SUITES["art-scaling"] is ScalingPlan


def test_a_task_is_compared_with_the_paper() -> None:
    plan = ScalingPlan(quick=True)
    task = next(t for t in plan.tasks() if t.mode == "8 ranks")
    counters = task.measure().counters
    assert counters["paper_s"] == 281
    assert abs(counters["efficiency"] - counters["paper_efficiency"]) < 0.03
    assert counters["unexplained"] < 0.005
    plan.close()
