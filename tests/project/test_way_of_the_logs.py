"""The way of the logs from the command line to the verdict: down through the packages, seldom back up.

Entered, depth first in the order in which calls are evaluated, is each function of the package that takes a flight (a
parameter annotated with FlightLog or Manoeuvre) and is called, by a name that imports tell, from one that was entered.
One that was entered before is entered again and not followed again. A package (a loose module, where there is none)
stands one floor above the highest that it imports. A climb is a function on a higher floor than the one entered before.
`python tests/project/test_way_of_the_logs.py aerosid` counts; at revision 59b9641, from `cli` in place of `cli.main`,
it counted 36 climbs in 122 functions.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from pathlib import Path

MOST_CLIMBS = 10
"""Climbs, 1: what stands; a third of those at revision 59b9641 would be 12."""

FLIGHTS = {"FlightLog", "Manoeuvre"}
"""Types of a flight."""

Place = tuple[str, str]
"""Module below the package, and name there."""


class Package:
    """Definitions and imports of a package, as its text has them."""

    def __init__(self, root: Path) -> None:
        self._name = root.name
        self._modules: dict[str, ast.Module] = {}
        for path in sorted(root.rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            module = ".".join(part for part in parts if part != "__init__")
            self._modules[module] = ast.parse(path.read_text(encoding="utf-8"))
        self._imported = {module: dict(self._imports(tree)) for module, tree in self._modules.items()}
        self._functions = {
            (module, node.name): node
            for module, tree in self._modules.items()
            for node in tree.body
            if isinstance(node, ast.FunctionDef)
        }

    def _imports(self, tree: ast.Module) -> Iterator[tuple[str, Place]]:
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == self._name:
                for alias in node.names:
                    yield alias.asname or alias.name, (node.module[len(self._name) + 1 :], alias.name)

    def _called(self, module: str, name: str) -> Place | None:
        """The function that a name in a module stands for, through what packages hand on."""
        seen: set[Place] = set()
        while (module, name) not in self._functions:
            if (module, name) in seen or name not in self._imported.get(module, {}):
                return None
            seen.add((module, name))
            module, name = self._imported[module][name]
        return module, name

    @cached_property
    def floors(self) -> dict[str, int]:
        """Of each folder or loose module: how many stand below it, one on another."""
        uses: dict[str, set[str]] = {}
        for module, imported in self._imported.items():
            below = {source.split(".")[0] or name for source, name in imported.values()}
            uses.setdefault(module.split(".")[0], set()).update(below)
        floors: dict[str, int] = {}

        def floor(unit: str) -> int:
            if unit not in floors:
                floors[unit] = 0
                floors[unit] = 1 + max((floor(each) for each in uses[unit] if each in uses), default=0)
            return floors[unit]

        return {unit: floor(unit) for unit in uses}

    def way(self, start: Place) -> list[Place]:
        """The functions that are entered, in order."""
        route: list[Place] = []

        def enter(place: Place) -> None:
            known = place in route
            route.append(place)
            if not known:
                for call in _calls(self._functions[place]):
                    called = self._called(place[0], call.func.id) if isinstance(call.func, ast.Name) else None
                    if called is not None and _takes_a_flight(self._functions[called]):
                        enter(called)

        enter(start)
        return route

    def climbs(self, route: list[Place]) -> int:
        """How often a function stands on a higher floor than the one before."""
        floors = [self.floors[module.split(".")[0]] for module, _ in route]
        return sum(after > before for before, after in pairwise(floors))


def _calls(function: ast.AST) -> Iterator[ast.Call]:
    """The calls of a function in the order of their evaluation: those in arguments before the one that takes them."""
    for child in ast.iter_child_nodes(function):
        yield from _calls(child)
    if isinstance(function, ast.Call):
        yield function


def _takes_a_flight(function: ast.FunctionDef) -> bool:
    arguments = (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)
    written = " ".join(ast.unparse(argument.annotation) for argument in arguments if argument.annotation)
    return any(name in written for name in FLIGHTS)


def test_the_logs_climb_back_up_at_most_a_third_as_often_as_before() -> None:
    package = Package(Path(__file__).resolve().parents[2] / "aerosid")
    route = package.way(("cli.main", "close_loop_command"))
    reached = {module.split(".")[0] for module, _ in route}
    assert {"loop", "estimation", "compatibility", "logs"} <= reached
    assert package.climbs(route) <= MOST_CLIMBS


if __name__ == "__main__":
    counted = Package(Path(sys.argv[1]))
    passed = counted.way((sys.argv[2] if len(sys.argv) > 2 else "cli.main", "close_loop_command"))
    sys.stdout.write(f"{len(passed)} functions, {counted.climbs(passed)} climbs\n")
