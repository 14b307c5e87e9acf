"""A short log of the benchmark worlds."""

from pathlib import Path

BENCH = Path(__file__).parents[3] / "bench"
SHORT_S = 20.0


def case_of(worlds, **changes):
    """A short stop-go drive of the second plant with nothing hidden, but for the changes."""
    plain = {"plant": 2, "family": "stop-go", "noise": "mocap", "effect": "", "seed": 7}
    return worlds("case").Case(**({"duration_s": SHORT_S} | plain | changes))
