"""Speed and accuracy of the differentiator beside its peers, in one run. Needs the ``bench`` extra.

python bench/differentiator.py [--quick]
"""

import sys
import time

from accuracy import HEAD, accuracy_row, cases
from speed import speed_lines


def print_row(cells: list[str]) -> None:
    """A line of a Markdown table, at once."""
    print("| " + " | ".join(cells) + " |", flush=True)


def print_head(cells: list[str]) -> None:
    """Head of a Markdown table."""
    print_row(cells)
    print_row(["---"] * len(cells))


def main() -> None:
    """Print both tables and what they amount to."""
    start = time.perf_counter()
    print("Speed: input samples × signals × orders a second (2 orders, 3 signals, T = 0.5 s at 1 kHz)\n")
    print_head(["", "a second", "over np.convolve"])
    for cells in speed_lines():
        print_row(cells)
    print("\nAccuracy: RMSE at a delay of 0.14 s, 100 Hz, parameters chosen on another realisation\n")
    print_head(HEAD)
    rows = []
    for case in cases("--quick" in sys.argv):
        rows.append(accuracy_row(*case))
        print_row(rows[-1].cells())
    ratios = [row.ratio for row in rows]
    wins = sum(min(s.rmse for s in row.recursive.values()) < row.ours.rmse for row in rows)
    print(f"\nours over the best causal finite-window peer: {min(ratios):.3f} to {max(ratios):.3f}")
    print(f"a recursive peer is better in {wins} of {len(rows)} cases")
    for row in rows:
        print(f"  {row.case}: {row.ours.label}")
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
