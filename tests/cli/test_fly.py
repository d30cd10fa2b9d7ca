"""`aerosid fly`: its files, its errors, and its behaviour without JSBSim."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from aerosid.aircraft import load_aircraft
from aerosid.cli.main import main
from aerosid.errors import UsageError
from aerosid.logs.formats import read_log
from aerosid.studies.jsbsim.control_inputs import SHAPES, START, manoeuvre, recorded
from aerosid.studies.jsbsim.injected import KINDS, InjectedEffect, parse_effect

PAGE = (Path(__file__).parents[2] / "docs" / "command_line.md").read_text(encoding="utf-8")


def test_flight_leaves_log_aircraft_and_truth_and_the_seed_repeats_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("jsbsim", reason="JSBSim flies here")
    monkeypatch.chdir(tmp_path)
    words = ["fly", "DHC6", "--duration", "6", "--effect", "control_lag=0.1", "--effect", "turbulence=2"]
    for name, seed in (("a/flight.csv", "3"), ("b/flight.csv", "3"), ("c/flight.csv", "4")):
        assert main([*words, "--seed", seed, "--out", name]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert captured.out.count("\n") == 3
    files = {"flight.csv", "flight.aircraft.toml", "flight.truth.json"}
    assert {path.name for path in (tmp_path / "a").iterdir()} == files
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b", "c"}
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    assert (tmp_path / "a" / "flight.csv").read_bytes() != (tmp_path / "c" / "flight.csv").read_bytes()
    log = read_log(tmp_path / "a" / "flight.csv")
    assert {"V", "alpha", "q", "theta", "a_x", "a_z", "h", "delta_e", "thrust", "rho"} <= set(log.channels)
    assert log.samples == 301
    aircraft = load_aircraft(tmp_path / "a" / "flight.aircraft.toml")
    assert aircraft.mass == pytest.approx(4587.7, rel=1e-4)
    truth = json.loads((tmp_path / "a" / "flight.truth.json").read_text())
    assert [effect["kind"] for effect in truth["effects"]] == ["control_lag", "turbulence"]
    for name in ("flight.csv", "flight.aircraft.toml"):
        assert "lag" not in (tmp_path / "a" / name).read_text(), "the truth file alone may tell"


def test_an_aircraft_file_is_flown_by_the_elevator_of_a_log(tmp_path: Path) -> None:
    pytest.importorskip("jsbsim", reason="JSBSim flies here")
    time = np.arange(0.0, 5.0, 0.1)
    degrees = -1.0 + 2.0 * ((time > 1.0) & (time < 2.0))
    rows = "\n".join(f"{100.0 + t:.1f},{value}" for t, value in zip(time, degrees, strict=True))
    (tmp_path / "stick.csv").write_text(f"time [s],delta_e [deg]\n{rows}\n")
    out = tmp_path / "out.csv"
    words = ["fly", "light_transport", "--input", str(tmp_path / "stick.csv"), "--noise", "0", "--out", str(out)]
    assert main([*words, "--airspeed", "90"]) == 0
    log = read_log(out)
    moved = log["delta_e"] - log["delta_e"][0]
    expected = np.interp(log.time, time, np.deg2rad(degrees - degrees[0]))
    assert np.abs(moved - expected).max() < 1e-9
    assert log["V"][0] == pytest.approx(90.0)
    assert np.ptp(log["q"]) > 0.02
    assert (tmp_path / "out.aircraft.toml").read_text() == load_aircraft("light_transport").text


@pytest.mark.parametrize(
    ("words", "sentence", "code"),
    [
        (["no_such"], "'no_such' is neither an aircraft file", 2),
        (["no_such.toml"], "no_such.toml was not found", 2),
        (["c172p"], "c172p has no airspeed of its own", 2),
        (["L410", "--input", "triplet"], "neither a file nor one of doublet, 3211, sweep, multisine", 2),
        (["L410", "--input", "no_such.csv"], "no_such.csv", 3),
        (["L410", "--amplitude", "3"], "--amplitude is 3 rad", 2),
        (["L410", "--duration", "2"], "do not make a manoeuvre", 2),
        (["L410", "--interval", "-1"], "--interval is -1 s", 2),
        (["L410", "--airspeed", "0"], "--airspeed is 0", 2),
        (["L410", "--noise", "-1"], "--noise is -1", 2),
        (["L410", "--airspeed", "9"], "no level flight at 9 m/s", 4),
        (["L410", "--effect", "magic=1"], "the effect 'magic' is unknown", 2),
        (["L410", "--effect", "control_lag"], "cannot be read", 2),
        (["L410", "--effect", "control_lag=1,2"], "takes time constant [s] and was given 1, 2", 2),
        (["L410", "--effect", "control_lag:delta_r=1"], "names delta_r, but this aircraft's flight has delta_e", 2),
        (["L410", "--effect", "aero_term:C_m=1"], "is written as in C_m:alpha^2=-1.7", 2),
        (["L410", "--effect", "aero_term:C_m:alpha^^2=1"], "cannot be read", 2),
        (["L410", "--effect", "turbulence=1@3"], "cannot begin at 3 s", 2),
        (["L410", "--effect", "turbulence=99"], "was given 99; give severity 1 to 7 of at most 7", 2),
        (["light_transport", "--effect", "flap=1"], "flap needs an aircraft of JSBSim", 2),
    ],
)
def test_what_cannot_be_flown_is_one_sentence_and_leaves_nothing(
    words: list[str], sentence: str, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("jsbsim", reason="without JSBSim every flight is refused alike")
    assert main(["fly", *words, "--out", str(tmp_path / "x.csv")]) == code
    captured = capsys.readouterr()
    assert sentence in captured.err
    assert captured.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_log_needs_a_name_that_can_be_read_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("jsbsim", reason="without JSBSim every flight is refused alike")
    assert main(["fly", "L410", "--out", str(tmp_path / "flight.mat")]) == 2
    assert "ends in .csv" in capsys.readouterr().err
    (tmp_path / "file").write_text("kept")
    assert main(["fly", "L410", "--duration", "6", "--out", str(tmp_path / "file" / "x.csv")]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


WITHOUT = """
import sys
sys.modules["jsbsim"] = None
from aerosid.cli.main import main
from aerosid.aircraft import load_aircraft
from aerosid.reporting.export.jsbsim_xml import aerodynamics_xml
assert "<aerodynamics>" in aerodynamics_xml(load_aircraft("light_transport"))
assert main(["aircraft", "list"]) == 0
sys.exit(main(["fly", "light_transport", "--out", "x.csv"]))
"""


def test_without_jsbsim_only_flying_is_missing_and_says_so(tmp_path: Path) -> None:
    run = subprocess.run([sys.executable, "-c", WITHOUT], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert run.stderr.startswith("aerosid: JSBSim, which this command needs, is not installed; ")
    assert run.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", SHAPES)
def test_manoeuvres_begin_and_end_at_trim_and_keep_their_amplitude(name: str) -> None:
    made = manoeuvre(name, 0.05, 0.6, 14.0, 0.01)
    before = made.time < START - 1e-9
    assert (made.deviation[before] == 0.0).all()
    assert abs(made.deviation[-1]) < 1e-9
    assert np.abs(made.deviation).max() == pytest.approx(0.05, rel=1e-3)
    assert made.deviation.min() < -0.02
    assert made.deviation.max() > 0.02


def test_sweep_and_multisine_excite_the_band_that_they_name() -> None:
    for name, share in (("sweep", 0.9), ("multisine", 0.99)):
        made = manoeuvre(name, 0.05, 0.5, 42.0, 0.01)
        power = np.abs(np.fft.rfft(made.deviation)) ** 2
        frequency = np.fft.rfftfreq(made.time.size, 0.01)
        band = (frequency > 0.0) & (frequency < 1.05)
        assert power[band].sum() > share * power.sum(), name
        for low, high in ((0.1, 0.3), (0.3, 0.6), (0.6, 0.95)):
            assert power[(frequency > low) & (frequency < high)].sum() > 0.1 * power.sum(), (name, low)


def test_a_recorded_elevator_is_linear_between_its_samples(tmp_path: Path) -> None:
    path = tmp_path / "stick.csv"
    path.write_text("time [s],delta_e [rad]\n" + "".join(f"{t},{0.1 * (t == 2)}\n" for t in range(10)))
    made = recorded(path, 0.25)
    assert made.deviation[[4, 6, 8, 10, 12]].tolist() == [0.0, 0.05, 0.1, 0.05, 0.0]


def test_every_effect_is_documented_and_reads_back() -> None:
    table = PAGE.split("| `--effect` |", 1)[1].split("\n\n", 1)[0]
    for kind in KINDS:
        assert f"`{kind.replace('aero_term', 'C_m')}" in table, kind
    for effect in (
        InjectedEffect("aero_term", (-1.7,), "C_m", "alpha^2"),
        parse_effect("C_m:alpha^2=-1.7"),
        InjectedEffect("icing", (1.0,), time=5.0),
        InjectedEffect("cg_shift", (150.0, -1.0)),
    ):
        assert parse_effect(str(effect)) == effect
    with pytest.raises(UsageError, match="finite numbers"):
        parse_effect("icing=nan")


SIDEWAYS = """
schema = 1
aircraft = { name = "glider tug" }
reference = { wing_area = 16.0, mean_chord = 1.5, span = 11.0, airspeed = 55.0 }
mass = { mass = 1100.0, I_xx = 1300.0, I_yy = 2000.0, I_zz = 3100.0, I_xz = 80.0 }
air = { density = 1.05 }
[derivatives.C_Y]
"beta" = { value = -0.6 }
"delta_r" = { value = 0.16 }
[derivatives.C_l]
"beta" = { value = -0.08 }
"p_hat" = { value = -0.45 }
"r_hat" = { value = 0.12 }
"delta_a" = { value = -0.15 }
[derivatives.C_n]
"beta" = { value = 0.07 }
"p_hat" = { value = -0.04 }
"r_hat" = { value = -0.12 }
"delta_r" = { value = -0.08 }
"""


def test_a_lateral_file_is_flown_by_aileron_and_rudder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("jsbsim", reason="JSBSim flies here")
    file, out = tmp_path / "tug.toml", tmp_path / "out.csv"
    file.write_text(SIDEWAYS)
    words = ["fly", str(file), "--out", str(out), "--noise", "0", "--interval", "0.04"]
    inputs = [
        "--input",
        "delta_a:doublet:0.05:0.8",
        "--input",
        "delta_r:211:0.04:0.6@4",
        "--effect",
        "control_lag:delta_r=0.1",
    ]
    assert main([*words, *inputs, "--duration", "9"]) == 0
    log = read_log(out)
    assert {"V", "alpha", "q", "theta", "beta", "p", "r", "phi", "psi", "a_y", "delta_a", "delta_r"} <= set(
        log.channels
    )
    assert np.abs(log["delta_a"]).max() == pytest.approx(0.05)
    assert log.time[np.flatnonzero(np.abs(log["delta_r"]) > 0.01)[[0, -1]]] == pytest.approx([4.0, 6.36])
    assert np.ptp(log["p"]) > 0.1
    assert (tmp_path / "out.aircraft.toml").read_text() == SIDEWAYS
    truth = json.loads((tmp_path / "out.truth.json").read_text())
    assert [effect["where"] for effect in truth["effects"]] == ["delta_r"]
    # The same flight from the log that was written: its aileron and rudder are flown.
    again = tmp_path / "again.csv"
    assert main(["fly", str(file), "--out", str(again), "--noise", "0", "--interval", "0.04", "--input", str(out)]) == 0
    assert np.abs(read_log(again)["delta_r"] - log["delta_r"]).max() < 1e-9
    capsys.readouterr()
    for words, sentence in (
        (["--input", "delta_f:doublet"], "moves delta_f, but this aircraft is flown by delta_a, delta_r"),
        (["--input", "delta_a:doublet:much"], "cannot be read; write [CONTROL:]SHAPE"),
        (["--input", "delta_a:triplet"], "neither a file nor one of doublet"),
        (["--input", "delta_a:doublet@-3"], "--input begins at -3 s"),
    ):
        assert main(["fly", str(file), "--out", str(tmp_path / "no.csv"), *words]) == 2, sentence
        assert sentence in capsys.readouterr().err
