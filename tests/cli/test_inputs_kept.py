"""No verb replaces a file that the same call reads: it is refused before any work, and the file stays as it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from aerosid.aircraft.bundled import bundled_folder
from aerosid.cli.main import main
from aerosid.file_set import require_apart
from aerosid.reporting.file_names import FILES as REPORT
from aerosid.studies.batch.writing import files_of
from aerosid.studies.monte_carlo.writing import FILES as STUDY

DOUBLET = (bundled_folder("flight_data") / "light_transport_doublet.csv").read_bytes()
AIRCRAFT = (bundled_folder("aircraft_models") / "light_transport.toml").read_bytes()


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"copy.csv": DOUBLET}, "channels copy.csv --out copy.csv"),
        ({"copy.csv": DOUBLET}, "channels copy.csv --out ../{here}/copy.csv"),
        ({"out/residuals.csv": DOUBLET}, "close-loop out/residuals.csv --aircraft light_transport --out out"),
        ({"out/residuals.csv": DOUBLET}, "close-loop out/residuals.csv@0:9 --aircraft light_transport --out out"),
        (
            {"f.csv": DOUBLET, "out/completed_aircraft.toml": AIRCRAFT},
            "close-loop f.csv --aircraft out/completed_aircraft.toml --out out",
        ),
        (
            {"f.csv": DOUBLET, "out/residuals.csv": DOUBLET},
            "close-loop f.csv --aircraft light_transport --hold-out out/residuals.csv --out out",
        ),
        ({"lt.toml": AIRCRAFT}, "export lt.toml --format json --out lt.toml"),
        ({"replay.html": AIRCRAFT}, "replay f.csv --aircraft replay.html --out ."),
        ({"runs.parquet": DOUBLET}, "study --aircraft light_transport --base runs.parquet --out ."),
        ({"out/manoeuvres.csv": DOUBLET}, "batch out/manoeuvres.csv --aircraft light_transport --out out"),
        (
            {"list.txt": b"f.csv\nout/manoeuvres/f/residuals.csv\n", "out/manoeuvres/f/residuals.csv": DOUBLET},
            "batch list.txt --aircraft light_transport --out out",
        ),
        (
            {"residuals.csv": b"log,from,to\nf.csv,0,14\n"},
            "close-loop residuals.csv --aircraft light_transport --out .",
        ),
    ],
)
def test_an_output_that_is_an_input_is_refused(
    inputs: dict[str, bytes],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, content in ({"f.csv": DOUBLET} | inputs).items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert main(words.format(here=tmp_path.name).split()) == 2
    told = capsys.readouterr().err
    assert Path([*inputs][-1]).name in told
    assert "is an input of this call" in told
    assert told.count("\n") == 1
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_fly_does_not_replace_its_input_or_aircraft(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("jsbsim")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fl.csv").write_bytes(DOUBLET)
    (tmp_path / "a.aircraft.toml").write_bytes(AIRCRAFT)
    for words in ("fly L410 --input fl.csv --out fl.csv", "fly a.aircraft.toml --out a.csv"):
        assert main(words.split()) == 2
        assert "is an input of this call" in capsys.readouterr().err
    assert (tmp_path / "fl.csv").read_bytes() == DOUBLET
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.aircraft.toml", "fl.csv"]


def test_find_does_not_replace_its_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flight.csv").write_bytes(DOUBLET)
    assert main(["find", "flight.csv", "--out", "out"]) == 0
    (cut, *_) = sorted((tmp_path / "out" / "cuts").glob("*.csv"))
    (tmp_path / "out" / "segments.csv").unlink()
    # The log is named by a link, under the name by which the same manoeuvre is written again.
    kept = cut.read_bytes()
    (tmp_path / "link").mkdir()
    (tmp_path / "link" / "flight.csv").symlink_to(cut)
    assert main(["find", str(tmp_path / "link" / "flight.csv"), "--out", "out"]) == 2
    assert f"{cut.name}: it is an input of this call" in capsys.readouterr().err
    assert cut.read_bytes() == kept
    assert not (tmp_path / "out" / "segments.csv").exists()


def test_links_and_other_spellings_are_the_same_file(tmp_path: Path) -> None:
    real = tmp_path / "folder"
    real.mkdir()
    (real / "log.csv").write_text("x")
    (tmp_path / "link").symlink_to(real, target_is_directory=True)
    for name in ("link/log.csv", "folder/../folder/log.csv"):
        with pytest.raises(Exception, match="is an input of this call"):
            require_apart([real / "log.csv"], [tmp_path / name])
    # What does not exist, or is no path at all, is no input that could be lost.
    require_apart([real / "new.csv", real], [real / "new.csv", real, None, "light_transport", "x" * 5000, "\0"])


def test_all_names_of_outputs_are_known_in_advance() -> None:
    assert "completed_aircraft.toml" in REPORT
    assert len(set(STUDY)) == 4
    assert Path("manoeuvres/flown/residuals.csv") in files_of(["flown"], reports=True)
    assert Path("manoeuvres/flown/residuals.csv") not in files_of(["flown"], reports=False)
