"""Remark on channels that fit less well after the correction of the instruments than as recorded.

Apart from the tables of the terminal, which the report does without.
"""

from __future__ import annotations

from aerosid.compatibility import KinematicConsistency
from aerosid.notation import listed
from aerosid.reporting.settings import REMARKS


def note_on_worse_channels(agreement: KinematicConsistency) -> str:
    """Note on channels that fit less well after the correction than as recorded; empty where there is none."""
    worse = [row for row in agreement.channels if row.after > REMARKS.corrected_worse * row.before]
    places = [
        f"{listed([row.channel for row in worse if row.log == log])} of {log}"
        for log in dict.fromkeys(row.log for row in worse)
    ]
    if not places:
        return ""
    return (
        f"{listed(places)} {'fit' if len(worse) > 1 else 'fits'} less well after the correction than as recorded: the "
        "corrections are the maximum-likelihood estimate over all channels, each weighted by its own coloured noise, "
        "and improve the other channels at the expense of these."
    )
