"""A run that is interrupted or asked to end says so, leaves with the code of the signal, and leaves no file behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from aerosid.cli.stop_signals import termination_as_interrupt

ROOT = Path(__file__).resolve().parents[2]

# Python takes SIGINT as an interrupt only where whoever starts it does not ignore it, as a shell's background does.
PROGRAM = """
import signal, sys
from aerosid.cli.main import main
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize(
    ("number", "said", "code"), [(signal.SIGINT, "interrupted.", 130), (signal.SIGTERM, "terminated.", 143)]
)
def test_a_run_that_is_ended_says_so_and_leaves_no_file(
    number: signal.Signals, said: str, code: int, tmp_path: Path
) -> None:
    flights = ROOT / "flight_data"
    words = ("close-loop", str(flights / "light_transport_doublet.csv"), "--aircraft", "light_transport")
    words = (*words, "--validate", str(flights / "light_transport_3211.csv"), "--out", "out")
    with subprocess.Popen(
        (sys.executable, "-c", PROGRAM, *words), cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True,
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
    ) as run:  # fmt: skip
        assert run.stderr is not None
        for line in run.stderr:
            if "re-estimating the declared model" in line:
                break
        run.send_signal(number)
        told = run.stderr.read()
    assert run.returncode == code
    assert told.splitlines()[-1] == f"aerosid: {said}"
    assert "Traceback" not in told
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot copy a process")
def test_a_copy_of_the_process_ends_at_once() -> None:
    ready, begun = os.pipe()
    with termination_as_interrupt() as termination:
        copy = os.fork()
        if copy == 0:
            try:
                os.write(begun, b"1")  # Python forgets signals that come before a copy has begun
                for _ in range(6000):  # in short pieces: a signal just before one of them is seen after it
                    time.sleep(0.01)
            finally:
                os._exit(1)
        os.read(ready, 1)
        os.kill(copy, signal.SIGTERM)
        _, status = os.waitpid(copy, 0)
    os.close(ready)
    os.close(begun)
    assert os.WTERMSIG(status) == signal.SIGTERM
    assert not termination.requested
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
