"""Small pieces of text that the reports of ``gap`` and ``fit`` share, and what to do next."""

import math
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wmr_replay.api.gap import Gap

MODES = {"identified": "identified", "ideal": "ideal throughout, as asked"}
LEAST_P = 1e-12
MOST_DECIMALS = 7


def modes_in_words(modes: str) -> str:
    """How the contact modes were obtained."""
    return MODES.get(modes, f"those on {modes.removeprefix('topic:')}")


def numbers(value: float | None, interval: tuple[float | None, float | None]) -> tuple[str, str]:
    """A value and its interval, ``low … high``, to two digits of the interval's half width."""
    low, high = interval
    if low is None or high is None or not high > low:
        shown = "{:.4g}"
    else:
        decimals = 1 - math.floor(math.log10((high - low) / 2))
        shown = f"{{:.{decimals}f}}" if 0 <= decimals <= MOST_DECIMALS else "{:.4g}"
    value_text, low_text, high_text = ("–" if v is None else shown.format(v) for v in (value, low, high))
    return value_text, f"{low_text} … {high_text}"


def unit_of(unit: str) -> str:
    """The unit behind a number; a ratio has none."""
    return "" if unit in ("1", "–") else unit


def p_in_words(p: float | None) -> str:
    """A p value; below 1e-12 only its order counts."""
    if p is None:
        return "–"
    return "< 1e-12" if p < LEAST_P else f"{p:.2g}"


def next_steps(found: "Gap", log: Path) -> Iterator[tuple[str, str]]:
    """The commands that follow from the verdict, then the files."""
    model = shlex.quote(str(found.files["model"]))
    if found.document.effects:
        yield "next", f"wmr-replay gap ANOTHER_LOG --model {model}"
        yield "", f"wmr-replay run {shlex.quote(str(log))} --model {model}"
    if (
        found.document.verdict in ("ambiguous", "not_enough_excitation")
        and found.document.base_model == "torque"
    ):
        yield "drive", f"wmr-replay excite --from {shlex.quote(str(found.files['json']))}"
    yield "results", f"{found.files['json'].parent}/"
    if "report" in found.files:
        yield "report", str(found.files["report"])
    if "timeline" in found.files:
        from wmr_replay.timeline.viewer import viewer_command

        yield "viewer", viewer_command(found.files["timeline"])
