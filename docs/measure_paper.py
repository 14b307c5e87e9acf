"""Measures the paper's scenarios over many seeds: ``python docs/measure_paper.py [--seeds 20] [--write]``.

Prints median and range of the scores of ``wmr-replay run`` as Markdown, or puts them into ``docs/paper.md``.
"""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
from paper_runs import Replayed, quotient, replay

from wmr_schemas.robot import PAPER_ROBOT

PAGE = Path(__file__).with_name("paper.md")
SWITCHING = ("paper-acceleration", "paper-deceleration", "paper-uniform")
CONSTANT = ("paper-alpha-ideal", "paper-alpha-skidding")
PERCENT, SIGNED, SECONDS, NUMBER, RATIO = "{:.1%}", "{:+.1%}", "{:.2f} s", "{:.0f}", "{:+.1f}"

SWITCHING_SCORES = {
    "accuracy": ("accuracy", PERCENT),
    "decided": ("decided_share", PERCENT),
    "recall, ideal": ("recall_ideal", PERCENT),
    "recall, skidding": ("recall_skidding", PERCENT),
    "recall, slipping": ("recall_slipping", PERCENT),
    "detection delay, median": ("median_detection_delay_s", SECONDS),
    "detection delay, 95th percentile": ("p95_detection_delay_s", SECONDS),
    "switches missed, of 5": ("missed_switches", NUMBER),
    "false alarms in an hour": ("false_alarms_per_hour", NUMBER),
    "error of the last α": ("alpha_error", SIGNED),
}
SAMPLE_SCORES = {
    "wrong or undecided, up to 1.5 s after a switch": PERCENT,
    "wrong or undecided, later": PERCENT,
    "mean relative error of v_long": "{:+.2%}",
}
CONSTANT_SCORES = {
    "error of the last α": SIGNED,
    "its standard deviation, as stated": PERCENT,
    "the error in stated standard deviations": RATIO,
    "standard deviation of the paper's quotient": PERCENT,
}
AFTER_SWITCH_S = 1.5
Values = Sequence[float | None]


def switching_scores(run: Replayed) -> list[float | None]:
    """Scores of the modes from the summary and from the rows."""
    return [run.summary[column] for column, _ in SWITCHING_SCORES.values()] + sample_scores(run)


def sample_scores(run: Replayed) -> list[float | None]:
    """Shares of wrong rows shortly after a true switch and elsewhere; mean relative error of v_long."""
    rows = run.samples.filter(pl.col("status") != "warming_up")
    t_s, wrong = rows["t_s"].to_numpy(), (rows["mode"] != rows["mode_true"]).to_numpy()
    switches = run.truth.filter(pl.col("mode").diff() != 0)["t_s"].to_numpy()
    age_s = t_s - np.append(-np.inf, switches)[np.searchsorted(switches, t_s, side="right")]
    fresh = age_s < AFTER_SWITCH_S
    true_mps = np.interp(t_s - rows["delay_s"].to_numpy(), run.truth["t_s"], run.truth["v_long_mps"])
    error = np.mean(rows["v_long_mps"].to_numpy() / true_mps - 1)
    return [float(np.mean(wrong & fresh)), float(np.mean(wrong & ~fresh)), float(error)]


def constant_scores(run: Replayed) -> list[float | None]:
    """Scores of α in one mode throughout."""
    error, sd = run.summary["alpha_error"], run.summary["alpha_sd"]
    true = PAPER_ROBOT.alpha or np.nan
    quotients = run.samples.select(quotient())["quotient"].drop_nulls() / true
    return [error, sd / true, error * true / sd, quotients.std()]  # type: ignore[list-item]


def spread(values: Values, form: str) -> str:
    """Median and range as text."""
    known = [value for value in values if value is not None]
    if not known:
        return "–"
    middle, low, high = (form.format(v) for v in (float(np.median(known)), min(known), max(known)))
    return f"{middle} ({low} … {high})".replace("%", " %").replace("-", "−")


def table(
    scenarios: Sequence[str], labels: Sequence[tuple[str, str]], scores: Sequence[Sequence[Values]]
) -> str:
    """A Markdown table: a row for each score, a column for each scenario; ``scores`` by both."""
    lines = [
        "| | " + " | ".join(f"`{name}`" for name in scenarios) + " |",
        "| --- " * (len(scenarios) + 1) + "|",
    ]
    for k, (label, form) in enumerate(labels):
        lines.append(f"| {label} | " + " | ".join(spread(column[k], form) for column in scores) + " |")
    return "\n".join(lines) + "\n"


def measure(seeds: int, quick: bool) -> dict[str, str]:
    """Both tables by name."""
    forms = {label: form for label, (_, form) in SWITCHING_SCORES.items()} | SAMPLE_SCORES
    tables = {}
    for name, scenarios, score, labels in (
        ("switching", SWITCHING, switching_scores, forms),
        ("constant", CONSTANT, constant_scores, CONSTANT_SCORES),
    ):
        columns = []
        for scenario in scenarios:
            by_seed = [score(replay(scenario, seed=seed, quick=quick)) for seed in range(seeds)]
            columns.append(list(zip(*by_seed, strict=True)))
        tables[name] = table(scenarios, list(labels.items()), columns)
    return tables


def filled(page: str, tables: dict[str, str]) -> str:
    """The page with its measured tables replaced."""
    for name, text in tables.items():
        block = re.compile(rf"(<!-- measured {name} -->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        page = block.sub(lambda found, text=text: f"{found[1]}\n{text}\n{found[2]}", page)
    return page


def main() -> None:
    """Print both tables, or put them into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--quick", action="store_true", help="short logs, to try the command")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/paper.md")
    options = parser.parse_args()
    tables = measure(options.seeds, options.quick)
    if options.write:
        PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), tables), encoding="utf-8")
    else:
        print("\n".join(tables.values()))


if __name__ == "__main__":
    main()
