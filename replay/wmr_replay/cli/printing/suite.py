"""What ``suite`` prints: what was written, what was compared, and the list of suites."""

from typing import TYPE_CHECKING

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.layout import say_labelled
from wmr_replay.cli.printing.plain import say

if TYPE_CHECKING:
    from wmr_replay.api.suite import VerifiedSuite, WrittenSuite


def print_suites(*, as_json: bool) -> None:
    """Name, version, number of logs and description of every suite."""
    from wmr_replay.api.suite import suites

    rows = suites()
    if as_json:
        echo_json(rows)
        return
    width = max(len(row["name"]) for row in rows)
    for row in rows:
        n_logs = len(row["logs"])
        say_labelled(row["name"], f"v{row['version']}  {n_logs:2} logs  {row['description']}", width + 2)


def print_suite(written: "WrittenSuite", *, as_json: bool) -> None:
    """What was written and what was there."""
    if as_json:
        echo_json(written.as_dict())
        return
    suite, out = written.manifest.suite, written.directory
    n_logs = len(suite.logs)
    kept = f", {len(written.kept)} of them as they were" if written.kept else ""
    say(
        f"{out}: suite {suite.name}, version {suite.version}, seed {written.manifest.seed}: "
        f"{n_logs} log{'s' * (n_logs != 1)}{kept}, {written.size_bytes / 1e6:.1f} MB, manifest.json"
    )
    say(f"next: wmr-replay check references/{suite.name} {out} --update")


def print_verified(verified: "VerifiedSuite", *, as_json: bool) -> None:
    """How each log compares with the one that was written again."""
    if as_json:
        echo_json(verified.as_dict())
        return
    for name, outcome in verified.logs.items():
        say(f"{name}: {outcome}")
    say(f"{verified.n_same} of {len(verified.logs)} logs are what the manifest says")
