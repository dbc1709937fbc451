from benchmarks.suites.art_scaling import ScalingPlan


def test_a_task_is_compared_with_the_paper() -> None:
    plan = ScalingPlan(quick=True)
    task = next(t for t in plan.tasks() if t.mode == "8 ranks")
    counters = task.measure().counters
    assert counters["paper_s"] == 281
    assert abs(counters["efficiency"] - counters["paper_efficiency"]) < 0.03
    assert counters["unexplained"] < 0.005
    plan.close()
