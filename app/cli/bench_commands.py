"""Commands about speed and error: names, options, help."""

from pathlib import Path

from cyclopts import App

from app.cli.root import Flag, Json

bench = App(
    name="bench",
    help="Measure run time against error, report it, guard it.",
)


@bench.default
def measure(
    *,
    suite: tuple[str, ...] = (),
    only: str = "",
    quick: Flag = False,
    out: Path = Path("out/bench"),
    fresh: Flag = False,
    json: Json = False,
) -> int:
    """Measure run time against error, peers in the same run.

    Parameters
    ----------
    suite
        Suites to run; all of them when left out.
    only
        Measure the rows whose case/mode holds this text, and their baselines.
    quick
        Small sizes, for a first look.
    out
        Folder for results.json and report.html; an interrupted run goes on there.
    fresh
        Start over instead of going on.
    """
    from benchmarks.runner import run_bench

    return run_bench(
        suites=suite, quick=quick, out=out, fresh=fresh, as_json=json, only=only
    )


@bench.command
def report(results: Path, *, out: Path | None = None, write_docs: Flag = False) -> int:
    """Write one HTML page from results: errors, fronts, growth, skipping.

    Parameters
    ----------
    results
        A results.json that paravol bench left.
    out
        The page; beside the results when left out.
    write_docs
        Also keep the results beside the sources, and write the documents that quote
        them: docs/measurements.md and the figures of README.md.
    """
    from benchmarks.reporting import write_documents, write_report
    from benchmarks.schema import load_results
    from disk import UserError, demand_place

    page = out or results.with_name("report.html")
    demand_place(page)
    if not results.is_file():
        raise UserError(f"{results} is not there; paravol bench makes it")
    found = load_results(results)
    print(f"{write_report(found, page)}: {len(found.rows)} rows in one file.")
    if write_docs:
        for path in write_documents(found):
            print(path)
    return 0


@bench.command
def guard(
    *,
    suite: tuple[str, ...] = (),
    file: Path | None = None,
    out: Path = Path("out/bench-guard"),
    store: Flag = False,
) -> int:
    """Compare with the last release; 1 where a row is slower or less right.

    Every row is compared with its baseline of the same run, and that ratio with the
    release's: more than 10 % slower fails, twice measured, and any growth of an error.

    Parameters
    ----------
    suite
        Suites to run; those of the release when left out.
    file
        The release's ratios; those kept beside the sources when left out.
    out
        Folder for what is measured.
    store
        Measure twice and keep the ratios for later instead, as for a release.
    """
    from benchmarks.guard import run_guard
    from benchmarks.ratios import RELEASED

    return run_guard(suites=suite, file=file or RELEASED, out=out, store=store)
