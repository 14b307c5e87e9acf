"""Real logs: what is claimed of them is what a person who looks at the data would claim."""

import tomllib
from pathlib import Path

import pytest

import wmr_replay as wr
from wmr_replay.jobs.convert import read_csv
from wmr_schemas.csv_map import read_csv_map
from wmr_schemas.errors import LogUnusable
from wmr_synth import write_mcap

HERE = Path(__file__).parent
EXPECTED = tomllib.loads((HERE / "expected_claims.toml").read_text(encoding="utf-8"))
DART_MAP = HERE.parents[2] / "docs" / "examples" / "dart.toml"
WORTH_CLAIMING = 0.01


@pytest.fixture
def logs(tmp_path, shared_data):
    """A log by its name below the shared data; tables of numbers are converted."""

    def path(name):
        file = shared_data(name)
        if file.suffix != ".csv":
            return file
        log = tmp_path / f"{file.stem}.mcap"
        write_mcap(read_csv(file, read_csv_map(DART_MAP)).log, log)
        return log

    return path


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_a_real_log_is_answered_as_expected(logs, name):
    expected = EXPECTED[name]
    if expected["exit"]:
        with pytest.raises(LogUnusable):
            wr.run(logs(name))
        return
    result = wr.run(logs(name))
    row = result.summary.row(0, named=True)
    shares = {mode: row[f"share_{mode}"] or 0.0 for mode in ("ideal", "skidding", "slipping")}
    assert {mode for mode, share in shares.items() if share > WORTH_CLAIMING} <= set(expected["claims"])
    for mode, least in expected.get("least", {}).items():
        assert shares[mode] >= least
    barring = {found["code"] for found in result.findings if found["severity"] == "bars"}
    assert barring <= set(expected["may_bar"])


def test_every_real_log_of_the_shared_data_is_listed(shared_data):
    logs, cars = shared_data("logs"), shared_data("robots", "dart")
    files = [*logs.glob("*.mcap"), *cars.glob("*/*.csv")]
    assert {str(file.relative_to(logs.parent)) for file in files} == set(EXPECTED)


def test_the_expectations_name_modes_that_exist():
    modes = {mode for entry in EXPECTED.values() for mode in entry.get("claims", ())}
    assert modes <= {mode.label for mode in wr.ContactMode}
