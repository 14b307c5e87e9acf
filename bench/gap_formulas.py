"""The gap analysis on accelerations that no effect of the library is: is a formula found, and a right one?

    python bench/gap_formulas.py --split develop --n 36
    python bench/gap_formulas.py --split report --n 88
    python bench/gap_formulas.py --split develop --n 20 --nothing

A log counts as right where channel, variables and parity of everything that is said are those of the hidden
form; R² is that of the said acceleration against the hidden one over the rows of the log. What the data of a
log cannot tell from the form (``formulas/oracle.py``) is counted apart as well. With ``--nothing`` no
form is hidden, and what is said is counted. Cases go round forms, cells, noises and the sources of modes, so
that a part of a report is a mixture too. Rows are appended to ``--out``; a run that was stopped goes on where
it was.
"""

import argparse
import json
import os
import time
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import numpy as np  # noqa: E402
from formulas.forms import (  # noqa: E402
    DEVELOP,
    EARLIER,
    EIGHTEENTH,
    EIGHTH,
    ELEVENTH,
    FIFTEENTH,
    FIFTH,
    FOURTEENTH,
    FOURTH,
    NINETEENTH,
    NINTH,
    REPORT,
    SECOND,
    SEVENTEENTH,
    SEVENTH,
    SIXTEENTH,
    SIXTH,
    TENTH,
    THIRD,
    THIRTEENTH,
    TWELFTH,
    TWENTIETH,
    TWENTYFIRST,
)
from formulas.oracle import difference, judged  # noqa: E402
from formulas.plants import HiddenWorld, hidden_world  # noqa: E402
from formulas.score import scored  # noqa: E402
from worlds.case import Case, RanAway  # noqa: E402
from worlds.oracle import SEPARATED  # noqa: E402
from worlds.runs import read_rows  # noqa: E402

from wmr_replay.gap import GapOptions, analyse  # noqa: E402 (numpy reads the environment)
from wmr_synth.sensors import NOISE_LEVELS  # noqa: E402

Row = dict[str, Any]
HERE = Path(__file__).parent
FORMS = {
    "develop": DEVELOP,
    "earlier": EARLIER,
    "second": SECOND,
    "third": THIRD,
    "fourth": FOURTH,
    "fifth": FIFTH,
    "sixth": SIXTH,
    "seventh": SEVENTH,
    "eighth": EIGHTH,
    "ninth": NINTH,
    "tenth": TENTH,
    "eleventh": ELEVENTH,
    "twelfth": TWELFTH,
    "thirteenth": THIRTEENTH,
    "fourteenth": FOURTEENTH,
    "fifteenth": FIFTEENTH,
    "sixteenth": SIXTEENTH,
    "seventeenth": SEVENTEENTH,
    "eighteenth": EIGHTEENTH,
    "nineteenth": NINETEENTH,
    "twentieth": TWENTIETH,
    "twentyfirst": TWENTYFIRST,
    "report": REPORT,
}
MODES = ("given", "identified")


def cases(options: argparse.Namespace) -> Iterator[tuple[str, str, Case]]:
    """Form (empty: nothing hidden), source of the modes, and case."""
    table = tomllib.loads((HERE / "formulas/split.toml").read_text(encoding="utf-8"))[options.split]
    cells = [(cell["plant"], family) for cell in table["cells"] for family in cell["families"]]
    forms = [""] if options.nothing else options.form or list(FORMS[options.split])
    modes, noises = options.modes or MODES, options.noise or list(NOISE_LEVELS)
    first, last = table["seeds"]
    first = first if options.first_seed is None else options.first_seed
    for k in range(options.n):
        lap, which = divmod(k, len(forms))
        plant, family = cells[(lap + which) % len(cells)]
        if first + k > last:
            raise ValueError(f"seed {first + k} is not of this part of the split")
        noise = noises[(lap // len(modes) + which) % len(noises)]
        yield forms[which], modes[lap % len(modes)], Case(plant, family, noise, "", first + k)


def row_of(name: str, modes: str, case: Case) -> Row:
    """One log simulated, analysed and scored; the analysis gets the log alone."""
    row: Row = {"form": name, "modes": modes, **vars(case)}
    try:
        world = hidden_world(name, case)
    except RanAway as error:
        return row | {"error": f"not driven: {error}", "effects": [], "verdict": "error"}
    row |= {"sizes": world.hidden.sizes} | analysed(world, modes)
    if name:
        row |= scored(world, row["effects"])
        row["right"] = row["channel"] and row["variables"] and row["parity"]
        word = judged(world)
        row |= {"own": word.own, "moved_m": word.moved_m, "near": word.near}
        row["left"] = difference(world, row["effects"])
        excused = word.excuses([e["name"] for e in row["effects"]]) or row["left"] < SEPARATED
        row["apart"] = not row["right"] and excused
    return row


def analysed(world: HiddenWorld, modes: str) -> Row:
    """Verdict, effects and processor time. An exception is recorded as text."""
    log = world.world.log if modes == "given" else replace(world.world.log, mode=None)
    begun = time.process_time()
    try:
        result = analyse(log, None, GapOptions(modes=modes))
    except Exception as error:  # a crash of the analysis is a result of the benchmark
        return {"verdict": "error", "error": f"{type(error).__name__}: {error}", "effects": []}
    spent = time.process_time() - begun
    effects = [
        {"name": e.name, "parameters": {k: [p.value, *p.ci95] for k, p in e.parameters.items()}}
        for e in result.effects
    ]
    return {"verdict": result.verdict, "sentence": result.sentence, "effects": effects, "cpu_s": spent}


def share(values: list[bool]) -> str:
    """A share in per cent with its count."""
    return f"{100 * np.mean(values):.0f} % ({sum(values)}/{len(values)})" if values else "–"


def report(rows: list[Row], *, nothing: bool) -> str:
    """Tables in Markdown."""
    spent = [row["cpu_s"] for row in rows if "cpu_s" in row]
    time_line = f"processor time a log: median {np.median(spent):.1f} s, n = {len(spent)}"
    if nothing:
        said = [row for row in rows if row["effects"]]
        terms = [row for row in said if any(e["name"].startswith("unnamed:") for e in row["effects"])]
        lines = [f"nothing hidden: a term said in {len(terms)}, an effect in {len(said)} of {len(rows)}"]
        return "\n".join([*lines, *(one_line(row) for row in said), time_line])
    lines = [
        "| form | logs | channel | variables | parity | all three | R² ≥ .9 | median R² |",
        "|" + " --- |" * 8,
    ]
    groups: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        for key in (
            row["form"],
            f"modes {row['modes']}",
            row["noise"],
            f"{row['family']}/{row['plant']}",
            "all",
        ):
            groups[key].append(row)
    order = [
        *dict.fromkeys(row["form"] for row in rows),
        *sorted(set(groups) - {r["form"] for r in rows} - {"all"}),
    ]
    for key in [*order, "all"]:
        of = groups[key]
        cells = [share([bool(r.get(k)) for r in of]) for k in ("channel", "variables", "parity", "right")]
        r2 = [r.get("r2", 0.0) for r in of]
        cells += [share([x >= 0.9 for x in r2]), f"{np.median(r2):.2f}"]
        lines.append(f"| {key} | {len(of)} | {' | '.join(cells)} |")
    told = [row for row in rows if not row.get("apart")]
    right = [bool(row.get("right")) for row in told]
    lines += ["", f"without {len(rows) - len(told)} logs whose data cannot tell: {share(right)} right"]
    failed = [row for row in rows if not row.get("right") or row.get("r2", 0.0) < 0.9]
    lines += ["", "Failures", "", *(one_line(row) for row in failed), "", time_line]
    return "\n".join(lines)


def one_line(row: Row) -> str:
    """A log and its answer."""
    names = " + ".join(f"{next(iter(e['parameters'].values()))[0]:.3g} {e['name']}" for e in row["effects"])
    where = "/".join(str(row[key]) for key in ("family", "plant", "noise", "modes", "seed"))
    where = f"{row['form'] or 'nothing'}/{where}"
    kinds = "".join(key[0] for key in ("channel", "variables", "parity") if row.get(key))
    score = f" [{kinds}] R² {row['r2']:.2f} rms {row['rms']:.2f}" if "r2" in row else ""
    score += f" own {row['own']:.0f}{' apart' * row['apart']}" if "own" in row else ""
    return f"- {where}: {row['verdict']}{score}: {names or row.get('error') or row.get('sentence', '')}"


def main() -> None:
    """Run the cases, and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--split", choices=tuple(FORMS), default="develop")
    parser.add_argument("--n", type=int, default=36)
    parser.add_argument("--first-seed", type=int)
    parser.add_argument("--form", nargs="*")
    parser.add_argument("--modes", nargs="*", choices=MODES)
    parser.add_argument("--noise", nargs="*", choices=tuple(NOISE_LEVELS))
    parser.add_argument("--nothing", action="store_true", help="hide nothing")
    parser.add_argument(
        "--out", type=Path, help="append rows to this file; those that it has are not run again"
    )
    options = parser.parse_args()
    known: dict[str, Row] = {}
    if options.out and options.out.exists():
        known = {key_of(row["form"], row["modes"], row["seed"]): row for row in read_rows(options.out)}
    found = []
    for name, modes, case in cases(options):
        row = known.get(key_of(name, modes, case.seed))
        if row is None:
            row = row_of(name, modes, case)
            append_to(options.out, row)
        found.append(row)
        print(one_line(row), flush=True)
    print("\n" + report(found, nothing=options.nothing))


def append_to(path: Path | None, row: Row) -> None:
    """Append a row to a file of JSON lines; behind a line that was broken off, on one of its own."""
    if path is None:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    whole = not path.exists() or path.read_bytes()[-1:] in {b"", b"\n"}
    with path.open("a", encoding="utf-8") as file:
        file.write("" if whole else "\n")
        file.write(json.dumps(row) + "\n")


def key_of(name: str, modes: str, seed: int) -> str:
    """Key of a row."""
    return f"{name}/{modes}/{seed}"


if __name__ == "__main__":
    main()
