"""The gap analysis on logs of MuJoCo: which of the engine's effects it names, by robot, noise and effect.

    python bench/gap_mujoco.py --split develop --n 60
    python bench/gap_mujoco.py --split report --n 400 --jobs 2
    python bench/gap_mujoco.py --robot cart --effect none --noise mocap --n 6
    python bench/gap_mujoco.py --split report --wheel-speeds --n 400

Every log is a canonical MCAP without a mode topic, analysed with default settings; its base model is what
``fit`` calibrates on another log of the robot, on which nothing is hidden. Cases go round the robots; of five
rounds two hide an effect; effects, noises and families take turns, so that a run may be stopped anywhere.
Rows are appended to a file; a run that is started again, or with a larger ``--n``, continues there.
``--fresh`` starts over, as one should after a change of the analysis. An oracle says which logs
can tell their effect at all (``engine.oracle``): a refusal of the others is right.
"""

import argparse
import json
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

from engine import tables  # noqa: E402
from engine.case import FAMILIES, Case  # noqa: E402
from engine.drive import RanAway  # noqa: E402
from engine.effects import EDITS  # noqa: E402
from engine.logs import Logged, base_of, logged, written  # noqa: E402
from engine.oracle import judged  # noqa: E402
from engine.rivals import left_by_rivals  # noqa: E402
from engine.robot import BY_WHEELS, FOUR_WHEELED  # noqa: E402
from engine.score import outcome, rivals_said  # noqa: E402
from engine.split import accepted, makes_both, part  # noqa: E402
from worlds import runs  # noqa: E402
from worlds.score import CLAIMS  # noqa: E402

from wmr_replay.api.gap import gap  # noqa: E402 (numpy reads the environment)
from wmr_schemas.model_file import Model  # noqa: E402
from wmr_synth.sensors import NOISE_LEVELS  # noqa: E402

Row = dict[str, Any]
RESULTS = Path(__file__).parent / "results"
ROUNDS, HIDING = 5, (0, 2)
"""Of so many rounds these hide an effect: 200 logs with one come with 300 without."""
SECOND_EVERY = 2
"""Of so many effects that are named one is tried on a second log."""
LOCAL = ("slick_patch", "load_step")
"""Effects local in time or place: another log has them elsewhere or not at all."""


def cases(options: argparse.Namespace) -> Iterator[Case]:
    """Of ``--n`` cases of the split, by their seeds from the part's first (or ``--first-seed``) on, those of
    the ``--kind``.
    """
    chosen = part(options.split)
    robots = [options.robot] if options.robot else list(chosen.robots)
    if not {*robots} <= {*chosen.robots}:
        raise SystemExit(f"only {', '.join(chosen.robots)} in this part")
    if options.wheel_speeds:
        robots = [f"{name}{BY_WHEELS}" for name in robots if name not in FOUR_WHEELED]
    families = [options.family] if options.family else list(chosen.families)
    noises = [options.noise] if options.noise else list(NOISE_LEVELS)
    if not {*families} <= {*chosen.families}:
        raise SystemExit(f"only {', '.join(chosen.families)} in this part")
    first = chosen.first_seed if options.first_seed is None else options.first_seed
    for k in range(options.n):
        lap, place = divmod(k, len(robots))
        chosen.check(first + k)
        names = list(accepted(robots[place]))
        effect, turn = effect_of(lap, 5 * place, names, options.effect)
        family = families[(turn + turn // len(families) + place) % len(families)]
        noise = noises[(turn + 2 * (turn // len(names)) + place) % len(noises)]
        if options.kind in ("all", "hidden" if effect else "nothing"):
            yield Case(robots[place], family, noise, effect, first + k)


def effect_of(lap: int, shift: int, names: list[str], choice: str) -> tuple[str, int]:
    """The effect that ``--effect`` says, and how many laps of its kind came before: of ``all``, the laps
    ``HIDING`` of each ``ROUNDS`` hide the effects by turns.
    """
    if choice != "all":
        return "" if choice == "none" else choice, lap
    rounds, rest = divmod(lap, ROUNDS)
    if rest not in HIDING:
        before = [one for one in range(ROUNDS) if one not in HIDING].index(rest)
        return "", rounds * (ROUNDS - len(HIDING)) + before
    turn = rounds * len(HIDING) + HIDING.index(rest)
    return names[(turn + shift) % len(names)], turn


def row_of(case: Case) -> Row:
    """One log driven, analysed and scored. The analysis gets the log and the base model alone."""
    row: Row = {"key": case.key, **vars(case), "sizes": {}}
    try:
        found = logged(case)
    except RanAway as error:
        return row | {"outcome": "not driven", "error": str(error)}
    row |= {"sizes": found.hidden.sizes} | analysed(case, found)
    names = accepted(case.robot).get(case.effect, [])
    row |= {"outcome": outcome(row, names, both=makes_both(case.robot, case.effect))}
    extended = row.pop("model", None)
    if case.effect:
        try:
            word = judged(case, found)
        except RanAway as error:  # the robot without the effect
            return row | {"outcome": "not driven", "error": str(error)}
        row |= {"own": word.own, "crossings": word.crossings, "may_refuse": word.may_refuse}
    if row["outcome"] == "among":
        row["rivals"] = left_by_rivals(case, found, rivals_said(row, names))
    tried_again = case.effect and case.effect not in LOCAL and case.seed % SECOND_EVERY == 0
    if tried_again and row.get("verdict") in CLAIMS:
        row["second"] = second(replace(case, again=True), extended)
    return row


def second(case: Case, extended: Model) -> Row:
    """What ``gap`` finds on another log of the robot with the extended model of the first."""
    try:
        said = analysed(case, logged(case), extended)
    except RanAway:
        return {"verdict": "not driven"}
    said.pop("model", None)
    return {"verdict": "error"} | said


def analysed(case: Case, found: Logged, base: Model | None = None) -> Row:
    """What the analysis says, its processor time and the extended model. An exception is recorded as text."""
    try:
        base = base or base_of(case)
        with TemporaryDirectory() as folder:
            path = written(found.log, Path(folder) / "log.mcap")
            begun = time.process_time()
            answer = gap(path, model=base)
            spent = time.process_time() - begun
    except Exception as error:  # a crash of the analysis is a result of the benchmark
        return {"error": f"{type(error).__name__}: {error}"}
    words = {"verdict": answer.verdict, "sentence": answer.sentence, "notes": list(answer.document.notes)}
    return words | {
        "effects": runs.effects_said(answer.document.effects),
        "cpu_s": spent,
        "model": answer.model,
    }


def main() -> None:
    """Run the cases, and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--split", choices=("develop", "report"), default="develop")
    parser.add_argument("--n", type=int, default=40)
    parser.add_argument("--first-seed", type=int)
    parser.add_argument("--effect", choices=("all", "none", *EDITS), default="all")
    parser.add_argument(
        "--kind", choices=("all", "hidden", "nothing"), default="all", help="logs with or without an effect"
    )
    parser.add_argument("--robot")
    parser.add_argument(
        "--wheel-speeds",
        action="store_true",
        help="two-wheeled robots, their wheel speeds in place of torques",
    )
    parser.add_argument("--family", choices=tuple(FAMILIES))
    parser.add_argument("--noise", choices=tuple(NOISE_LEVELS))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--fresh", action="store_true", help="forget the rows of the file")
    parser.add_argument("--json", action="store_true", help="print rows in place of tables")
    options = parser.parse_args()
    kind = BY_WHEELS if options.wheel_speeds else ""
    out = options.out or RESULTS / f"gap_mujoco{kind}.{options.split}.jsonl"
    if options.fresh:
        out.unlink(missing_ok=True)
    rows = runs.run(row_of, cases(options), out, options.jobs)  # type: ignore[arg-type]
    print("\n".join(map(json.dumps, rows)) if options.json else tables.report(rows))


if __name__ == "__main__":
    main()
