"""Selection of a ready channel map: the one with the most columns present in a recording."""

from __future__ import annotations

from aerosid.logs.column_lookup import Found, LookupProblem, find_column
from aerosid.logs.formats import FORMATS, ready_maps
from aerosid.logs.formats.channel_map import ChannelColumnMap, load_channel_map
from aerosid.logs.recording import Recording
from aerosid.logs.settings import READING

_TEXT = ("text", "ascii", "csv")  # readings of one kind of file, which a map for text reads all


def fitting_ready_map(recording: Recording) -> str | None:
    """The name of the ready map of a recording's format, or of the one that finds the most channels in it.

    Parameters
    ----------
    recording : Recording
        As the recorder made it.

    Returns
    -------
    str or None
        A value for `channels`; None where no map finds `READING.fewest_mapped` channels.
    """
    form = FORMATS.get(recording.format)
    if form is not None and form.ready_map is not None:
        return form.ready_map
    kind = "text" if recording.format in _TEXT else recording.format
    fits = {name: len(found_in(recording, name)) for name, path in ready_maps().items() if _format(name) == kind}
    best = max(fits, key=lambda name: fits[name], default=None)
    return best if best is not None and fits[best] >= READING.fewest_mapped else None


def _format(name: str) -> str | None:
    return load_channel_map(ready_maps()[name]).format


def found_in(recording: Recording, name: str) -> dict[str, tuple[ChannelColumnMap, list[Found]]]:
    """Channels of a ready map present in a recording: for each the first alternative that exists, and its columns.

    Parameters
    ----------
    recording : Recording
        As the recorder made it.
    name : str
        Of the ready map.
    """
    found = {}
    for channel, alternatives in load_channel_map(ready_maps()[name]).channels.items():
        for entry in alternatives:
            try:
                found[channel] = entry, [find_column(recording, part) for part in entry.parts]
            except LookupProblem:
                continue
            break
    return found
