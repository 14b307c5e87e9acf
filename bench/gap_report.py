"""Write the tables of docs/gap-benchmark.md from the rows of bench/gap.py."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import figure_blocks
import gap_tables as tables
from gap_cases import NOISES
from gap_scores import Score, score
from gap_tables import Rows, at_noise, rate, table

PAGE = Path(__file__).parents[1] / "docs" / "gap-benchmark.md"
Row = dict[str, Any]


def rivals(rows: Sequence[Row], scores: Rows) -> str:
    """The table of the baselines and the analysis, on the same logs."""
    own = {one.row["key"]: one for one in scores}
    by_method: dict[str, list[Score]] = {}
    for row in rows:
        if row["key"] in own:
            by_method.setdefault(row["method"], []).append(score(row))
    keys = {one.row["key"] for found in by_method.values() for one in found}
    by_method = {"this analysis": [own[key] for key in sorted(keys)], **by_method}
    with_a_term = {row["key"] for row in rows if row["expressible"]}
    lines = []
    for method, found in by_method.items():
        effects, nothing = [s for s in found if s.row["hidden"]], [s for s in found if not s.row["hidden"]]
        within = [s for s in effects if s.row["key"] in with_a_term]
        for noise in (*NOISES, "all"):
            parts = [at_noise(part, noise) for part in (effects, within, nothing)]
            cells = [rate(parts[0], lambda s: s.first), rate(parts[0], lambda s: s.exact)]
            cells += [rate(parts[1], lambda s: s.first), rate(parts[2], lambda s: s.claims)]
            lines.append((method, noise, *cells))
    head = (
        "method",
        "noise",
        "first name right",
        "exact set",
        "first right, effects with a term",
        "named, nothing missing",
    )
    return table(head, lines)


def filled(page: str, scores: Rows, baselines: Sequence[Row]) -> str:
    """The page with its tables replaced; the table of the baselines is kept if there are no rows for it."""
    makers = {
        "asked": tables.asked,
        "singles": tables.singles,
        "effects": tables.by_effect,
        "silence": tables.silence,
        "reasons": tables.reasons,
        "coverage": tables.coverage,
        "failures": tables.failures,
    }
    if baselines:
        makers["rivals"] = lambda found: rivals(baselines, found)
    wanted = figure_blocks.names(page)
    return figure_blocks.filled(page, {name: of(scores) for name, of in makers.items() if name in wanted})


def latest(rows: Sequence[Row]) -> list[Row]:
    """The last row of each key."""
    by_key = {row["key"] + row.get("method", ""): row for row in rows}
    return list(by_key.values())


def write_report(rows: Sequence[Row], baselines: Sequence[Row]) -> None:
    """Fill the page with the rows of the last state of the sources; count and leave out the others."""
    rows = latest(rows)
    state = rows[-1]["state"] if rows else ""
    kept = [score(row) for row in rows if row["state"] == state]
    print(f"{len(kept)} logs; {len(rows) - len(kept)} of an earlier state of the sources left out")
    PAGE.write_text(filled(PAGE.read_text(), kept, latest(baselines)))
