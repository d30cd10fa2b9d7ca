"""Generate the tables of options in command_line.md from the command line.

python docs/fill_options.py
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import typer

from aerosid.cli.main import app

PAGE = Path(__file__).with_name("command_line.md")
MARK = re.compile(r"<!-- options of ([\w -]+) -->\n.*?<!-- end -->", re.DOTALL)


def commands() -> dict[str, Any]:
    """Commands and subcommands by the words that call them."""
    found: dict[str, Any] = {}

    def walk(command: Any, words: tuple[str, ...]) -> None:
        under = getattr(command, "commands", None)
        if under is None:
            found[" ".join(words)] = command
        else:
            for name, below in under.items():
                walk(below, (*words, name))

    walk(typer.main.get_command(app), ())
    return found


def option_table(command: Any) -> str:
    """One row for each option and argument as `--help` prints it."""
    context = command.context_class(command)
    records = [record for record in (parameter.get_help_record(context) for parameter in command.params) if record]
    rows = [f"| `{_cell(words)}` | {_cell(text)} |" for words, text in records]
    return "\n".join(["| option | meaning |", "|---|---|", *rows])


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def filled(page: str) -> str:
    """The page with every marked table regenerated; KeyError where a mark names no command."""
    known = commands()
    return MARK.sub(
        lambda match: f"<!-- options of {match[1]} -->\n{option_table(known[match[1]])}\n<!-- end -->", page
    )


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
