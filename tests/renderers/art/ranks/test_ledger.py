from renderers.art.ranks.ledger import Ledger, Stopwatch


def test_every_second_is_charged_to_one_part() -> None:
    times = iter([10.0, 11.0, 13.0, 17.0, 18.0])
    watch = Stopwatch(lambda: next(times))
    for part in ("poll", "render", "idle", "render"):
        watch.lap(part)
    parts = watch.ledger.parts()
    assert parts == Ledger(poll=1.0, render=3.0, idle=4.0).parts()
    assert sum(parts.values()) == 8.0
    assert watch.ledger.busy == 3.0


def test_without_a_clock_nothing_is_charged() -> None:
    watch = Stopwatch()
    watch.lap("render")
    assert sum(watch.ledger.parts().values()) == 0.0


def test_a_ledger_begins_anew() -> None:
    times = iter([1.0, 2.0, 5.0, 6.0])
    watch = Stopwatch(lambda: next(times))
    watch.lap("send")
    watch.restart()
    watch.lap("send")
    assert watch.ledger.send == 1.0
