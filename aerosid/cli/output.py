"""Output of a verb: tables for a person, one JSON document for a program (--json), or nothing (--quiet)."""

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
"""Words that change the exit code or what is printed, and no number."""


@dataclass(frozen=True)
class OutputMode:
    """What the words of the command line ask for.

    Attributes
    ----------
    json : bool
        One JSON document on standard output in place of tables.
    quiet : bool
        Neither tables nor progress: files, errors and the exit code alone.
    command : str
        The command line as the report prints it.
    """

    json: bool = False
    quiet: bool = False
    command: str = ""

    @property
    def silent(self) -> bool:
        """Whether no table is printed."""
        return self.json or self.quiet


TO_A_PERSON = OutputMode()
_MODE: ContextVar[OutputMode] = ContextVar("output", default=TO_A_PERSON)


def mode() -> OutputMode:
    """The mode of the present command."""
    return _MODE.get()


def taken_out(words: Sequence[str]) -> list[str]:
    """The words without --json and --quiet, wherever they stand before `--`; they become the mode of the command."""
    end = words.index("--") if "--" in words else len(words)
    asked, rest = words[:end], words[end:]
    found = OutputMode("--json" in asked, "--quiet" in asked, command_line(words))
    _MODE.set(found)
    return [*(word for word in asked if word not in ("--json", "--quiet")), *rest]


def command_line(words: Iterable[str]) -> str:
    """The command as it was given, but for words that change no number: the same result is the same file everywhere.

    Absolute paths stand by their last part: a folder of one machine means nothing elsewhere.
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
    """Let the rest of standard output go nowhere: its reader has gone, as in `aerosid close-loop ... | head`."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def tell(document: Callable[[], Mapping[str, Any] | str]) -> None:
    """Print a JSON document where one is asked for; NaN and infinite numbers become null."""
    if not mode().json:
        return
    import json

    made = document()
    text = made if isinstance(made, str) else json.dumps(_finite(made), indent=2, ensure_ascii=False, allow_nan=False)
    sys.stdout.write(text if text.endswith("\n") else f"{text}\n")


def written(verb: str, files: Iterable[Path], document: Callable[[], Mapping[str, Any] | str] | None = None) -> None:
    """Say which files were written: in words, or as the verb's document."""
    from aerosid.cli.options import console

    names = [str(file) for file in files]
    console().print(f"Written: {', '.join(names)}", soft_wrap=True)
    tell(document or (lambda: headed(verb, {"files": names})))


def headed(verb: str, content: Mapping[str, Any]) -> dict[str, Any]:
    """A document with its version, that of aerosid and the verb that it is of."""
    from aerosid import __version__

    return {"schema": SCHEMA, "aerosid": __version__, "verb": verb, **content}


def loudly() -> None:
    """Forget the mode, for commands that follow in one process."""
    _MODE.set(TO_A_PERSON)


def _finite(value: Any) -> Any:
    import math

    if isinstance(value, Mapping):
        return {str(key): _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
