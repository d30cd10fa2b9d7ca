"""The published schemas are those of the code, and every document written conforms to them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
from broken_inputs import GOOD
from problems_report import closed_loop

from aerosid.cli.main import main
from aerosid.cli.schema import DOCUMENTS, schema_text
from aerosid.loop.provenance import Provenance, all_settings
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.reporting.result_json import result_text
from aerosid.studies.batch import Batch, LogFile
from aerosid.studies.batch.one_log import summary_row
from aerosid.studies.batch.writing import batch_json

PUBLISHED = Path(__file__).resolve().parents[2] / "docs" / "schemas"


def schema(document: str) -> dict:
    return json.loads((PUBLISHED / f"{document}.schema.json").read_text(encoding="utf-8"))


def held_to(document: str, text: str) -> dict:
    made = json.loads(text)
    jsonschema.Draft202012Validator(schema(document)).validate(made)
    return made


@pytest.mark.parametrize("document", DOCUMENTS)
def test_what_is_published_is_what_the_code_says(document: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert (PUBLISHED / f"{document}.schema.json").read_text(encoding="utf-8") == schema_text(document)
    jsonschema.Draft202012Validator.check_schema(schema(document))
    assert main(["schema", document]) == 0
    assert capsys.readouterr().out == schema_text(document)


def test_result_json_keeps_to_its_schema_and_names_no_folder_of_this_machine(tmp_path: Path) -> None:
    result = closed_loop()
    log = replace(
        result.identification[0],
        path=str(tmp_path / "flight.csv"),
        channel_map=str(tmp_path / "flight.channels.toml"),
        channel_map_sha256="c" * 64,
    )
    settings = LoopSettings(seed=7, chain=ChainSettings(filtering="causal"), limits={"alpha": (-0.1, 0.2)})
    made = replace(
        result,
        identification=(log,),
        hold_out=(replace(result.validation[0], name="held"),),
        aircraft=replace(result.aircraft, path=str(tmp_path / "craft.toml")),
        settings=settings,
        provenance=Provenance("2026-11-22", {"seed": 7}, "aerosid close-loop", "N. N.", "second run"),
    )
    for each in (result, made):
        held_to("result", result_text(each))
    document = held_to("result", result_text(made))
    assert str(tmp_path) not in json.dumps(document)
    first = document["inputs"][0]
    assert (first["path"], first["channel_map"]) == ("flight.csv", "flight.channels.toml")
    assert first["span"] == [log.time[0], log.time[-1]]
    assert [entry["role"] for entry in document["inputs"]] == ["identification", "validation", "hold_out", "aircraft"]
    assert document["provenance"]["analyst"] == "N. N."
    assert document["settings"] == all_settings(settings)
    assert document["settings"]["chain.filtering"] == "causal"
    assert document["settings"]["limits.alpha"] == [-0.1, 0.2]


def test_a_document_that_breaks_the_schema_is_told(tmp_path: Path) -> None:
    document = json.loads(result_text(closed_loop()))
    for broken in ({**document, "schema": 2}, {**document, "seed": "none"}, {**document, "effects": [{"rank": 1}]}):
        with pytest.raises(jsonschema.ValidationError):
            held_to("result", json.dumps(broken))


def test_check_and_batch_keep_to_theirs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "flight.csv"
    path.write_text(GOOD)
    main(["check", str(path), "--json"])
    checked = held_to("check", capsys.readouterr().out)
    assert checked["logs"][0]["path"] == "flight.csv"
    result = closed_loop(validated=False)
    log = LogFile(str(path), "flight", "0")
    batch = Batch(result.aircraft, (log,), {"flight": summary_row(result)}, {"broken": "no log"}, reports=False)
    document = held_to("batch", json.dumps(batch_json(batch), allow_nan=False))
    assert document["logs"][0]["structure"] == 1
