"""Each figure has one definition, and no word means two numbers."""

import re
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np

from paravol.scoring.score_table import score_rows
from scenarios.metrics import DEFINITIONS, Definition
from scenarios.scoring import Scorer

TABLE = Path(__file__).parents[3] / "docs" / "metrics.md"


def module(definition: Definition) -> str:
    function = definition.compute
    while isinstance(function, partial):
        function = function.func
    return f"{function.__module__.replace('.', '/')}.py"


def test_the_table_names_the_one_place_of_each_figure() -> None:
    rows = re.findall(r"^\| `(scenarios/\S+)` \| (.*) \|$", TABLE.read_text(), re.M)
    told = {(name, place) for place, names in rows for name in names.split("; ")}
    assert told == {(d.name, module(d)) for d in DEFINITIONS}
    # of a name in two places one would be the second definition
    assert max(Counter(name for name, _ in told).values()) == 1
    assert max(Counter((d.name, d.role) for d in DEFINITIONS).values()) == 1


def test_what_a_flight_counts_by_itself_has_no_figures_name() -> None:
    scorer = Scorer({"a target": np.ones(3)})
    for number, gap_mm in enumerate((1.0, -1.0, 1.0)):
        scorer.add(0.1 * number, np.full(3, float(number)), gap_mm, "septum")
    names = {definition.name for definition in DEFINITIONS}
    gauges = {name for name, _ in score_rows(scorer.score())}
    # the least distance of samples is the same number either way
    assert {name.partition(":")[0] for name in gauges} & names == {"nearest to"}
