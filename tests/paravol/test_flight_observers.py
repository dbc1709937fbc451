"""Whatever an observer can hear, all of them hear."""

import inspect

from paravol.flight import FlightObserver
from paravol.flight_observers import FlightObservers


def test_everything_is_passed_on_to_everybody_in_order() -> None:
    heard: list[tuple[int, str, tuple[object, ...]]] = []

    class Listener(FlightObserver):
        def __init__(self, number: int) -> None:
            self.number = number

        def __getattribute__(self, name: str) -> object:
            if name.startswith(("on_", "keeps_")):
                return lambda *words: heard.append((self.number, name, words))
            return object.__getattribute__(self, name)

    both = FlightObservers(Listener(1), Listener(2))
    names = [name for name in vars(FlightObserver) if not name.startswith("__")]
    assert len(names) > 10
    for name in names:
        heard.clear()
        count = len(inspect.signature(getattr(FlightObserver, name)).parameters) - 1
        words = tuple(object() for _ in range(count))
        getattr(both, name)(*words)
        assert heard == [(1, name, words), (2, name, words)]


def test_one_who_wants_the_tissue_is_enough() -> None:
    class Keen(FlightObserver):
        def keeps_tissue(self, time_s: float) -> bool:
            return time_s > 1.0

    both = FlightObservers(FlightObserver(), Keen())
    assert both.keeps_tissue(2.0)
    assert not both.keeps_tissue(0.5)
