"""Write the figures of docs/gap-worlds.md from the rows of a report.

    python bench/gap_worlds_page.py --worlds worlds.jsonl --engine engine.jsonl --wheels wheels.jsonl
    python bench/gap_worlds_page.py --formulas formulas.jsonl

Rows are those that gap_worlds.py, gap_mujoco.py and gap_formulas.py append to their files. Of a file that is
not given, the blocks stay as they are; of several files for one report, all rows count. A log that is in the
rows twice counts by the last. ``--page`` fills another page.
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import figure_blocks
from worlds.figures import latest
from worlds.runs import read_rows

PAGE = Path(__file__).parents[1] / "docs" / "gap-worlds.md"
Row = dict[str, Any]


def rows_of(paths: Sequence[Path], key: Callable[[Row], object]) -> list[Row]:
    """The rows of all files, the last of each key. Raises FileNotFoundError for a file that is not there."""
    for path in paths:
        path.stat()
    return latest((row for path in paths for row in read_rows(path)), key)


def blocks_of(options: argparse.Namespace) -> dict[str, str]:
    """The blocks of the reports whose rows are given."""
    found: dict[str, str] = {}
    if options.worlds:
        from worlds import figures as worlds  # noqa: PLC0415 (each needs what its benchmark needs)

        found |= worlds.blocks(rows_of(options.worlds, lambda row: row["key"]))
    if options.engine or options.wheels:
        from engine import figures as engine  # noqa: PLC0415 (MuJoCo)
        from engine.split import accepted  # noqa: PLC0415

        for report in ("engine", "wheels"):
            if paths := getattr(options, report):
                found |= engine.blocks(rows_of(paths, lambda row: row["key"]), accepted, report)
    if options.formulas:
        from formulas import figures as formulas  # noqa: PLC0415

        rows = rows_of(options.formulas, lambda row: (row["form"], row["modes"], row["seed"]))
        found |= formulas.blocks(rows)
    return found


def main() -> None:
    """Fill the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--worlds", type=Path, nargs="+", default=[])
    parser.add_argument("--engine", type=Path, nargs="+", default=[])
    parser.add_argument("--wheels", type=Path, nargs="+", default=[])
    parser.add_argument("--formulas", type=Path, nargs="+", default=[])
    parser.add_argument("--page", type=Path, default=PAGE)
    options = parser.parse_args()
    found = blocks_of(options)
    options.page.write_text(figure_blocks.filled(options.page.read_text(), found))
    print(f"{options.page}: {', '.join(found) or 'no rows, nothing changed'}")


if __name__ == "__main__":
    main()
