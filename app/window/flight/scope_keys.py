"""Commands of the scopes that lie ready: which angle is in hand."""

from functools import partial

from app.window.keyboard.actions import Act
from app.window.keyboard.page_commands import Command, Commands, Notify
from app.window.texts import tr
from paravol.inputs.scope_in_hand import ScopeInHand


class ScopeKeys:
    """Put in another scope, and say what it is for."""

    def __init__(self, scopes: ScopeInHand, notify: Notify) -> None:
        self._scopes = scopes
        self._notify = notify

    @property
    def choices_deg(self) -> tuple[float, ...]:
        """Return the angles of all that may be put in."""
        return self._scopes.choices_deg

    def commands(self) -> Commands:
        """Return what can be done."""
        return {
            Act.NEXT_SCOPE: Command(partial(self._step, 1)),
            Act.PREVIOUS_SCOPE: Command(partial(self._step, -1)),
        }

    def take(self, angle_deg: float) -> None:
        """Put in the scope of an angle."""
        self._scopes.choose(angle_deg)
        self._tell(angle_deg)

    def _step(self, step: int) -> None:
        if len(self._scopes.choices_deg) > 1:
            self._tell(self._scopes.step(step))
        else:
            self._notify(
                tr("There is no other scope"), tr("The exercise allows one only.")
            )

    def _tell(self, angle_deg: float) -> None:
        self._notify(
            tr("Scope of {angle_deg:g}°", angle_deg=angle_deg), scope_use(angle_deg)
        )


def scope_use(angle_deg: float) -> str:
    """Return where a scope of an angle looks, in words."""
    if angle_deg == 0.0:
        return tr("It looks straight ahead.")
    return tr(
        "It looks {angle_deg:g}° aside, towards the light post.", angle_deg=angle_deg
    )
