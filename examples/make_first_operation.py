"""Make ``first_operation.path.json``: an uncinectomy on the right side.

    python examples/make_first_operation.py

Two minutes in the right nose of the average head, decongested, its middle turbinate
brought to the middle. A 30-degree scope looks round; a needle blanches the axilla and
the uncinate process; the process is taken with the tools of `TOOLS`; a ball probe feels
the natural ostium behind it, suction clears it, and a 70-degree scope looks into it.
`paravol.exercises.model_hand` finds each place and each way, and takes back what it
tried too hard.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from devices import save_probe_path
from paravol.exercises.model_hand import ModelHand
from paravol.exercises.recorded_scenario import path_of
from paravol.patient import load_patient, no_progress
from scenarios import load_scenario
from scenarios.tasks.task import Inject, Remove

EXAMPLES = Path(__file__).parent
TURBINATE, OSTIUM = "middle turbinate head, right", "maxillary ostium, right"
LOOKS_S, FEELS_S = 1.2, 1.5
"""So long each place is looked at, and the ostium is felt."""
NEAR_MM = 4.0
"""So near to the ostium's middle a tool comes."""
LAST_DEG = 70.0


def main() -> None:
    """Do the tasks of the scenario, and what a surgeon does before and after them."""
    scenario, _ = load_scenario("first_operation")
    patient = load_patient(scenario, no_progress)
    hand = ModelHand(scenario, patient)
    ostium = patient.landmarks[OSTIUM]
    for place in (TURBINATE, "uncinate process, right"):
        hand.see(patient.landmarks[place])
        hand.stay(LOOKS_S)
    for task in scenario.tasks:
        if isinstance(task, Inject) or (isinstance(task, Remove) and task.asks):
            hand.do(task)
    for tool in ("ball probe", "suction tube"):
        assert hand.touch(tool, ostium, FEELS_S, NEAR_MM), tool
    hand.choose(LAST_DEG)
    hand.see(ostium)
    hand.stay(2.0 * LOOKS_S)
    source = "examples/make_first_operation.py"
    path = path_of("first operation", source, hand.samples, np.eye(4))
    # the hand's own digits
    path = replace(
        path,
        axis=path.axis.round(6),
        instrument_axis=path.instrument_axis.round(6),
        roll_deg=path.roll_deg.round(3),
        instrument_roll_deg=path.instrument_roll_deg.round(3),
    )
    save_probe_path(path, EXAMPLES / "first_operation.path.json")


if __name__ == "__main__":
    main()
