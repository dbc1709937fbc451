"""What is drawn before a flight needs all that the flight will need."""

import subprocess
import sys
from pathlib import Path

from paravol.patient import load_patient
from paravol.sessions.session_setup import coverage_watch, operate_on
from scenarios import load_scenario

SCRIPT = """
import gc, sys
from paravol.environment import prepare_environment
prepare_environment()
from numba.core.dispatcher import Dispatcher
from paravol.patient import load_patient
from paravol.sessions.session_setup import build_view, first_views, path_view
from devices import load_probe_path
from scenarios import load_scenario

def compiled():
    return {
        f"{d.py_func.__module__}.{d.py_func.__name__}": len(d.signatures)
        for d in gc.get_objects() if isinstance(d, Dispatcher)
    }

def quietly(stage, share):
    pass

scenario, folder = load_scenario(sys.argv[1])
path = load_probe_path(folder / scenario.path)
patient = load_patient(scenario, quietly)
view = build_view(
    scenario, patient, tier="LIVE", seed=1, has_instrument=True, threads=2
)
size = (96, 96)
view.warm_up(first_views(scenario, patient, path, size), quietly)
before = compiled()
for place in range(51):
    seen = path_view(scenario, patient, path, place / 50 * path.duration_s, size)
    view.draw(seen, number=place, elapsed_s=0.02)
after = compiled()
print(sum(n > 0 for n in before.values()))
print(sorted(name for name, n in after.items() if n != before.get(name, 0)))
"""


def test_no_kernel_is_compiled_in_flight(coarse_scenario: Path) -> None:
    """A process of its own: here kernels have been compiled by other tests."""
    run = [sys.executable, "-c", SCRIPT, str(coarse_scenario)]
    done = subprocess.run(run, capture_output=True, text=True, timeout=250, check=False)
    assert done.returncode == 0, done.stderr
    warm, late = done.stdout.splitlines()
    assert int(warm) > 20
    assert late == "[]"


def test_mucosa_divided_before_the_operation_is_that_of_the_flight(
    coarse_scenario: Path,
) -> None:
    scenario, _ = load_scenario(str(coarse_scenario))
    before = load_patient(scenario, lambda stage, share: None)
    divided = coverage_watch(before).mucosa
    # the same object: the flight does not divide it again
    assert coverage_watch(*operate_on(before)).mucosa is divided
