"""Commands about speed and error: names, options, help."""

from pathlib import Path

from cyclopts import App

from app.cli.root import Flag, Json
from app.cli.terminal import ProgressReporter

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
    from benchmarks.report import print_results
    from benchmarks.runner import run_bench

    with ProgressReporter(quiet=json) as stages:
        results, written = run_bench(
            suites=suite, quick=quick, out=out, fresh=fresh, progress=stages, only=only
        )
    print_results(results, written, as_json=json)
    return 0


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
    from benchmarks.reporting import report_results

    for line in report_results(results, out, write_docs=write_docs):
        print(line)
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
    release's: more than 10 % slower fails, measured thrice, and any growth of an error.

    Parameters
    ----------
    suite
        Suites to run; those of the release when left out.
    file
        The release's ratios; those kept beside the sources when left out.
    out
        Folder for what is measured.
    store
        Measure five times and keep the ratios for later instead, as for a release.
    """
    from benchmarks.guard import print_verdict, run_guard

    with ProgressReporter() as stages:
        verdict = run_guard(suite, file, out=out, store=store, progress=stages)
    return print_verdict(verdict)
