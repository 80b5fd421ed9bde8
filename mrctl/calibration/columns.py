"""What holds for the columns of every table."""

from __future__ import annotations

from itertools import pairwise

from mrctl.calibration.models import Column
from mrctl.yaml_source import Findings, KeyPath


def check_knots(column: Column, path: KeyPath, what: str, findings: Findings) -> None:
    """Knots stand in strictly increasing order."""
    values = column.values
    wrong = [index for index, (low, high) in enumerate(pairwise(values), start=1) if high <= low]
    if not wrong:
        return
    index = wrong[0]
    name = ".".join(str(part) for part in path)
    if values[index] == values[index - 1]:
        said, mend = f"{values[index]:g} stands twice", "keep one of the two rows"
    else:
        said = f"{values[index]:g} after {values[index - 1]:g} is out of order"
        mend = f"sort the rows by {what}, upwards"
    findings.add((*path, "values", index), f"`{name}`: {said}" + more(wrong), mend)


def check_lengths(
    knots: Column, columns: dict[str, Column], knots_name: str, block: str, findings: Findings
) -> None:
    """All columns of a table are of one length, and so are their standard deviations."""
    for key, column in columns.items():
        if len(column.values) != len(knots.values):
            findings.add(
                (block, key, "values"),
                f"`{block}.{key}` has {len(column.values)} values, `{knots_name}` has {len(knots.values)}",
                "give one value a row",
            )
    for key, column in {knots_name: knots, **columns}.items():
        if column.std is not None and len(column.std) != len(column.values):
            findings.add(
                (block, key, "std"),
                f"`{block}.{key}.std` has {len(column.std)} values for {len(column.values)}",
                "give one standard deviation a value, or leave out std",
            )


def more(indices: list[int]) -> str:
    """How many more there are than the one that is named."""
    return f" (and {len(indices) - 1} more)" if len(indices) > 1 else ""
