"""The tables of a progress store, and how older files come up to date."""

from sqlalchemy import (
    Boolean,
    Column,
    Connection,
    Float,
    ForeignKey,
    Integer,
    MetaData,
    String,
    Table,
    UniqueConstraint,
)

APPLICATION_ID = 0x50415256
"""What an SQLite file of ours carries in its header: "PARV"."""

TABLES = MetaData()

trainees = Table(
    "trainees",
    TABLES,
    Column("id", Integer, primary_key=True),
    Column("name", String, nullable=False, unique=True),
)
"""Names that trainees made up; "" for whoever gave none."""


def _session_id() -> Column[int]:
    owner = ForeignKey("sessions.id", ondelete="CASCADE")
    return Column("session_id", Integer, owner, primary_key=True)


sessions = Table(
    "sessions",
    TABLES,
    Column("id", Integer, primary_key=True),
    Column(
        "trainee_id",
        Integer,
        ForeignKey("trainees.id", ondelete="CASCADE"),
        nullable=False,
        index=True,
    ),
    Column("sha256", String, nullable=False),
    Column("bundle", String, nullable=False),
    Column("exercise", String, nullable=False),
    Column("title", String, nullable=False),
    Column("begun", String, nullable=False),
    Column("duration_s", Float, nullable=False),
    Column("is_complete", Boolean, nullable=False),
    Column("has_passed", Boolean),
    UniqueConstraint("sha256"),
)

values = Table(
    "metric_values",
    TABLES,
    _session_id(),
    Column("role", String, primary_key=True),
    Column("name", String, primary_key=True),
    Column("unit", String, nullable=False),
    Column("value", Float),
    Column("sigma", Float),
    Column("is_noise", Boolean, nullable=False),
)

tasks = Table(
    "tasks",
    TABLES,
    _session_id(),
    Column("name", String, primary_key=True),
    Column("status", String, nullable=False),
)

assessments = Table(
    "assessments",
    TABLES,
    _session_id(),
    Column("rubric", String, nullable=False),
    Column("version", Integer, nullable=False),
    Column("sha256", String, nullable=False),
    Column("percent", Float),
    Column("percent_sigma", Float, nullable=False),
    Column("pass_percent", Float, nullable=False),
    Column("verdict", String, nullable=False),
)

parts = Table(
    "parts",
    TABLES,
    _session_id(),
    Column("name", String, primary_key=True),
    Column("title", String, nullable=False),
    Column("points", Float, nullable=False),
    Column("most_points", Float, nullable=False),
    Column("standing", String, nullable=False),
)

STEPS: list[tuple[str, ...]] = []
"""Statements that bring a file from version n + 1 to n + 2, for each n. A table above
shows the newest shape; whoever changes it adds a step."""


def newest_version() -> int:
    """Return the version that a file has after all steps."""
    return 1 + len(STEPS)


def bring_up_to_date(connection: Connection, version: int) -> None:
    """Make the tables of a new file, or take an older one's steps.

    version: of the file, 0 for a new one. Within one transaction: all of it or none.
    """
    if version == 0:
        TABLES.create_all(connection)
    for statements in STEPS[version - 1 :] if version else ():
        for statement in statements:
            connection.exec_driver_sql(statement)
    connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.exec_driver_sql(f"PRAGMA user_version = {newest_version()}")
