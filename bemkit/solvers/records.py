"""Records of several solves as those of one."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from bemkit.solvers.base import StepRecord


def continued(records: Sequence[StepRecord], further: Iterable[StepRecord], words: str = "") -> tuple[StepRecord, ...]:
    """Return the records of a solve after those of the solves before it.

    Parameters
    ----------
    records : sequence of StepRecord
        Of the solves before.
    further : iterable of StepRecord
        Of the next one: its steps and linear solves go on where those of the solves before end.
    words : str
        Begin the messages of the further records.
    """
    first, solves = (records[-1].step + 1, records[-1].linear_solves) if records else (0, 0)
    return (
        *records,
        *(
            replace(
                record,
                step=first + record.step,
                linear_solves=solves + record.linear_solves,
                message="; ".join(filter(None, (words, record.message))),
            )
            for record in further
        ),
    )
