"""One hand for two steerings: nothing is owed to who lost it."""

from hypothesis import given
from hypothesis import strategies as st

from devices.controls.fulcrum import Demand
from devices.controls.handover import Handover
from devices.controls.steering import SWAP_BUTTON, Axis

events = st.lists(
    st.tuples(
        st.sampled_from(["hold", "nudge", "give"]),
        st.sampled_from(list(Axis)),
        st.floats(-1.0, 1.0),
    ),
    max_size=40,
)


@given(events)
def test_only_who_has_the_hand_is_asked(script: list[tuple[str, Axis, float]]) -> None:
    hands = Handover()
    for step, (what, axis, size) in enumerate(script):
        if what == "give":
            hands.give(not hands.is_tools, float(step))
        else:
            getattr(hands, what)(axis, size, float(step))
        idle = hands.scope if hands.is_tools else hands.tool
        demand, _ = idle.step(step + 0.25, step + 0.5)
        if what != "give":
            assert demand == Demand()
        busy = hands.tool if hands.is_tools else hands.scope
        busy.step(step + 0.25, step + 0.5)
        # whatever was asked for before, the next step of the idle one asks for nothing
        again, _ = idle.step(step + 0.5, step + 0.75)
        assert again == Demand()


def test_pedals_stay_with_the_scope_and_the_swap_button_is_none() -> None:
    hands = Handover()
    asked: list[bool] = []
    hands.on_swap = lambda: asked.append(True)
    hands.give(True, 0.0)
    hands.press(1, True, 0.1)
    hands.press(SWAP_BUTTON, True, 0.2)
    hands.press(SWAP_BUTTON, False, 0.3)
    assert hands.scope.step(0.0, 1.0)[1] == 1
    assert hands.tool.step(0.0, 1.0)[1] == 0
    assert asked == [True]
