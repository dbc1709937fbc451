"""The store of a user's sessions over time: one SQLite file.

Two programs may use it at once: one writes, others wait or read what was there before
(a write-ahead log). A transaction is kept whole or not at all, whatever dies meanwhile.
What is deleted is overwritten with zeros in the file and gone from its log.
"""

import datetime
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec
import platformdirs
from sqlalchemy import (
    URL,
    Connection,
    Insert,
    Table,
    create_engine,
    delete,
    event,
    insert,
    literal_column,
    select,
)
from sqlalchemy.exc import DatabaseError, OperationalError
from sqlalchemy.pool import NullPool

from paravol.progress import tables
from paravol.progress.session_entry import SessionEntry, require_name
from system import UserError, locked

BUSY_S = 10.0
"""So long a program waits for another one that writes."""

_MAGIC = b"SQLite format 3\x00"

_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


class ProgressStore:
    """Keep sessions in a file.

    file: where. told: what the user must know of opening it, "" for nothing.
    """

    def __init__(self, file: Path | None = None) -> None:
        """Open a store, or make one.

        file: None for the user's own, below the data directory. A damaged file is set
        aside under another name, and `told` says so. UserError for a file that is no
        store, or one of a newer program, or cannot be used now, as on a full disk.
        """
        is_the_users = file is None
        self.file = users_store() if file is None else file.absolute()
        self.told = ""
        self.file.parent.mkdir(parents=True, exist_ok=True)
        url = URL.create("sqlite", database=str(self.file))
        self._engine = create_engine(
            url, poolclass=NullPool, connect_args={"timeout": BUSY_S}
        )
        event.listen(self._engine, "connect", _set_up)
        event.listen(self._engine, "begin", _begin)
        with _one_at_a_time(self.file.parent):
            try:
                self._open()
            except DatabaseError as error:
                if not _is_damage(error):
                    if isinstance(error, OperationalError):
                        raise self._unusable(error) from error
                    raise
                if not is_the_users:
                    self._require_sqlite()
                self._set_aside()
                self._open()

    def add(self, entry: SessionEntry) -> bool:
        """Keep a session; return whether it is new.

        One that is there already, by its bundle's hash, is replaced: scored again, or
        given to another trainee.
        """
        name = require_name(entry.trainee)
        with self._writing() as connection:
            known = select(tables.trainees.c.id).where(tables.trainees.c.name == name)
            trainee = connection.execute(known).scalar()
            if trainee is None:
                row = insert(tables.trainees).values(name=name)
                trainee = _new_id(connection, row)
            gone = delete(tables.sessions).where(
                tables.sessions.c.sha256 == entry.sha256
            )
            is_new = not connection.execute(gone).rowcount
            session = _insert_session(connection, entry, trainee)
            _insert_details(connection, entry, session)
            _forget_empty(connection)
        return is_new

    def sessions(
        self, *, trainee: str | None = None, exercise: str | None = None
    ) -> list[SessionEntry]:
        """Return sessions in the order in which they were flown.

        trainee, exercise: None for all.
        """
        t, s = tables.trainees, tables.sessions
        wanted = select(t.c.name.label("trainee"), s).join_from(s, t)
        if trainee is not None:
            wanted = wanted.where(t.c.name == trainee)
        if exercise is not None:
            wanted = wanted.where(s.c.exercise == exercise)
        with self._writing() as connection:
            found = connection.execute(wanted.order_by(s.c.begun, s.c.id)).all()
            return [_entry(connection, row._mapping) for row in found]

    def results(self, trainee: str) -> dict[str, list[bool]]:
        """Return whether a trainee's attempts were passed, in order, by exercise.

        What `scenarios.ladder` opens exercises by. Attempts of which nothing says
        whether they were passed are left out.
        """
        t, s = tables.trainees, tables.sessions
        wanted = (
            select(s.c.exercise, s.c.has_passed)
            .join_from(s, t)
            .where(t.c.name == trainee, s.c.has_passed.is_not(None))
            .order_by(s.c.begun, s.c.id)
        )
        found: dict[str, list[bool]] = {}
        with self._writing() as connection:
            for exercise, has_passed in connection.execute(wanted):
                found.setdefault(exercise, []).append(has_passed)
        return found

    def trainees(self) -> list[str]:
        """Return the names that there are, in alphabetical order."""
        with self._writing() as connection:
            names = select(tables.trainees.c.name).order_by(tables.trainees.c.name)
            return list(connection.execute(names).scalars())

    def delete(self, hashes: Sequence[str]) -> int:
        """Delete sessions by their bundles' hashes; return how many there were.

        A trainee without sessions is deleted with the last. UserError where another
        program holds on to the log, so that bytes remain in it.
        """
        s = tables.sessions
        with self._writing() as connection:
            gone = delete(s).where(s.c.sha256.in_(hashes))
            count = connection.execute(gone).rowcount
            _forget_empty(connection)
        self._clean()
        return count

    def _clean(self) -> None:
        """Write the file anew without what was deleted, and empty the log."""
        raw = self._engine.raw_connection()
        try:
            cursor = raw.cursor()
            cursor.execute("VACUUM")
            is_busy = bool(
                cursor.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]
            )
        except sqlite3.OperationalError:
            is_busy = True
        finally:
            raw.close()
        if is_busy:
            raise UserError(
                f"The sessions are deleted, but another program has {self.file} open "
                "and its log may still hold them; close it and delete once more."
            )

    @contextmanager
    def _writing(self) -> Iterator[Connection]:
        """Give a transaction, which takes its turn; UserError when it fails."""
        try:
            with self._engine.begin() as connection:
                yield connection
        except OperationalError as error:
            raise self._unusable(error) from error
        except DatabaseError as error:
            if not _is_damage(error):
                raise
            raise UserError(
                f"The store {self.file} is damaged: {error.orig}. Opened anew, it is "
                "set aside; paravol progress add brings recordings back."
            ) from error

    def _unusable(self, error: OperationalError) -> UserError:
        return UserError(
            f"The store {self.file} cannot be used now: {error.orig}. Another "
            "program may be writing to it, or its disk is full; try again."
        )

    def _open(self) -> None:
        """Check the file, and make or renew its tables."""
        with self._engine.begin() as connection:
            version = int(
                connection.exec_driver_sql("PRAGMA user_version").scalar_one()
            )
            newest = tables.newest_version()
            if version > newest:
                raise UserError(
                    f"{self.file} was written by a newer version of this program (its "
                    f"version is {version}, known are those up to {newest}); use that."
                )
            marked = connection.exec_driver_sql("PRAGMA application_id").scalar_one()
            has_tables = connection.exec_driver_sql(
                "SELECT count(*) FROM sqlite_master"
            ).scalar_one()
            if has_tables and marked != tables.APPLICATION_ID:
                raise UserError(
                    f"{self.file} is another program's SQLite file; name another "
                    "with --store."
                )
            health = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar_one()
            if health != "ok":
                raise DatabaseError(
                    None, None, _corrupt(f"its pages do not fit together: {health}")
                )
            if version != newest:
                tables.bring_up_to_date(connection, version)
        self.file.chmod(0o600)

    def _require_sqlite(self) -> None:
        """Raise UserError for a named file that never was a store."""
        with self.file.open("rb") as file:
            head = file.read(len(_MAGIC))
        if head != _MAGIC:
            raise UserError(
                f"{self.file} is no progress store; name another with --store, or "
                "move it away."
            )

    def _set_aside(self) -> None:
        now = datetime.datetime.now(datetime.UTC)
        aside = self.file.with_name(f"{self.file.name}.damaged-{now:%Y%m%dT%H%M%S%f}")
        self.file.rename(aside)
        for ending in ("-wal", "-shm"):
            with suppress(FileNotFoundError):
                Path(f"{self.file}{ending}").rename(f"{aside}{ending}")
        self.told = (
            f"The store {self.file} was damaged; it is now {aside.name}, beside it, "
            "and a new one was begun. paravol progress add brings recordings back."
        )


def users_store() -> Path:
    """Return where a user's store is."""
    data = platformdirs.user_data_path("paravol", appauthor=False)
    return data / "progress.sqlite"


def _set_up(connection: sqlite3.Connection, record: object) -> None:
    # transactions are begun by _begin, which takes the writer's turn at once
    connection.isolation_level = None
    for pragma in (
        "journal_mode = WAL",
        "synchronous = FULL",
        "foreign_keys = ON",
        "secure_delete = ON",
    ):
        connection.execute(f"PRAGMA {pragma}").close()


def _begin(connection: Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE")


@contextmanager
def _one_at_a_time(folder: Path) -> Iterator[None]:
    """Let one program at a time open a store: two would both set it aside."""
    with locked(folder / ".progress.lock", creates=True):
        yield


def _is_damage(error: DatabaseError) -> bool:
    code = getattr(error.orig, "sqlite_errorcode", None)
    # the low byte is the kind, the rest says where it was found
    return code is not None and (code & 0xFF) in _DAMAGE


def _corrupt(text: str) -> sqlite3.DatabaseError:
    error = sqlite3.DatabaseError(text)
    error.sqlite_errorcode = sqlite3.SQLITE_CORRUPT
    return error


def _insert_session(connection: Connection, entry: SessionEntry, trainee: int) -> int:
    row = msgspec.structs.asdict(entry)
    for elsewhere in ("trainee", "values", "tasks", "scored"):
        del row[elsewhere]
    row["trainee_id"] = trainee
    return _new_id(connection, insert(tables.sessions).values(row))


def _new_id(connection: Connection, row: Insert) -> int:
    key = connection.execute(row).inserted_primary_key
    assert key is not None
    return int(key[0])


def _insert_details(connection: Connection, entry: SessionEntry, session: int) -> None:
    rows: dict[Table, list[dict[str, Any]]] = {
        tables.values: [msgspec.structs.asdict(value) for value in entry.values],
        tables.tasks: [{"name": n, "status": s} for n, s in entry.tasks.items()],
    }
    if entry.scored is not None:
        scored = msgspec.structs.asdict(entry.scored)
        rows[tables.parts] = [msgspec.structs.asdict(p) for p in scored.pop("parts")]
        rows[tables.assessments] = [scored]
    for table, told in rows.items():
        if told:
            of_session = [{"session_id": session, **row} for row in told]
            connection.execute(insert(table), of_session)


def _forget_empty(connection: Connection) -> None:
    """Delete trainees without a session."""
    flown = select(tables.sessions.c.trainee_id)
    connection.execute(
        delete(tables.trainees).where(tables.trainees.c.id.not_in(flown))
    )


def _named(row: Mapping[Any, Any]) -> dict[str, Any]:
    """Return a row by its columns' names, which are no plain texts in SQLAlchemy."""
    return {str(name): value for name, value in row.items()}


def _entry(connection: Connection, row: Any) -> SessionEntry:
    def rows_of(table: Table) -> list[dict[str, Any]]:
        wanted = select(*(c for c in table.c if c.name != "session_id")).where(
            table.c.session_id == row["id"]
        )
        found = connection.execute(wanted.order_by(literal_column("rowid"))).all()
        return [_named(each._mapping) for each in found]

    told = {
        **_named(row),
        "values": rows_of(tables.values),
        "tasks": {task["name"]: task["status"] for task in rows_of(tables.tasks)},
    }
    for scored in rows_of(tables.assessments):
        told["scored"] = {**scored, "parts": rows_of(tables.parts)}
    return msgspec.convert(told, SessionEntry)
