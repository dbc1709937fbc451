"""Commands about many recorded sessions: names, options, help."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from app.cli.root import SESSIONS, Flag, Json, app

Jobs = Annotated[
    int,
    Parameter(help="Processes that work at once.", validator=Number(gte=1, lte=256)),
]


@app.command(group=SESSIONS)
def score(
    sessions: Path,
    *,
    rubric: str = "",
    out: Path | None = None,
    jobs: Jobs = 1,
    mpi: Flag = False,
    csv: Path | None = None,
    json_file: Path | None = None,
    arm: str = "",
    case: Path | None = None,
    exact: Flag = False,
    json: Json = False,
) -> int:
    """Score recorded sessions by a rubric; every point says what it came from.

    Of one session every part is told with its value, thresholds and seconds; of a
    folder one line a session. What was scored before is not scored again.

    Parameters
    ----------
    sessions
        A folder NAME.paravol, or a folder of such folders.
    rubric
        Name of a bundled rubric (endoscopy, operation), or a .toml file of your own;
        for each session by itself "operation" or, where nothing was cut, "endoscopy".
    out
        Where scores are kept; a folder "assessments" beside the sessions otherwise.
    mpi
        Score by the ranks of: mpiexec -n N python -m mpi4py.futures -m app score ...
    csv
        Write a table with a row for each session.
    json_file
        Write all assessments.
    arm
        Profile of the arm that was used, such as dx: noise from its counts.
    case
        Where the case that was flown through lies now.
    exact
        Step every session again instead of trusting what its recording says.
    """
    from app.cli.score_command import ScoreOptions, run_score

    options = ScoreOptions(
        sessions, rubric, out, jobs, mpi, csv, json_file, arm, case, exact
    )
    return run_score(options, as_json=json)


@app.command(group=SESSIONS)
def pass_mark(
    novices: Path,
    experts: Path,
    *,
    metric: str = "",
    role: str = "",
    rubric: str = "",
    jobs: Jobs = 1,
    json: Json = False,
) -> int:
    """Set a pass mark by two groups: who cannot do it yet, and who can.

    The contrasting-groups method: the mark lies where both groups' normal densities
    are equal. Its confidence comes of drawing the groups anew.

    Parameters
    ----------
    novices
        Folder of sessions of those who cannot do it yet.
    experts
        Folder of sessions of those who can.
    metric
        Full name of a metric, such as "path length" or "smallest distance: orbit".
    role
        Whose, where several have the metric, such as scope.
    rubric
        A rubric whose total the mark is for.
    """
    from app.cli.score_command import PassMarkOptions, run_pass_mark

    options = PassMarkOptions(novices, experts, metric, role, rubric, jobs)
    return run_pass_mark(options, as_json=json)
