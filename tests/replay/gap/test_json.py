"""gap.json: the file's types and an independent validator accept the same documents."""

import copy
import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.result.result import Detectable, Estimate, Interval
from wmr_replay.jobs.gap_document import document_of
from wmr_schemas.errors import InvalidFile
from wmr_schemas.gap_file import committed_schema, gap_to_json, read_gap
from wmr_schemas.model_file import model_tables

SHA256 = "0" * 64


@pytest.fixture(scope="module")
def validator():
    schema = committed_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def contents(result, options=None):
    text = gap_to_json(document_of(result, options or GapOptions(), "drive.mcap", SHA256))
    return json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in gap.json"))


def test_a_result_is_written_as_the_schema_says_and_read_as_it_was(made_up_gap, validator, tmp_path):
    result = made_up_gap.gap_result()
    document = document_of(result, GapOptions(tolerance_m=0.005), "drive.mcap", SHA256)
    path = tmp_path / "drive.gap.json"
    path.write_text(gap_to_json(document))
    validator.validate(json.loads(path.read_text()))
    assert read_gap(path) == document
    assert document.settings.tolerance_m == 0.005
    assert document.gap.held_out.after == result.position.held_out.after
    assert document.gap.yaw.unit == "rad"
    assert document.effects[0].parameters["c1_per_s"].ci95 == (0.196, 0.210)
    assert contents(result)["model"] == model_tables(result.model)


def test_what_is_not_finite_becomes_null(made_up_gap, validator):
    effect = replace(
        made_up_gap.EFFECT,
        parameters={"c1_per_s": Estimate(0.2, (float("-inf"), float("nan")), "1/s")},
        p_value=float("nan"),
    )
    changed = made_up_gap.gap_result(
        effects=(effect,), minimum_detectable={"slope": Detectable(float("inf"), "m/s²")}
    )
    found = contents(changed)
    validator.validate(found)
    assert found["effects"][0]["parameters"]["c1_per_s"]["ci95"] == [None, None]
    assert found["effects"][0]["p_value"] is None
    assert found["minimum_detectable"]["slope"]["value"] is None


def test_numbers_of_numpy_are_numbers(made_up_gap, validator):
    where = replace(
        made_up_gap.gap_result().where,
        channels={"yaw": np.float64(2.5)},
        intervals=(Interval(np.float32(1.0), np.float64(2.0), np.float64(0.5)),),
    )
    found = contents(made_up_gap.gap_result(where=where))
    validator.validate(found)
    assert found["where"]["channels"] == {"yaw": 2.5}
    assert found["where"]["intervals"] == [{"start_s": 1.0, "end_s": 2.0, "share": 0.5}]


@pytest.mark.parametrize("verdict", ["nothing_missing", "not_enough_excitation"])
def test_verdicts_without_effects_are_whole_files(made_up_gap, validator, verdict):
    found = contents(made_up_gap.gap_result(verdict=verdict, effects=()))
    validator.validate(found)
    assert found["effects"] == []


DAMAGE = {
    "verdict": lambda g: g.update(verdict="perhaps"),
    "log_sha256": lambda g: g.update(log_sha256="abc"),
    "modes": lambda g: g.update(modes="given"),
    "seed": lambda g: g.pop("seed"),
    "surplus": lambda g: g.update(surplus=1),
    "effects": lambda g: g["effects"][0].update(p_value="small"),
    "confound_class": lambda g: g["effects"][0].update(confound_class=[]),
    "ci95": lambda g: g["effects"][0]["parameters"]["c1_per_s"].update(ci95=[0.1]),
    "where": lambda g: g["where"]["regions"][0].update(radius_m=-1.0),
    "gap": lambda g: g["gap"].update(unit="mm"),
    "held_out": lambda g: g["gap"]["yaw"]["held_out"].pop("floor"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_reader_and_validator_refuse_the_same_damage(made_up_gap, validator, tmp_path, name):
    damaged = copy.deepcopy(contents(made_up_gap.gap_result()))
    DAMAGE[name](damaged)
    assert not validator.is_valid(damaged)
    path = tmp_path / "drive.gap.json"
    path.write_text(json.dumps(damaged))
    with pytest.raises(InvalidFile) as error:
        read_gap(path)
    assert str(error.value).startswith(str(path))


def test_the_reader_names_the_place_at_fault(made_up_gap, tmp_path):
    damaged = contents(made_up_gap.gap_result())
    damaged["effects"][0]["p_value"] = 2
    path = tmp_path / "drive.gap.json"
    path.write_text(json.dumps(damaged))
    with pytest.raises(InvalidFile, match=r"\$\.effects\[0\]\.p_value") as error:
        read_gap(path)
    assert error.value.key == "$.effects[0].p_value"


@pytest.mark.parametrize("text", ["", "{", "NaN", '{"verdict": NaN}'])
def test_what_is_no_json_is_refused(tmp_path, text):
    path = tmp_path / "drive.gap.json"
    path.write_text(text)
    with pytest.raises(InvalidFile, match=r"drive\.gap\.json"):
        read_gap(path)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(InvalidFile, match="cannot be read"):
        read_gap(tmp_path / "none.gap.json")
