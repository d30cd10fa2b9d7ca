"""Output of a verb: tables for a reader, one JSON document for a program (--json), or nothing (--quiet)."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SCHEMA = 1
"""Format: version of the JSON documents of all verbs."""

WHERE_TO = "--out"
ABOUT_THE_CALL = ("--strict", "--json", "--quiet", "--debug")
"""Options that change the exit code or what is printed, but no result."""


@dataclass(frozen=True)
class OutputMode:
    """Output options of a command line.

    Attributes
    ----------
    json : bool
        Print one JSON document on standard output in place of tables.
    quiet : bool
        Print neither tables nor progress: only files, errors and the exit code.
    command : str
        The command line as printed in the report.
    """

    json: bool = False
    quiet: bool = False
    command: str = ""

    @property
    def silent(self) -> bool:
        """Whether tables are suppressed."""
        return self.json or self.quiet


TO_A_PERSON = OutputMode()
_MODE: ContextVar[OutputMode] = ContextVar("output", default=TO_A_PERSON)


def mode() -> OutputMode:
    """The output mode of the current command."""
    return _MODE.get()


def taken_out(words: Sequence[str]) -> list[str]:
    """The arguments without --json and --quiet, wherever they occur before `--`; they set the mode of the command."""
    end = words.index("--") if "--" in words else len(words)
    options, rest = words[:end], words[end:]
    found = OutputMode("--json" in options, "--quiet" in options, command_line(words))
    _MODE.set(found)
    return [*(word for word in options if word not in ("--json", "--quiet")), *rest]


def command_line(words: Iterable[str]) -> str:
    """The command as given, without options that change no result: the same result gives the same file everywhere.

    Absolute paths are reduced to their last part: a folder of one machine means nothing elsewhere.
    """
    import shlex

    shown: list[str] = []
    given = iter(words)
    for word in given:
        if word == WHERE_TO:
            next(given, None)
        elif word not in ABOUT_THE_CALL and not word.startswith(f"{WHERE_TO}="):
            shown.append(Path(word).name if Path(word).is_absolute() else word)
    return shlex.join(["aerosid", *shown])


def read_no_more() -> None:
    """Redirect the rest of standard output to null: the pipe was closed, as in `aerosid close-loop ... | head`."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def tell(document: Callable[[], Mapping[str, Any] | str]) -> None:
    """Print a JSON document where --json is given; NaN and infinite numbers become null."""
    if not mode().json:
        return
    import json

    from aerosid.notation import finite_throughout

    made = document()
    if isinstance(made, str):
        text = made
    else:
        text = json.dumps(finite_throughout(made), indent=2, ensure_ascii=False, allow_nan=False)
    sys.stdout.write(text if text.endswith("\n") else f"{text}\n")


def written(verb: str, files: Iterable[Path], document: Callable[[], Mapping[str, Any] | str] | None = None) -> None:
    """Print which files were written: in words, or as the verb's JSON document."""
    from aerosid.cli.options import console

    names = [str(file) for file in files]
    console().print(f"Written: {', '.join(names)}", soft_wrap=True)
    tell(document or (lambda: headed(verb, {"files": names})))


def headed(verb: str, content: Mapping[str, Any]) -> dict[str, Any]:
    """A document with its schema version, the version of aerosid, and the name of the verb."""
    from aerosid import __version__

    return {"schema": SCHEMA, "aerosid": __version__, "verb": verb, **content}


def loudly() -> None:
    """Reset the mode, for further commands in the same process."""
    _MODE.set(TO_A_PERSON)


def verb_of(error: Exception) -> str:
    """The command that was called wrongly, as typed."""
    names: list[str] = []
    context = getattr(error, "ctx", None)
    while context is not None and context.parent is not None:
        names.insert(0, str(context.info_name))
        context = context.parent
    return " ".join(["aerosid", *names])
