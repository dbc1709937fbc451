"""What a case says of its scan's quality, as lines to print."""

from anatomy.case import CaseRecord


def quality_lines(record: CaseRecord) -> list[str]:
    """Give one line for each finding: what was measured, and what it limits."""
    return [
        f"{finding.told}. Limit: {finding.limits}" if finding.limits else finding.told
        for finding in record.quality
    ]
