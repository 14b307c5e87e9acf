"""The gap analysis on the benchmark worlds, modes identified: right, refused and wrong by family and effect.

    python bench/gap_worlds.py --split develop --n 40
    python bench/gap_worlds.py --split report --n 1200 --jobs 2
    python bench/gap_worlds.py --split develop --effect none --family stop-go --n 30

Cases go round the cells of the split; in each cell, effects and noises take turns, and every third log hides
nothing. With ``--mixed`` the same cases come in an order of which every part mixes cells, effects and noises,
so that a run may be stopped. Rows are appended to a file; a run that is started again continues there.
``--fresh`` starts over, as one should after a change of the analysis.
"""

import argparse
import json
import os
import time
from collections.abc import Iterator
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import numpy as np  # noqa: E402 (numpy reads the environment)
from worlds import runs, tables  # noqa: E402
from worlds.best_fit import fitted_sizes  # noqa: E402
from worlds.case import DURATION_S, Case, RanAway, World  # noqa: E402
from worlds.held_out import held_out_scores  # noqa: E402
from worlds.oracle import judged  # noqa: E402
from worlds.plant_two.effects import EFFECTS  # noqa: E402
from worlds.score import holds, outcome, terms_said  # noqa: E402
from worlds.simulate import SAME_FORM, simulated  # noqa: E402
from worlds.split import part  # noqa: E402

from wmr_replay.gap import GapOptions, analyse  # noqa: E402
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack  # noqa: E402
from wmr_synth.sensors import NOISE_LEVELS  # noqa: E402

Row = dict[str, Any]
RESULTS = Path(__file__).parent / "results"
NOTHING_EVERY = 3


def cases(options: argparse.Namespace) -> Iterator[Case]:
    """``--n`` cases of the split, by their seeds from the part's first (or ``--first-seed``) on."""
    chosen = part(options.split)
    cells = [cell for cell in chosen.cells if wanted(cell, options)]
    noises = [options.noise] if options.noise else list(NOISE_LEVELS)
    first = chosen.first_seed if options.first_seed is None else options.first_seed
    order = np.random.default_rng(0).permutation(options.n) if options.mixed else np.arange(options.n)
    for k in order.tolist():
        lap, cell = divmod(k, len(cells))
        plant, family = cells[cell]
        seed = first + k
        chosen.check(plant, family, seed)
        noise = noises[(lap + lap // len(noises)) % len(noises)]
        yield Case(plant, family, noise, effect_of(lap, cell, options.effect), seed, options.seconds)


def wanted(cell: tuple[int, str], options: argparse.Namespace) -> bool:
    """Whether ``--family`` and ``--plant`` leave a cell."""
    plant, family = cell
    return options.family in (None, family) and options.plant in (None, plant)


def effect_of(lap: int, cell: int, choice: str) -> str:
    """The effect that ``--effect`` says: of ``all``, every third log hides nothing, the others go round."""
    if choice == "none":
        return ""
    if choice != "all":
        return choice
    place, rest = divmod(lap, NOTHING_EVERY)
    if rest == NOTHING_EVERY - 1:
        return ""
    return EFFECTS[(place * (NOTHING_EVERY - 1) + rest + 5 * cell) % len(EFFECTS)]


def row_of(case: Case, *, held_out: bool = False, thinned: tuple[int, int] = (1, 1)) -> Row:
    """One log simulated, judged by the oracle, analysed and scored. The analysis gets the log alone.

    Of the log, every so many poses and torques are kept, as ``thinned`` says; the oracle sees all of them.
    With ``held_out``, the held-out predictive scores of the base, the named and the true model are among it.
    """
    row: Row = {"key": case.key, **vars(case), "inseparable": [], "own": 0.0, "holds": {}}
    row["same_form"] = case.effect in SAME_FORM[case.plant]
    try:
        world = simulated(case)
    except RanAway as error:
        return row | {"outcome": "not driven", "error": str(error)}
    judgement = judged(world) if case.effect else None
    seen = replace(world, log=thin(world.log, *thinned))
    if judgement is not None:
        row |= {"inseparable": sorted(judgement.inseparable), "own": judgement.own}
        row |= {"may_refuse": judgement.may_refuse, "rivals": judgement.rivals}
    row |= world.facts() | analysed(seen)
    row["fitted"] = fitted_sizes(world, SAME_FORM[case.plant], terms_said(row))
    if held_out and "error" not in row:
        row |= held_out_scores(world, row)
    return row | {"outcome": outcome(row, judgement), "holds": holds(row)}


def thin(log: Log, every_pose: int, every_torque: int) -> Log:
    """The log with every so many poses and torques, as a recorder slower than the robot keeps them."""
    pose, torque = log.pose, log.torque
    assert torque is not None
    columns = (getattr(pose, field.name)[::every_pose] for field in fields(pose))
    kept = (getattr(torque, field.name)[::every_torque] for field in fields(torque))
    return replace(log, pose=PoseTrack(*columns), torque=TorqueTrack(*kept))


def analysed(world: World) -> Row:
    """What the analysis says, and its processor time. An exception is recorded as text."""
    begun = time.process_time()
    try:
        result = analyse(world.without_modes(), None, GapOptions(modes="identified"))
    except Exception as error:  # a crash of the analysis is a result of the benchmark
        return {"error": f"{type(error).__name__}: {error}"}
    spent = time.process_time() - begun
    words = {"verdict": result.verdict, "sentence": result.sentence, "notes": list(result.notes)}
    return words | {"effects": runs.effects_said(result.effects), "cpu_s": spent}


def main() -> None:
    """Run the cases, and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--split", choices=("develop", "report"), default="develop")
    parser.add_argument("--n", type=int, default=40)
    parser.add_argument("--first-seed", type=int)
    parser.add_argument("--effect", choices=("all", "none", *EFFECTS), default="all")
    parser.add_argument("--family")
    parser.add_argument("--plant", type=int, choices=(1, 2, 3))
    parser.add_argument("--noise", choices=tuple(NOISE_LEVELS))
    parser.add_argument("--seconds", type=float, default=DURATION_S, help="length of each log")
    parser.add_argument("--mixed", action="store_true", help="in an order that may be stopped anywhere")
    parser.add_argument(
        "--thinned",
        type=int,
        nargs=2,
        default=(1, 1),
        metavar=("POSES", "TORQUES"),
        help="keep every so many",
    )
    parser.add_argument("--held-out", action="store_true", help="held-out scores too, some 3 s a log more")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--fresh", action="store_true", help="forget the rows of the file")
    parser.add_argument("--json", action="store_true", help="print rows in place of tables")
    options = parser.parse_args()
    out = options.out or RESULTS / f"gap_worlds.{options.split}.jsonl"
    if options.fresh:
        out.unlink(missing_ok=True)
    rows = runs.run(
        partial(row_of, held_out=options.held_out, thinned=tuple(options.thinned)),
        cases(options),
        out,
        options.jobs,
    )
    print("\n".join(map(json.dumps, rows)) if options.json else tables.report(rows))


if __name__ == "__main__":
    main()
