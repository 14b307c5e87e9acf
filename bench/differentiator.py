"""Speed, drift and accuracy of the differentiator and its peers, in one run. Needs the ``bench`` extra.

python bench/differentiator.py [--quick]
"""

import sys
import time

from accuracy import HEAD, Row, accuracy_row, cases
from drift import drift_lines, verdict
from speed import Speeds, measure_speeds


def print_row(cells: list[str]) -> None:
    """Print a line of a Markdown table immediately."""
    print("| " + " | ".join(cells) + " |", flush=True)


def print_head(cells: list[str]) -> None:
    """Print the head of a Markdown table."""
    print_row(cells)
    print_row(["---"] * len(cells))


def say_speeds(speeds: Speeds) -> None:
    """Print the table of speeds and whether the requirements hold."""
    print_head(["", "a second", "over np.convolve"])
    for cells in speeds.lines():
        print_row(cells)
    ours, convolve, algdiff = (speeds.rates[name] for name in ("ours", "np.convolve", "AlgDiff"))
    print(f"\n{verdict(ours >= 2e7)}: ours {ours:.3g} a second, 2e7 asked")
    for name, rate in (("np.convolve", convolve), ("AlgDiff", algdiff)):
        print(f"{verdict(ours >= rate)}: ours {ours / rate:.2f} times {name}, at least 1 asked")
    print(f"{verdict(speeds.same_bits)}: the same bits in other batches, with both backends")
    print(f"{verdict(speeds.windows >= 1e6)}: {speeds.windows:.3g} irregular windows a second, 1e6 asked")


def say_ratios(rows: list[Row]) -> None:
    """Print the error ratios and whether the requirements hold."""
    ratios = [row.ratio for row in rows]
    least, most = min(ratios), max(ratios)
    print(
        f"\n{verdict(most <= 1.02)}: ours over the best causal finite-window peer {least:.3f} to {most:.3f}, "
        "at most 1.02 asked"
    )
    most = max(row.ratio for row in rows if "irregular" in row.case or row.case.startswith("switching"))
    print(
        f"{verdict(most < 1)}: at most {most:.3f} where stamps are irregular or the signal switches, "
        "less than 1 asked"
    )
    wins = sum(min(s.rmse for s in row.recursive.values()) < row.ours.rmse for row in rows)
    print(f"a recursive peer is better in {wins} of {len(rows)} cases")
    for row in rows:
        print(f"  {row.case}: {row.ours.label}")


def main() -> None:
    """Print all tables and whether the requirements hold."""
    start, quick = time.perf_counter(), "--quick" in sys.argv
    print("Speed: input samples × signals × orders a second (2 orders, 3 signals, T = 0.5 s at 1 kHz)\n")
    say_speeds(measure_speeds())
    print("\nDrift: one signal, an offset of 1e6, noise .01, T = 0.5 s at 1 kHz\n")
    for line in drift_lines(10**6 if quick else 10**8):
        print(line, flush=True)
    print("\nAccuracy: RMSE at a delay of 0.14 s, 100 Hz, parameters chosen on another realisation\n")
    print_head(HEAD)
    rows = []
    for case in cases(quick):
        rows.append(accuracy_row(*case))
        print_row(rows[-1].cells())
    say_ratios(rows)
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
