"""A log whose every name and text tries to act on what shows it, through every command and every file."""

import json
import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import polars as pl
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from rich.table import Table

import wmr_replay as wr
from wmr_replay.api.html import result_html
from wmr_replay.cli.printing.plain import console_of, styled
from wmr_replay.ingest import open_log
from wmr_replay.timeline.description import verdict_text

BAD = "\x1b]0;owned\x07[/bold][/]\x00\x9b31m\u202e\u2066:bomb:\r\n\x7f<b>&\u2028"
JOINTS = {b"left_wheel_joint": b"left_wheel[/]\x1b[A", b"right_wheel_joint": b"right_wheel[/]\x1b[A"}
AT = 1_700_000_000_000_000_000
FRAME = {b"map\x00": b"\x1b[A\x00"}
ACTS = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


NAME = "bold]\x1b[31m\u202e:bomb:\x9b<b>.mcap"


def hostile_copy(log: Path, folder: Path, name: str = NAME, **metadata: str) -> Path:
    """The log under bad names; its path holds the markup ``[/bold]``."""
    home = folder / "x["
    home.mkdir(parents=True)
    path = home / name
    with log.open("rb") as source, path.open("wb") as target:
        reader, writer = make_reader(source), Writer(target)
        writer.start(profile=f"ros2{BAD}", library=BAD)
        ids = {}
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata | metadata)
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic not in ids:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.topic] = writer.register_channel(
                    channel.topic + BAD, channel.message_encoding, schema_id
                )
            data = message.data
            for before, after in (JOINTS | FRAME).items():
                data = data.replace(before, after)
            writer.add_message(ids[channel.topic], message.log_time, data, message.publish_time)
        other = writer.register_schema(f"no/{BAD}", f"idl{BAD}", BAD.encode())
        for k, encoding in enumerate((f"cdr{BAD}", "cdr", "json", "protobuf")):
            writer.add_message(writer.register_channel(f"/x{k}{BAD}", encoding, other), AT, BAD.encode(), AT)
        writer.finish()
    return path


@pytest.fixture(scope="module")
def hostile(tmp_path_factory, log) -> Path:
    return hostile_copy(log, tmp_path_factory.mktemp("hostile"))


@pytest.fixture(scope="module")
def out(tmp_path_factory, hostile, command) -> Path:
    """The results of a run."""
    folder = tmp_path_factory.mktemp("out")
    clean(command("run", hostile, "--out", folder))
    return folder


def clean(done):
    """What was printed holds nothing that acts; the outcome."""
    for text in (done.stdout, done.stderr):
        assert not ACTS.search(text), ACTS.findall(text)[:5]
    return done


def test_the_log_is_what_it_should_be(hostile):
    reader = open_log(hostile)
    assert set(reader.plan.uses) == {"pose", "torque", "truth"}
    assert all(BAD in use.channel.topic for use in reader.plan.uses.values())


def test_info(hostile, command):
    said = clean(command("info", hostile)).stdout
    assert "[/bold][/]" in said
    assert ":bomb:" in said
    assert "\\x1b]0;owned" in said
    parsed = json.loads(clean(command("info", hostile, "--json")).stdout)
    assert any(channel["topic"] == f"/pose{BAD}" for channel in parsed["channels"])
    assert parsed["profile"] == f"ros2{BAD}"


def test_a_bad_value_of_the_metadata_is_quoted_clean(log, tmp_path, command):
    path = hostile_copy(log, tmp_path, average_speed_mps=BAD, **{BAD: BAD})
    said = clean(command("info", path)).stdout
    assert "average_speed_mps: '\\x1b]0;owned" in said
    clean(command("info", path, "--json"))


def test_a_written_mapping_is_clean_and_finds_the_same_channels(tmp_path, hostile, command):
    clean(command("info", hostile, "--write-map", tmp_path / "robot.toml"))
    text = (tmp_path / "robot.toml").read_text(encoding="utf-8")
    assert not ACTS.search(text)
    assert tomllib.loads(text)["pose"]["topic"] == f"/pose{BAD}"
    parsed = json.loads(command("info", hostile, "--json", "--map", tmp_path / "robot.toml").stdout)
    assert parsed["used"] == json.loads(command("info", hostile, "--json").stdout)["used"]


def test_run_prints_and_writes_nothing_that_acts(hostile, out, tmp_path, command):
    parsed = json.loads(clean(command("run", hostile, "--out", tmp_path, "--json")).stdout)
    assert parsed["log"] == str(hostile)
    (summary,) = out.glob("*.summary.json")
    assert not ACTS.search(summary.read_text(encoding="utf-8"))
    assert json.loads(summary.read_text(encoding="utf-8"))["log"] == str(hostile)
    (table,) = out.glob("*.summary.parquet")
    assert pl.read_parquet(table, glob=False)["log"][0] == str(hostile)


def test_batch(hostile, tmp_path, command):
    broken = hostile_copy(hostile, tmp_path / "broken")
    broken.write_bytes(b"no log")
    done = clean(command("batch", hostile, broken, "--out", tmp_path / "fleet", "--jobs", "1", code=1))
    assert ":bomb:" in done.stdout
    again = ("batch", hostile, "--out", tmp_path / "fleet", "--jobs", "1", "--json")
    json.loads(clean(command(*again)).stdout)
    assert not ACTS.search((tmp_path / "fleet" / "fleet.json").read_text(encoding="utf-8"))


def test_check_and_its_reports(hostile, out, tmp_path, command):
    references, report, diff = tmp_path / "references", tmp_path / "report.xml", tmp_path / "diff.txt"
    clean(command("check", references, hostile, "--update"))
    clean(command("check", references, hostile, "--json"))
    done = command("check", references, hostile, "--window", "0.7", "--junit", report, "--diff", diff, code=1)
    clean(done)
    for file in (report, diff):
        assert not ACTS.search(file.read_text(encoding="utf-8").replace("\t", " ")), file
    cases = ElementTree.fromstring(report.read_text(encoding="utf-8")).iter("testcase")
    assert any(":bomb:" in case.attrib["classname"] for case in cases)


def test_compare(hostile, tmp_path, command):
    done = clean(command("compare", hostile, "--set-b", "window_s=0.7", "--out", tmp_path))
    assert ":bomb:" in done.stdout
    (file,) = tmp_path.glob("*.compare.json")
    assert not ACTS.search(file.read_text(encoding="utf-8"))


def test_fit_gap_and_diff(hostile, tmp_path, command):
    clean(command("fit", hostile, "--out", tmp_path))
    clean(command("fit", hostile, "--out", tmp_path, "--json"))
    (model,) = tmp_path.glob("*.model.toml")
    assert not ACTS.search(model.read_text(encoding="utf-8"))
    topic = f"topic:/ground_truth/mode{BAD}"
    clean(command("gap", hostile, "--out", tmp_path / "gap", "--modes", topic))
    (document,) = (tmp_path / "gap").glob("*.gap.json")
    assert not ACTS.search(document.read_text(encoding="utf-8"))
    assert json.loads(document.read_text(encoding="utf-8"))["modes"] == topic
    clean(command("diff", "--log", hostile))


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("--pose", f"/no{BAD}"), 3),
        (("--torque", f"/pose{BAD}"), 3),
        (("--start", f"1{BAD}"), 2),
        (("--map", f"/no/{BAD.replace(chr(0), '')}"), 2),
        ((f"--no{BAD}",), 2),
        (("--start", "1e6"), 3),
    ],
)
def test_errors_that_quote_names(arguments, code, hostile, command):
    clean(command("run", hostile, *arguments, code=code))


def test_joints_are_quoted_clean(hostile, command):
    topic = next(use.channel.topic for role, use in open_log(hostile).plan.uses.items() if role == "torque")
    said = clean(command("run", hostile, "--torque", f"{topic}{{left=a,right=b}}", code=3)).stderr
    assert "left_wheel[/]\\x1b[A" in said


def test_a_name_with_a_line_end_makes_no_line_of_its_own(hostile, command):
    said = clean(command("run", hostile, "--pose", "/none", code=3)).stderr
    assert not any(line.startswith("\x7f") or line.startswith("<b>") for line in said.splitlines())
    assert "\\r\\n" in said


def test_convert(tmp_path, command):
    bad = BAD.replace("/", "").replace("\0", "")
    table, columns, log = (tmp_path / f"{bad}{ending}" for ending in (".csv", ".toml", ".mcap"))
    table.write_text("t,x,y,a\n" + "".join(f"{k / 10},{k},0,0\n" for k in range(30)), encoding="utf-8")
    columns.write_text('[columns]\ntime = "t"\nx = "x"\ny = "y"\nyaw = "a"\n', encoding="utf-8")
    done = clean(command("convert", table, "--map", columns, "--out", log))
    assert "wrote" in done.stdout
    columns.write_text('[columns]\ntime = "\\u001b[2J"\nx = "x"\ny = "y"\nyaw = "a"\n', encoding="utf-8")
    clean(command("convert", table, "--map", columns, "--out", log, code=2))


def test_a_file_name_that_is_no_utf8(hostile, tmp_path, command):
    path = hostile_copy(hostile, tmp_path, "bold]\udcff.mcap")
    clean(command("info", path, "--json"))
    done = clean(command("run", path, "--out", tmp_path / "out"))
    assert "\\udcff" in done.stdout


def test_in_a_notebook(hostile):
    result = wr.run(hostile)
    page = result_html(result)
    assert not ACTS.search(page)
    assert "<b>&" not in page
    assert "]\\x1b[31m" in page
    for shown in (result, wr.open_log(hostile)):
        assert not ACTS.search(repr(shown))
    result.plot()


def test_the_viewers_text_shows_a_name_as_it_is():
    text = verdict_text(f"a_b{BAD}", None)
    assert not ACTS.search(text)
    assert "a_b\\\\x1b" in text
    assert "\\<b\\>" in text


def test_at_a_terminal_only_our_own_styles_are_codes():
    console = console_of(force_terminal=True, width=200, color_system="standard")
    table = Table("[red]head")
    table.add_row(f"cell{BAD}")
    with console.capture() as capture:
        console.print(styled((f"name{BAD}", "bold"), BAD))
        console.print(table)
        console.print(f"plain{BAD}")
    said = re.sub(r"\x1b\[[0-9;]*m", "", capture.get())
    assert not ACTS.search(said)
    assert "[red]head" in said
    assert ":bomb:" in said
