"""The command line: verbs, exit codes, a one-sentence message for every error."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from broken_inputs import GOOD

import aerosid
from aerosid.aircraft.bundled import bundled_folder
from aerosid.cli.main import app, main
from aerosid.logs.formats import FORMATS

README = Path(__file__).resolve().parents[2] / "README.md"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "flight.csv"
    path.write_text(GOOD)
    return path


def test_check_prints_channels_and_what_to_do(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # Three seconds without a control movement: no error of the file, and the single verdict says what is lacking.
    assert main(["check", str(log)]) == 0
    output = capsys.readouterr().out
    for words in (
        "flight.csv",
        "alpha",
        "rad/s",
        "30 samples",
        "every 0.1 s",
        "can be read",
        "nothing is excited: fly",
    ):
        assert words in output
    assert "\x1b" not in output


def test_check_takes_several_logs_and_a_map(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    channel_map = tmp_path / "map.toml"
    channel_map.write_text('schema = 1\ntime = { column = "time" }\n[channels]\nstick = { column = "q" }\n')
    assert main(["check", str(log), str(log), "--channels", str(channel_map)]) == 3
    output = capsys.readouterr().out
    assert output.count("30 samples") == 2
    assert "stick" in output
    assert "needed: q (pitch rate)" in output


def test_noise_that_cannot_be_estimated_is_one_note_and_a_dash(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Computed histories: smoother than any sensor.
    k = np.arange(300)
    swing = 0.1 * np.sin(0.05 * k) * np.exp(-0.01 * k)
    rows = [f"{0.1 * n:.1f},{100 + 5 * x:.9f},{x:.9f},{0.5 * x:.9f},{0.3 * x:.9f}" for n, x in enumerate(swing)]
    path = tmp_path / "computed.csv"
    path.write_text("time [s],V [m/s],alpha [rad],q [rad/s],delta_e [rad]\n" + "\n".join(rows) + "\n")
    main(["check", str(path)])
    output = capsys.readouterr().out
    assert output.count("the noise cannot be estimated") == 1
    assert "note: V, alpha and q (it is smoother than any sensor" in output
    (row,) = [line for line in output.splitlines() if line.startswith("│ alpha ")]
    assert [cell.strip() for cell in row.split("│")][-3:-1] == ["–", "–"]


def test_formats_lists_every_format(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["formats"]) == 0
    output = capsys.readouterr().out
    for name, entry in FORMATS.items():
        assert name in output
        assert entry.description in output


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"aerosid {aerosid.__version__}\n"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("batch flight_data --aircraft light_transport --workers 0", "--workers is 0"),
        ("study --aircraft light_transport --workers 0", "--workers is 0"),
        ("study --aircraft light_transport --snr abc", "--snr is 'abc'"),
        ("study --aircraft light_transport --snr=-3", "--snr -3 is not positive"),
        ("study --aircraft light_transport --effect C_m:foo^2=1 --runs 2", "--effect C_m:foo^2: foo is not part of"),
    ],
)
def test_what_is_refused_leaves_no_folder(
    words: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flight_data").mkdir()
    (tmp_path / "flight_data" / "flight.csv").write_text(GOOD)
    assert main([*words.split(), "--out", "out/deep"]) == 2
    printed = capsys.readouterr().err
    assert told in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_span_that_ends_before_it_begins_is_wrong_usage(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--from", "10", "--to", "5"], ["--from", "5", "--to", "5"]):
        assert main(["check", str(log), *words]) == 2
        assert "expected the earlier time first" in capsys.readouterr().err


def test_a_log_whose_name_just_fits_has_no_map_beside_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"{'x' * 240}.csv"
    path.write_text(GOOD)
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fly-to-the-moon"], "fly-to-the-moon"),
        (["check"], "LOG"),
        (["check", "a.csv", "--no-such-option"], "--no-such-option"),
        (["formats", "superfluous"], "superfluous"),
    ],
)
def test_wrong_usage_is_exit_2_and_one_sentence(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


@pytest.mark.parametrize("arguments", [["--debug", "check", "none.csv"], ["check", "none.csv", "--debug"]])
def test_debug_adds_a_traceback_wherever_it_stands(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 3
    error = capsys.readouterr().err
    assert "Traceback" in error
    assert error.splitlines()[-1].startswith("aerosid: none.csv: the log does not exist")


@pytest.mark.parametrize("given", ["yesterday", "", "1e9"])
def test_a_wrong_date_of_the_environment_is_one_sentence_before_any_library_reads_it(
    monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    # In a process of its own: numpy fails on the variable where it is imported first.
    monkeypatch.setenv("SOURCE_DATE_EPOCH", given)
    ran = subprocess.run(
        [sys.executable, "-m", "aerosid", "check", "none.csv"], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 2
    assert ran.stderr.startswith(
        f"aerosid: the environment variable SOURCE_DATE_EPOCH is {given!r}, expected whole seconds"
    )
    assert ran.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ("check LOG --from 1000", 3, "no samples lie after 1000 s, but the log runs from 0 to 2.9 s"),
        ("check LOG --from 2 --to 1", 2, "--from is 2 and --to 1 s, expected the earlier time first"),
        ("check LOG --from 2.9", 3, "1 sample lies after 2.9 s"),
        ("check LOG --from abc", 2, "unable to parse string as a number. See `aerosid check --help`."),
        (
            "study --aircraft light_transport --samples 99999999999",
            2,
            "--samples is 99999999999; a manoeuvre needs at least 50",
        ),
        ("study --aircraft light_transport --airspeed 0", 2, "--airspeed is 0; give a positive number."),
        ("study --aircraft light_transport --density -1", 2, "--density is -1; give a positive number."),
        ("fly L410 --out f.csv --seed -1", 2, "--seed is -1; give a number that is not negative."),
        (
            "fly L410 --out f.csv --effect control_lag=-5",
            2,
            "control_lag was given -5; give time constant [s] of at least 0",
        ),
        ("close-loop FLIGHT --aircraft light_transport --out LOG", 2, "cannot be written"),
        ("warm-up --workers -2", 2, "--workers is -2; at least 1 is needed."),
        (
            "export light_transport --format davem --date 2026-13-45",
            2,
            "--date is '2026-13-45', expected a day as YYYY-MM-DD",
        ),
        ("export light_transport --format davem --alpha-range 5,1", 2, "--alpha-range runs from 5 to 1 deg"),
        ("export light_transport --format davem --alpha-range a,b", 2, "write --alpha-range -2,12"),
    ],
)
def test_wrong_numbers_are_told_as_they_were_given(
    words: str, code: int, message: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flight = str(bundled_folder("flight_data") / "light_transport_doublet.csv")
    assert main(words.replace("LOG", str(log)).replace("FLIGHT", flight).split()) == code
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.parametrize("verb", ["check", "find"])
def test_a_number_that_no_sensor_reads_is_refused_by_its_place(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "huge.csv"
    path.write_text(GOOD.replace(",101,", ",1e308,", 1))
    assert main([verb, str(path)]) == 3
    error = capsys.readouterr().err
    assert "channel V holds 1e+308 at 0.1 s (sample 2)" in error
    assert error.count("\n") == 1


class FaultyOutput(io.StringIO):
    """A standard output that fails with an unexpected error."""

    def write(self, text: str) -> int:
        raise ZeroDivisionError("two\nlines")


def test_an_unexpected_error_is_one_sentence_and_exit_4(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdout", FaultyOutput())
    assert main(["formats"]) == 4
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "ZeroDivisionError" in error
    assert "two lines" in error


def output_of(code: str) -> str:
    """Of an interpreter of its own, which says on its error stream why it failed."""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; from aerosid.cli.main import main; main(['--help']); "
        "heavy = {'numpy', 'pandas', 'scipy', 'numba', 'pint', 'pydantic', 'matplotlib', 'jsbsim'} & set(sys.modules); "
        "sys.exit(' '.join(sorted(heavy)) or 0)"
    )
    output_of(code)


def test_reading_si_imports_neither_units_nor_matlab(log: Path) -> None:
    code = (
        f"import sys; from aerosid.logs.formats import read_log; read_log({str(log)!r}); "
        "sys.exit(' '.join(sorted({'pint', 'scipy.io', 'numba', 'matplotlib'} & set(sys.modules))) or 0)"
    )
    output_of(code)


def test_the_loop_and_its_report_import_nothing_that_they_do_without() -> None:
    code = (
        "import sys, aerosid.loop.closed_loop, aerosid.reporting.writing; "
        "spared = {'pandas', 'matplotlib', 'scipy.ndimage', 'scipy.signal', 'scipy.stats', 'scipy.interpolate', "
        "'aerosid.manoeuvres.record', 'aerosid.reporting.manoeuvres', 'aerosid.reporting.quality_tables'}; "
        "sys.exit(' '.join(sorted(spared & set(sys.modules))) or 0)"
    )
    output_of(code)


def test_the_loop_begins_without_what_writes_its_report() -> None:
    code = (
        "import sys, aerosid.loop.closed_loop, aerosid.reporting.console, aerosid.reporting.file_names; "
        "from aerosid.cli.close_loop import report_folder; from pathlib import Path; "
        "report_folder(Path('out'), ['log.csv'], 'aircraft.toml', None); "
        "spared = {'jinja2', *(f'aerosid.reporting.{name}' for name in ('writing', 'page', 'result_schema'))}; "
        "sys.exit(' '.join(sorted(spared & set(sys.modules))) or 0)"
    )
    output_of(code)


def test_module_and_reader_that_goes_away() -> None:
    command = f'"{sys.executable}" -m aerosid formats | head -1'
    run = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert run.returncode == 0
    assert run.stderr == ""
    assert "Log formats" in run.stdout


def test_a_reader_that_goes_away_costs_no_file(tmp_path: Path) -> None:
    """With output closed after the first line the loop wrote nothing, and with output closed later it hung."""
    flights = README.parent / "flight_data"
    words = [
        f'"{sys.executable}" -m aerosid close-loop --aircraft light_transport',
        f'"{flights / "light_transport_doublet.csv"}"',
        f'--validate "{flights / "light_transport_3211.csv"}" --out "{tmp_path / "report"}" | head -1',
    ]
    run = subprocess.run(
        ["bash", "-o", "pipefail", "-c", " ".join(words)], capture_output=True, text=True, check=False, timeout=200
    )
    assert run.returncode == 0, run.stderr
    assert len(run.stdout.splitlines()) == 1
    assert {"result.json", "report.html", "report.pdf"} <= {path.name for path in (tmp_path / "report").iterdir()}


@pytest.mark.parametrize(("ran", "searched"), [("pass", True), ("main(['--version'])", False)])
def test_a_command_ends_without_a_last_search_for_cycles(ran: str, searched: bool) -> None:
    code = (
        "import os; from aerosid.cli.main import main\n"
        "class Cycle:\n"
        "    def __init__(self): self.own = self\n"
        "    def __del__(self): os.write(1, b'found')\n"
        f"Cycle(); {ran}"
    )
    assert ("found" in output_of(code)) is searched


def test_every_verb_is_in_the_readme_and_has_help() -> None:
    text = README.read_text()
    for command in app.registered_commands:
        assert command.callback is not None
        name = command.name or command.callback.__name__.replace("_", "-")
        assert f"`{name}`" in text, f"the README does not mention the verb {name}"
        assert command.callback.__doc__
    for group in app.registered_groups:
        assert f"`{group.name}`" in text


def test_the_module_ends_with_the_exit_code_as_the_command_does(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "aerosid", "check", str(tmp_path / "missing.csv")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert done.stderr.startswith("aerosid: ")


@pytest.mark.parametrize("verb", ["close-loop x.csv --aircraft y", "batch x", "cross-check"])
def test_a_seed_below_zero_is_refused_before_anything_is_read(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*verb.split(), "--seed", "-1"]) == 2
    error = capsys.readouterr().err
    assert "seed" in error
    assert error.count("\n") == 1
