"""Results of another log of the same name are not replaced, and none of an earlier run stays by halves."""

import json

import pytest

import wmr_replay as wr
from wmr_replay.jobs.owner import Claim, OtherLog, outdated
from wmr_replay.jobs.pair_owner import Compared, OtherPair, PairClaim
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Model, Provenance, model_to_toml
from wmr_schemas.robot import RobotParameters


@pytest.fixture(scope="module")
def logs(tmp_path_factory, command):
    """Two logs of one name, and a copy of the first elsewhere."""
    folder = tmp_path_factory.mktemp("logs")
    for seed, day in enumerate(("monday", "tuesday", "copy")):
        (folder / day).mkdir()
        options = ("--duration", 6, "--rate", 50, "--seed", seed % 2, "--no-truth")
        command("synth", "patrol", *options, "--out", folder / day / "drive.mcap")
    return folder


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_another_log_of_the_same_name_is_refused_before_any_work(logs, tmp_path, command, command_line):
    out = tmp_path / "out"
    command("run", logs / "monday/drive.mcap", "--out", out)
    before = files(out)
    for name in ("run", "gap", "fit"):
        done = command_line(name, logs / "tuesday/drive.mcap", "--out", out)
        assert (done.code, done.stdout) == (2, "")
        assert f"{out} holds results of {logs}/monday/drive.mcap (sha256 " in done.stderr
        assert "--force" in done.stderr
    assert files(out) == before


def test_force_replaces_all_of_them(logs, tmp_path, command):
    out = tmp_path / "out"
    command("run", logs / "monday/drive.mcap", "--out", out)
    (out / "drive.gap.json").write_text('{"log": "monday", "log_sha256": "0"}')
    command("run", logs / "tuesday/drive.mcap", "--out", out, "--force", "--no-rrd")
    assert "drive.gap.json" not in files(out)
    assert "drive.rrd" not in files(out)
    assert json.loads((out / "drive.summary.json").read_text())["log"] == str(logs / "tuesday/drive.mcap")


def test_the_same_content_elsewhere_and_new_content_at_the_same_path_are_the_same_log(
    logs, tmp_path, command
):
    out, log = tmp_path / "out", tmp_path / "drive.mcap"
    for day in ("monday", "tuesday"):
        log.write_bytes((logs / day / "drive.mcap").read_bytes())
        command("run", log, "--out", out, "--no-rrd")
    command("run", logs / "tuesday/drive.mcap", "--out", out, "--no-rrd")
    assert Claim.of(out, logs / "tuesday/drive.mcap").settled(force=False) is False


def test_a_relative_path_is_trusted_below_the_working_directory_alone(logs, tmp_path, command, monkeypatch):
    monkeypatch.chdir(logs / "monday")
    command("run", "drive.mcap", "--out", tmp_path, "--no-rrd")
    command("run", "drive.mcap", "--out", "here", "--no-rrd")
    Claim.of(logs / "monday/here", logs / "monday/drive.mcap").check()
    monkeypatch.chdir(logs / "tuesday")
    with pytest.raises(OtherLog):
        wr.run("drive.mcap", tmp_path, timeline=False)
    monkeypatch.chdir(logs / "copy")
    wr.run("drive.mcap", tmp_path, timeline=False)


def test_results_of_an_earlier_content_are_named(logs, tmp_path, command):
    out, log = tmp_path / "out", tmp_path / "drive.mcap"
    log.write_bytes((logs / "monday/drive.mcap").read_bytes())
    command("run", log, "--out", out, "--no-rrd")
    stale = {"log": str(log), "log_sha256": "0" * 64}
    (out / "drive.gap.json").write_text(json.dumps(stale))
    done = command("run", log, "--out", out, "--no-rrd")
    assert done.stderr.endswith(f"note: {out}/drive.gap.json was made of an earlier content of this log\n")
    assert outdated(out, "drive", None) == []


def test_without_a_timeline_that_of_an_earlier_run_goes(logs, tmp_path, command):
    command("run", logs / "monday/drive.mcap", "--out", tmp_path)
    assert "drive.rrd" in files(tmp_path)
    command("run", logs / "monday/drive.mcap", "--out", tmp_path, "--no-rrd")
    assert "drive.rrd" not in files(tmp_path)


def test_a_model_of_another_log_is_not_replaced_by_a_fit(logs, tmp_path):
    model = tmp_path / "drive.model.toml"
    claim = Claim.of(tmp_path, logs / "monday/drive.mcap", models=True)
    for provenance in (Provenance(), Provenance("0" * 64, "0.1", "wmr-replay fit")):
        model.write_text(model_to_toml(Model(RobotParameters(alpha=1.0), provenance=provenance)))
        with pytest.raises(OtherLog, match=r"drive\.model\.toml"):
            claim.check()
    Claim.of(tmp_path, logs / "monday/drive.mcap").check()
    model.write_text(model_to_toml(Model(provenance=Provenance(claim.sha256(), "0.1", ""))))
    claim.check()


def test_a_result_in_memory_is_not_saved_over_another_logs(logs, tmp_path):
    first, second = (wr.run(logs / day / "drive.mcap") for day in ("monday", "tuesday"))
    first.save(tmp_path, timeline=False)
    first.save(tmp_path, timeline=False)
    with pytest.raises(InvalidSetting, match="another log"):
        second.save(tmp_path, timeline=False)
    second.save(tmp_path, timeline=False, force=True)


def test_a_comparison_without_timeline_leaves_no_older_one(logs, tmp_path, command):
    sides = (logs / "monday/drive.mcap", logs / "tuesday/drive.mcap", "--out", tmp_path)
    command("compare", *sides)
    assert "drive.compare.rrd" in files(tmp_path)
    command("compare", *sides, "--no-rrd")
    assert set(files(tmp_path)) == {"drive.compare.json"}


def test_the_comparison_of_another_pair_is_left_as_it_is(logs, tmp_path, command, monkeypatch):
    """Refused before anything is replayed; with --force nothing of the first stays."""
    monkeypatch.chdir(logs)
    place = ("--out", tmp_path / "c")
    command("compare", "monday/drive.mcap", "--set-b", "identifier=paper", "--report", *place)
    before = files(tmp_path / "c")
    assert len(before) == 3
    with monkeypatch.context() as nothing_replayed:
        nothing_replayed.setattr("wmr_replay.api.compare.replay", None)
        for other in (("tuesday/drive.mcap",), ("--set-b", "identifier=algebraic")):
            done = command("compare", "monday/drive.mcap", *other, *place, code=2)
            assert "another pair than monday/drive.mcap and " in done.stderr
            assert "--force" in done.stderr
    assert files(tmp_path / "c") == before
    command("compare", "monday/drive.mcap", "tuesday/drive.mcap", "--force", "--no-rrd", *place)
    assert set(files(tmp_path / "c")) == {"drive.compare.json"}
    command("compare", "monday/drive.mcap", "tuesday/drive.mcap", "--no-rrd", *place)


def test_a_pair_is_the_same_where_its_places_are_or_its_names_and_logs(tmp_path, monkeypatch):
    inside, elsewhere = tmp_path / "here" / "c", tmp_path / "c"
    inside.mkdir(parents=True)
    elsewhere.mkdir()
    monkeypatch.chdir(tmp_path / "here")

    def is_same(directory, *sides):
        stored = {"a": "before/d", "b": "after/d", "log_sha256": {"a": "1", "b": "1"}}
        (directory / "d.compare.json").write_text(json.dumps(stored))
        try:
            PairClaim(directory, "d", *(Compared(*side) for side in sides)).check()
        except OtherPair:
            return False
        return True

    one, other = (lambda: "1"), (lambda: "2")
    assert is_same(inside, ("before/d", other), (str(tmp_path / "here/after/d"), other))
    assert not is_same(inside, ("after/d", one), ("before/d", one))
    assert is_same(elsewhere, ("before/d", one), ("after/d", one))
    assert not is_same(elsewhere, ("before/d", one), ("after/d", other))
