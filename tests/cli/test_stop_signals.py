"""A run that is interrupted or asked to end says so, leaves with the code of the signal, and leaves no file behind."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from aerosid.cli.stop_signals import Termination, termination_as_interrupt

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


WAITING = """
import sys, time
from aerosid.cli.stop_signals import INTERRUPTED, unless_ended
def run(_told):
    try:
        print("begun", flush=True)
        time.sleep(60)
    except KeyboardInterrupt:
        print("stopping", flush=True)
        time.sleep(60)  # as for a worker that does not end
        return INTERRUPTED
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.exit(unless_ended(run)[0])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_second_signal_ends_the_process_at_once(number: signal.Signals, code: int) -> None:
    with subprocess.Popen(
        (sys.executable, "-c", WAITING), env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True,
        stderr=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as run:  # fmt: skip
        assert run.stdout is not None
        assert run.stdout.readline() == "begun\n"
        run.send_signal(number)
        run.send_signal(number)  # passed on by the process that started it: still the same request
        assert run.stdout.readline() == "stopping\n"
        time.sleep(0.3)
        run.send_signal(number)
        _, told = run.communicate(timeout=20)
    assert run.returncode == code
    assert told.startswith("aerosid: ")
    assert "Traceback" not in told


WRITING = """
import signal, sys, time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from aerosid.cli.stop_signals import unless_ended
from aerosid.file_set import unfinished_folder
from aerosid.studies.workers import end_with_parent
def write(place):
    with unfinished_folder(Path(place), "report") as folder:
        for count in range(6000):
            (folder / str(count)).write_text("begun")
            try:
                time.sleep(0.01)
            except KeyboardInterrupt:
                pass  # as of what does not end for a first signal
def run(_told):
    if sys.argv[1] == "here":
        write(".")
    else:
        with ProcessPoolExecutor(1, get_context("spawn"), initializer=end_with_parent) as executor:
            future = executor.submit(write, ".")
            while not future.done():
                try:
                    time.sleep(0.01)
                except KeyboardInterrupt:
                    pass
    return 0
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(unless_ended(run)[0])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("writer", ["here", "worker"])
def test_a_second_signal_leaves_no_unfinished_folder(writer: str, tmp_path: Path) -> None:
    program = tmp_path / "writing.py"
    program.write_text(WRITING)
    with subprocess.Popen(
        (sys.executable, str(program), writer), cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True,
        stderr=subprocess.PIPE,
    ) as run:  # fmt: skip
        while not list(tmp_path.glob(".report-*.part/1*")):
            assert run.poll() is None
            time.sleep(0.02)
        run.send_signal(signal.SIGINT)
        time.sleep(0.3)
        run.send_signal(signal.SIGINT)
        _, told = run.communicate(timeout=20)  # until the worker has closed it too
    assert run.returncode == 130
    assert told.startswith("aerosid: interrupted before everything was tidied up.\n")
    assert [path.name for path in tmp_path.iterdir()] == ["writing.py"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("second", [None, pytest.param(0.3, marks=pytest.mark.slow)])
def test_a_study_ends_with_its_workers(second: float | None, tmp_path: Path) -> None:
    # All processes receive the signal, as from a terminal.
    words = ("study", "--aircraft", "light_transport", "--runs", "300", "--workers", "2", "--out", "out")
    with subprocess.Popen(
        (sys.executable, "-c", PROGRAM, *words), cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True,
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True,
    ) as run:  # fmt: skip
        assert run.stderr is not None
        assert "runs, 0 of" in run.stderr.readline()
        time.sleep(4.0)  # workers have begun to work
        os.killpg(run.pid, signal.SIGINT)
        if second is not None:
            time.sleep(second)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGINT)
        _, told = run.communicate(timeout=30)  # until the last process has closed it
    assert run.returncode == 130
    assert "aerosid: interrupted" in told
    assert "Traceback" not in told


def test_an_interrupt_in_a_compiled_call_is_one() -> None:
    def returned(text: str, cause: BaseException | None, context: BaseException | None = None) -> SystemError:
        error = SystemError(text)
        error.__cause__, error.__context__ = cause, context
        return error

    with_exception = "returned a result with an exception set"
    assert Termination().explains(returned(with_exception, KeyboardInterrupt()))
    assert Termination().explains(returned(with_exception, None, KeyboardInterrupt()))
    assert Termination().explains(returned(with_exception, returned(with_exception, KeyboardInterrupt())))
    assert not Termination().explains(returned(with_exception, ValueError()))
    assert not Termination().explains(returned("returned NULL without setting an exception", None))


def test_an_error_after_a_signal_is_its_consequence() -> None:
    # As of an import that the signal reached: "numba._devicearray failed to import".
    told = Termination()
    assert not told.explains(ImportError("failed to import"))
    told.since = time.monotonic()
    assert told.explains(ImportError("failed to import"))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.slow
def test_a_warm_up_that_is_interrupted_alone_ends_its_workers(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path), "AEROSID_CACHE_DIR": ""}
    with subprocess.Popen(
        (sys.executable, "-c", PROGRAM, "warm-up", "--sample", "--workers", "2"), cwd=tmp_path, env=environment,
        text=True, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
    ) as run:  # fmt: skip
        assert run.stderr is not None
        assert "Compiling" in run.stderr.readline()
        time.sleep(5.0)  # workers compile what takes them a minute
        run.send_signal(signal.SIGINT)
        _, told = run.communicate(timeout=15)  # until the last process has closed it
    assert run.returncode == 130
    assert told == "aerosid: interrupted.\n"
