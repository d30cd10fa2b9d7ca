"""What holds in every test's process."""

import gc

import pytest


def pytest_collection_finish(session: pytest.Session) -> None:
    """Seek cycles as rarely as the command line does: thousands of imported modules are looked through each time."""
    gc.freeze()
    gc.set_threshold(100_000, 20, 100)
