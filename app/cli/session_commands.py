"""Commands about many recorded sessions: names, options, help."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from app.cli.root import SESSIONS, Flag, Json, app

Jobs = Annotated[
    int,
    Parameter(help="Processes that work at once.", validator=Number(gte=1, lte=256)),
]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class ScoreOptions:
    """Options of a scoring, as they were typed.

    Parameters
    ----------
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

    rubric: str = ""
    out: Path | None = None
    jobs: Jobs = 1
    mpi: Flag = False
    csv: Path | None = None
    json_file: Path | None = None
    arm: str = ""
    case: Path | None = None
    exact: Flag = False


@app.command(group=SESSIONS)
def score(
    sessions: Path, *, options: ScoreOptions = ScoreOptions(), json: Json = False
) -> int:
    """Score recorded sessions by a rubric; every point says what it came from.

    Of one session every part is told with its value, thresholds and seconds; of a
    folder one line a session. What was scored before is not scored again.

    Parameters
    ----------
    sessions
        A folder NAME.paravol, or a folder of such folders.
    """
    from app.cli.score_command import run_score

    return run_score(sessions, options, as_json=json)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class PassMarkOptions:
    """Options of a pass mark, as they were typed.

    Parameters
    ----------
    metric
        Full name of a metric, such as "path length" or "smallest distance: orbit".
    role
        Whose, where several have the metric, such as scope.
    rubric
        A rubric whose total the mark is for.
    """

    metric: str = ""
    role: str = ""
    rubric: str = ""
    jobs: Jobs = 1


@app.command(group=SESSIONS)
def pass_mark(
    novices: Path,
    experts: Path,
    *,
    options: PassMarkOptions = PassMarkOptions(),
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
    """
    from app.cli.score_command import run_pass_mark

    return run_pass_mark((novices, experts), options, as_json=json)
