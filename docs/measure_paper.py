"""Measures the paper's scenarios over many seeds: ``python docs/measure_paper.py [--seeds 20]``.

Prints, as the Markdown tables of ``docs/paper.md``, the median and range of what ``wmr-replay run`` scores.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from paper_runs import Replayed, quotient, replay

from wmr_schemas.robot import PAPER_ROBOT

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
CONSTANT_SCORES = {
    "error of the last α": SIGNED,
    "its standard deviation, as stated": PERCENT,
    "the error in stated standard deviations": RATIO,
    "standard deviation of the paper's quotient": PERCENT,
}
Values = Sequence[float | None]


def switching_scores(run: Replayed) -> list[float | None]:
    """What the summary says of modes."""
    return [run.summary[column] for column, _ in SWITCHING_SCORES.values()]


def constant_scores(run: Replayed) -> list[float | None]:
    """What there is to say of α in one mode throughout."""
    error, sd = run.summary["alpha_error"], run.summary["alpha_sd"]
    true = PAPER_ROBOT.alpha or np.nan
    quotients = run.samples.select(quotient())["quotient"].drop_nulls() / true
    return [error, sd / true, error * true / sd, quotients.std()]  # type: ignore[list-item]


def spread(values: Values, form: str) -> str:
    """Median and range."""
    known = [value for value in values if value is not None]
    if not known:
        return "–"
    middle, low, high = (form.format(v) for v in (float(np.median(known)), min(known), max(known)))
    return f"{middle} ({low} … {high})".replace("%", " %").replace("-", "−")


def table(
    scenarios: Sequence[str], labels: Sequence[tuple[str, str]], scores: Sequence[Sequence[Values]]
) -> str:
    """Markdown: a row per score, a column per scenario; ``scores`` by scenario and label."""
    lines = [
        "| | " + " | ".join(f"`{name}`" for name in scenarios) + " |",
        "| --- " * (len(scenarios) + 1) + "|",
    ]
    for k, (label, form) in enumerate(labels):
        lines.append(f"| {label} | " + " | ".join(spread(column[k], form) for column in scores) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--quick", action="store_true", help="short logs, to try the road")
    options = parser.parse_args()
    forms = {label: form for label, (_, form) in SWITCHING_SCORES.items()}
    for scenarios, score, labels in (
        (SWITCHING, switching_scores, forms),
        (CONSTANT, constant_scores, CONSTANT_SCORES),
    ):
        rows = [
            [score(replay(name, seed=seed, quick=options.quick)) for seed in range(options.seeds)]
            for name in scenarios
        ]
        columns = [list(zip(*by_seed, strict=True)) for by_seed in rows]
        print(table(scenarios, list(labels.items()), columns), flush=True)


if __name__ == "__main__":
    main()
