"""What is made in the background is of the newest asking, and not made too often."""

import threading
import time

from app.window.panels.refresher import Refresher

PATIENCE_S = 10.0


def test_the_last_thing_made_began_after_the_last_asking() -> None:
    """However askings fall into makings."""
    state: list[int] = [0]
    made: list[int] = []
    done = threading.Event()

    def make() -> int:
        seen = state[0]
        time.sleep(0.003)
        return seen

    def show(seen: int) -> None:
        made.append(seen)
        if seen == 50:
            done.set()

    refresher = Refresher(make, show, every_s=0.01)
    for number in range(1, 51):
        state[0] = number
        refresher.ask()
        time.sleep(0.001)
    assert done.wait(PATIENCE_S)
    refresher.close()
    assert made[-1] == 50
    assert made == sorted(set(made))
    assert len(made) < 50


def test_after_a_rest_it_is_made_again() -> None:
    made = threading.Semaphore(0)
    refresher = Refresher(lambda: None, lambda _: made.release(), every_s=0.0)
    for _ in range(3):
        refresher.ask()
        assert made.acquire(timeout=PATIENCE_S)
        time.sleep(0.01)
    refresher.close()


def test_once_closed_nothing_is_made() -> None:
    begun, goes_on = threading.Event(), threading.Event()
    shown: list[int] = []

    def make() -> int:
        begun.set()
        assert goes_on.wait(PATIENCE_S)
        return 1

    refresher = Refresher(make, shown.append, every_s=60.0)
    refresher.ask()
    assert begun.wait(PATIENCE_S)
    making = refresher._thread
    assert making is not None
    # a page that is left does not wait for it
    refresher.close()
    goes_on.set()
    making.join(PATIENCE_S)
    assert not making.is_alive()
    refresher.ask()
    assert not shown
    assert refresher._thread is None
