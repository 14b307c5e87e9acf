"""``wmr-replay suite``: write a named set of logs, or check that one is what it should be."""

import sys
from pathlib import Path

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.completion import complete_suite


@click.command(
    "suite",
    cls=GroupedCommand,
    epilog="""\b
Examples:
  wmr-replay suite --list
  wmr-replay suite paper --out logs/paper
  wmr-replay suite noise-sweep --out logs/noise --seed 3 --jobs 4
  wmr-replay suite my.toml --out logs/mine
  wmr-replay suite --verify logs/paper
""",
)
@click.argument("name", metavar="[NAME|FILE.toml]", required=False, shell_complete=complete_suite)
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
    if listing:
        from wmr_replay.cli.printing.suite import print_suites

        print_suites(as_json=as_json)
    elif verify is not None:
        if name is not None or out is not None or seed is not None:
            raise click.UsageError("--verify takes suite and seed from the manifest in its directory")
        check_suite(verify, jobs, as_json)
    elif name is None:
        raise click.UsageError("which suite? `wmr-replay suite --list` names them")
    elif out is None:
        raise click.UsageError(f"where to? For example: wmr-replay suite {name} --out logs/{Path(name).stem}")
    else:
        write(name, out, seed or 0, jobs, as_json)


def write(name: str, out: Path, seed: int, jobs: int | None, as_json: bool) -> None:
    """Write the suite and print what was done."""
    from wmr_replay.api.suite import suite, suite_of
    from wmr_replay.cli.printing.progress import suite_progress
    from wmr_replay.cli.printing.suite import print_suite

    with suite_progress(len(suite_of(name).logs)) as (announce, progress):
        written = suite(name, out, seed=seed, jobs=jobs, announce=announce, progress=progress)
    print_suite(written, as_json=as_json)


def check_suite(directory: Path, jobs: int | None, as_json: bool) -> None:
    """Write the suite of the manifest again and compare; exit 1 where a log is another."""
    from wmr_replay.api.suite import manifest_of, verify_suite
    from wmr_replay.cli.printing.progress import suite_progress
    from wmr_replay.cli.printing.suite import print_verified

    with suite_progress(len(manifest_of(directory).suite.logs)) as (announce, progress):
        verified = verify_suite(directory, jobs=jobs, announce=announce, progress=progress)
    print_verified(verified, as_json=as_json)
    if not verified.passed:
        sys.exit(1)
