"""``wmr-replay suite``: write a named set of logs, or check that one is what it should be."""

import contextlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_schemas.errors import InvalidSetting

if TYPE_CHECKING:
    from wmr_synth.suites import LogSpec, Manifest, Suite


@click.command(
    "suite",
    epilog="""\b
Examples:
  wmr-replay suite --list
  wmr-replay suite paper --out logs/paper
  wmr-replay suite noise-sweep --out logs/noise --seed 3 --jobs 4
  wmr-replay suite my.toml --out logs/mine
  wmr-replay suite --verify logs/paper
""",
)
@click.argument("name", metavar="[NAME|FILE.toml]", required=False)
@click.option("--list", "listing", is_flag=True, help="List the suites and leave.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Directory of the logs.")
@click.option(
    "--jobs", type=click.IntRange(min=1), help="Logs written at the same time.  [default: one per processor]"
)
@click.option("--seed", type=click.IntRange(min=0), help="Added to the seed of every log.  [default: 0]")
@click.option(
    "--verify",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    metavar="DIR",
    help="Write the suite in DIR again, elsewhere, and compare: bytes, else decoded columns.",
)
@click.option("--json", "as_json", is_flag=True, help="Say what was done, or the list, as JSON.")
def command(
    name: str | None,
    listing: bool,
    out: Path | None,
    jobs: int | None,
    seed: int | None,
    verify: Path | None,
    as_json: bool,
) -> None:
    """Write the suite NAME, or that of FILE.toml, into a directory, with a manifest.

    A suite is a versioned set of synthetic logs. The same version and seed give the same bytes, with the
    same versions of the dependencies on one platform. Logs that are whole already are not written again.
    """
    jobs = jobs or os.cpu_count() or 1
    if listing:
        show_list(as_json)
    elif verify is not None:
        if name is not None or out is not None or seed is not None:
            raise click.UsageError("--verify takes suite and seed from the manifest in its directory")
        show_verified(verify, jobs, as_json)
    elif name is None:
        raise click.UsageError("which suite? `wmr-replay suite --list` names them")
    elif out is None:
        raise click.UsageError(f"where to? For example: wmr-replay suite {name} --out logs/{Path(name).stem}")
    else:
        write(named(name), out, seed or 0, jobs, as_json)


def named(name: str) -> "Suite":
    """One of ours, or that of a file."""
    from wmr_synth.suites import find_suite, read_suite

    return read_suite(Path(name)) if name.endswith(".toml") else find_suite(name)


def write(suite: "Suite", out: Path, seed: int, jobs: int, as_json: bool) -> None:
    """Write the suite and say so."""
    from wmr_synth.suites import write_suite

    there: list[str] = []
    try:
        with suite_progress(len(suite.logs)) as (announce, progress):

            def done(log: "LogSpec", was_there: bool) -> None:
                there.extend([log.name] if was_there else [])
                announce(log)

            manifest = write_suite(suite, out, seed=seed, jobs=jobs, announce=done, progress=progress)
    except OSError as error:
        raise InvalidSetting(f"--out {out}: cannot be written ({error.strerror or error})") from None
    report(manifest, out, there, as_json)


def report(manifest: "Manifest", out: Path, there: list[str], as_json: bool) -> None:
    """What was written and what was there."""
    n_logs, suite = len(manifest.suite.logs), manifest.suite
    if as_json:
        from wmr_replay.cli.synth_list import echo_json

        head = {"suite": suite.name, "version": suite.version, "seed": manifest.seed, "directory": str(out)}
        written = [log.name for log in suite.logs if log.name not in there]
        echo_json(head | {"written": written, "kept": there})
        return
    n_bytes = sum((out / name).stat().st_size for files in manifest.files.values() for name in files)
    kept = f", {len(there)} of them as they were" if there else ""
    click.echo(
        f"{out}: suite {suite.name}, version {suite.version}, seed {manifest.seed}: "
        f"{n_logs} log{'s' * (n_logs != 1)}{kept}, {n_bytes / 1e6:.1f} MB, manifest.json"
    )
    click.echo(f"next: wmr-replay check references/{suite.name} {out} --update")


def show_list(as_json: bool) -> None:
    """Name, version, number of logs and description of every suite."""
    from wmr_synth.suites import SUITES

    if as_json:
        from wmr_replay.cli.synth_list import echo_json

        rows = [{**vars(suite), "logs": [log.name for log in suite.logs]} for suite in SUITES.values()]
        echo_json(rows)
        return
    width = max(map(len, SUITES))
    for suite in SUITES.values():
        click.echo(f"{suite.name:{width}}  v{suite.version}  {len(suite.logs):2} logs  {suite.description}")


def show_verified(directory: Path, jobs: int, as_json: bool) -> None:
    """Write the suite of the manifest again and compare; exit 1 where a log is another."""
    from wmr_synth.suites import read_manifest, write_suite

    manifest = read_manifest(directory)
    if manifest is None:
        raise InvalidSetting(f"--verify {directory}: there is no manifest.json; is it a suite's directory?")
    with tempfile.TemporaryDirectory(prefix="wmr-suite-") as folder:
        with suite_progress(len(manifest.suite.logs)) as (announce, progress):
            again = write_suite(
                manifest.suite,
                Path(folder),
                jobs=jobs,
                announce=lambda log, _: announce(log),
                progress=progress,
            )
        found = {
            log.name: compared(log, manifest, again, directory, Path(folder)) for log in manifest.suite.logs
        }
    differing = sum(problem not in SAME for problem in found.values())
    if as_json:
        from wmr_replay.cli.synth_list import echo_json

        echo_json({"directory": str(directory), "passed": not differing, "logs": found})
    else:
        for name, outcome in found.items():
            click.echo(f"{name}: {outcome}")
        click.echo(f"{len(found) - differing} of {len(found)} logs are what the manifest says")
    if differing:
        sys.exit(1)


SAME_BYTES, SAME_COLUMNS = "same bytes", "other bytes, same columns within tolerance"
SAME = (SAME_BYTES, SAME_COLUMNS)


def compared(
    log: "LogSpec", manifest: "Manifest", again: "Manifest", directory: Path, elsewhere: Path
) -> str:
    """How a log of ``directory`` compares with the same log written again ``elsewhere``."""
    from wmr_replay.regress.decoded import first_difference

    if not manifest.is_whole(directory, log):
        return "changed: a file is missing, or is not what the manifest's sha256 says"
    if dict(again.files[log.name]) == dict(manifest.files[log.name]):
        return SAME_BYTES
    name = f"{log.name}.mcap"
    return first_difference(directory / name, elsewhere / name) or SAME_COLUMNS


@contextlib.contextmanager
def suite_progress(
    n_logs: int,
) -> Iterator[tuple[Callable[["LogSpec"], Any], Callable[[int, int], None] | None]]:
    """A bar of messages and a count of logs on standard error, where somebody watches."""
    if not sys.stderr.isatty():
        yield (lambda _: None), None
        return
    from rich.console import Console
    from rich.progress import Progress

    done = 0
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"0 of {n_logs} logs", total=None)

        def announce(_: "LogSpec") -> None:
            nonlocal done
            done += 1
            bar.update(task, description=f"{done} of {n_logs} logs")

        yield announce, lambda done, total: bar.update(task, completed=done, total=total)
