"""The figures that the README quotes: ourselves beside the best peer there is."""

from benchmarks.reporting.pages import markdown_table
from benchmarks.reporting.section import Table, duration
from benchmarks.reporting.survey import skipping_table
from benchmarks.schema import Results, Row
from system import UserError

BEGIN = "<!-- figures: written by paravol bench report --write-docs -->"
END = "<!-- end of figures -->"

QUOTED = ("ART, equal error", "FSR gaussian")
PEERS = "VTK"
WITHIN = ("inside", "nasopharynx")
"""Views from within the nose; the others stand in the measurements."""


def quotes(results: Results) -> str:
    """Return the README's figures: a table, and a line on skipping.

    Of pictures with no more error than the peer's, that beside the peer's medium step
    is quoted; splats are quoted where the peer drew the same ones.
    """
    by_key = {(row.suite, row.case, row.mode): row for row in results.rows}
    cells = []
    for row in sorted(results.rows, key=lambda row: (row.case, row.mode)):
        peer = by_key.get((row.suite, row.case, f"{row.baseline}"))
        if peer is None or not _is_quoted(row):
            continue
        cells.append(
            (
                row.case,
                row.mode,
                *(duration(row.seconds), f"{row.rmse:.2e}"),
                *(duration(row.baseline_s or 0.0), f"{peer.rmse:.2e}"),
                f"{row.ratio:.3g}",
            )
        )
    head = ("picture", "who", "time", "RMSE", "VTK's time", "RMSE", "times faster")
    parts = [_where(results)]
    if cells:
        parts.append(markdown_table(Table("", head, cells, frozenset({0, 1}))))
    skips = skipping_table(results.rows)
    if skips.rows:
        right = len(skips.rows) - len(skips.bad)
        parts.append(
            f"Skipping what a scene does not need: {right} of {len(skips.rows)} rows "
            "have the same bits as without it.\n"
        )
    return "\n".join(parts)


def filled(text: str, results: Results) -> str:
    """Return a document with the figures between its two marks put in anew.

    Raises UserError where the marks are not there once each, in their order.
    """
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise UserError(f"the document needs one line {BEGIN!r} and one {END!r}")
    before, _, rest = text.partition(BEGIN)
    if END not in rest:
        raise UserError(f"the line {END!r} stands before {BEGIN!r}")
    after = rest.partition(END)[2]
    return f"{before}{BEGIN}\n\n{quotes(results)}\n{END}{after}"


def _is_quoted(row: Row) -> bool:
    baseline = row.baseline or ""
    is_within = bool(set(WITHIN) & set(row.case.split("/")))
    is_ours = row.settings.get("series") in QUOTED and row.ratio is not None
    is_medium = ", step" not in baseline or baseline.endswith("step 0.5")
    return is_within and is_ours and is_medium and baseline.startswith(PEERS)


def _where(results: Results) -> str:
    sources: dict[str, set[str]] = {}
    for row in results.rows:
        machine = f"{row.machine.cpu}, {row.machine.cores} cores"
        sources.setdefault(machine, set()).add(row.commit)
    told = [
        f"{machine}, sources {', '.join(sorted(commits))}"
        for machine, commits in sorted(sources.items())
    ]
    return f"Measured on {'; '.join(told)}; one thread, CPU time.\n"
