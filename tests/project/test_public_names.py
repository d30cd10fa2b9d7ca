"""The names at the top of the package: all of them exist, and none is loaded before it is used."""

from __future__ import annotations

import ast
import subprocess
import sys

import aerosid
from aerosid import model_error


def test_all_is_what_imports() -> None:
    assert sorted(aerosid.__all__) == sorted(aerosid._HOMES)
    for name in aerosid.__all__:
        assert getattr(aerosid, name).__name__ == name


def test_the_names_of_the_model_error_are_what_imports() -> None:
    assert sorted(model_error.__all__) == sorted(model_error._HOMES) == dir(model_error)
    for name in model_error.__all__:
        assert getattr(model_error, name).__name__ == name
    assert not hasattr(model_error, "no_such_name")


def test_an_unknown_name_is_an_attribute_error() -> None:
    assert not hasattr(aerosid, "no_such_name")


def test_import_loads_nothing_but_itself() -> None:
    code = "import sys; before = set(sys.modules); import aerosid; print(sorted(set(sys.modules) - before))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in ast.literal_eval(run.stdout)}
    assert loaded.isdisjoint({"numpy", "scipy", "numba", "pandas", "matplotlib"})
    assert "aerosid.loop" not in run.stdout
