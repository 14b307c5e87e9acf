"""Markdown tables of the gap benchmark from its scores."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import chain

import numpy as np
from figure_blocks import share
from gap_cases import NOISES
from gap_scores import Score, covered

POOR = ("cruise-nothing", "cruise-single", "strong-nothing", "strong-single")
Rows = Sequence[Score]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def rate(rows: Rows, holds: Callable[[Score], bool]) -> str:
    """The share of rows for which ``holds`` is true, with its interval."""
    return share(sum(map(holds, rows)), len(rows))


def of_set(scores: Rows, *names: str) -> list[Score]:
    """The rows of the given sets."""
    return [one for one in scores if one.row["set"] in names]


def at_noise(scores: Rows, noise: str) -> list[Score]:
    """The rows of a noise level, or all rows for ``all``."""
    return [one for one in scores if noise in ("all", one.row["noise"])]


def asked(scores: Rows) -> str:
    """The table of required and measured figures."""
    single, identified = of_set(scores, "single"), of_set(scores, "single-identified")
    nothing, poor = of_set(scores, "nothing", "nothing-identified"), of_set(scores, *POOR)
    ratios = ratios_of([*single, *identified])
    held = covered([*single, *of_set(scores, "pair")])
    inside, equivalent = (list(chain(*(v for k, v in held.items() if k[2] == own))) for own in (True, False))
    cpu = [one.row["cpu_s"] for one in scores if "cpu_s" in one.row]
    lines = [
        ("one effect, modes given: first name right", "≥ 95 %", rate(single, lambda s: s.first)),
        ("– or among its alternatives", "", rate(single, lambda s: s.first_among)),
        ("one effect, modes given: exact set", "≥ 90 %", rate(single, lambda s: s.exact)),
        ("– or with its alternatives", "", rate(single, lambda s: s.exact_among)),
        ("one effect, modes identified: first name right", "≥ 90 %", rate(identified, lambda s: s.first)),
        ("– or among its alternatives", "", rate(identified, lambda s: s.first_among)),
        ("two effects: exact set", "≥ 85 %", rate(of_set(scores, "pair"), lambda s: s.exact)),
        ("– or with their alternatives", "", rate(of_set(scores, "pair"), lambda s: s.exact_among)),
        ("nothing missing: something named", "≤ 1 %", rate(nothing, lambda s: s.claims)),
        (
            "poor excitation or strong disturbance: something false named",
            "≤ 2 %",
            rate(poor, lambda s: bool(s.false)),
        ),
        ("held-out error, after / true model's: median", "≤ 1.1", f"{median(ratios)} (n = {len(ratios)})"),
        ("95 % intervals that hold the truth", "90 to 99 %", share(sum(inside), len(inside))),
        ("– where the hidden form is another", "", share(sum(equivalent), len(equivalent))),
        ("CPU s a log of 90 s: median; 95 %", "≤ 3", f"{median(cpu)}; {quantile(cpu, 0.95)}"),
    ]
    return table(("", "asked", "measured"), lines)


def ratios_of(scores: Rows) -> list[float]:
    """Held-out position error of the extended model over that of the true model, one value for each log."""
    rows = [one.row["position"] for one in scores if "position" in one.row]
    return [row["after"] / row["true"] for row in rows if np.isfinite(row["true"])]


def median(values: Sequence[float]) -> str:
    """To three digits."""
    return quantile(values, 0.5)


def quantile(values: Sequence[float], q: float) -> str:
    """To three digits."""
    return f"{np.quantile(values, q):.3g}" if len(values) else "–"


def singles(scores: Rows) -> str:
    """The table of one and two hidden effects by set and noise."""
    lines = []
    for name in ("single", "single-identified", "pair"):
        for noise in (*NOISES, "all"):
            rows = at_noise(of_set(scores, name), noise)
            shares = [
                rate(rows, holds) for holds in (lambda s: s.first, lambda s: s.first_among, lambda s: s.exact)
            ]
            ambiguous = sum(one.verdict == "ambiguous" for one in rows)
            silent = sum(not one.claims for one in rows)
            lines.append((name, noise, *shares, str(ambiguous), str(silent), median(ratios_of(rows))))
    head = (
        "set",
        "noise",
        "first name right",
        "or among its alternatives",
        "exact set",
        "ambiguous",
        "nothing named",
        "after / true",
    )
    return table(head, lines)


def by_effect(scores: Rows) -> str:
    """The table with one line for each effect."""
    lines = []
    for name in dict.fromkeys(one.hidden for one in of_set(scores, "single")):
        cells = []
        for case_set in ("single", "single-identified"):
            rows = [one for one in of_set(scores, case_set) if one.hidden == name]
            cells += [counted(rows, lambda s: s.first), counted(rows, lambda s: s.exact)]
        wrong = [
            one.said
            for one in of_set(scores, "single", "single-identified")
            if one.hidden == name and not one.exact
        ]
        lines.append((f"`{name}`", *cells, listed(wrong)))
    head = ("hidden", "first", "exact", "first, identified", "exact, identified", "what else was said")
    return table(head, lines)


def counted(rows: Rows, holds: Callable[[Score], bool]) -> str:
    """The count of rows for which something holds, as ``k/n``."""
    return f"{sum(map(holds, rows))}/{len(rows)}"


def listed(things: Iterable[str]) -> str:
    """Items with their counts, the most frequent first."""
    return "; ".join(f"{thing} ({n})" for thing, n in Counter(things).most_common())


def silence(scores: Rows) -> str:
    """The table of the sets in which nothing, or nothing certain, should be named."""
    lines = []
    for name in ("nothing", "nothing-identified", *POOR, "beyond"):
        for noise in (*NOISES, "all"):
            rows = at_noise(of_set(scores, name), noise)
            false = [wrong for one in rows for wrong in one.false]
            right = "–" if name.endswith("nothing") else counted(rows, lambda s: s.exact_among)
            verdicts = listed(one.verdict.replace("_", " ") for one in rows)
            lines.append((name, noise, rate(rows, lambda s: bool(s.false)), right, verdicts, listed(false)))
    return table(("set", "noise", "something false named", "right", "verdicts", "named falsely"), lines)


def reasons(scores: Rows) -> str:
    """The table of reasons for a verdict of not enough excitation."""
    notes = Counter(
        (one.row["set"], shortened(note))
        for one in scores
        if one.verdict == "not_enough_excitation"
        for note in one.row["notes"]
    )
    return table(
        ("set", "reason", "logs"), ((name, note, str(n)) for (name, note), n in notes.most_common(20))
    )


def shortened(note: str) -> str:
    """A reason without the numbers and lists that differ between logs."""
    return re.sub(r"[-−]?\d+(\.\d+)?(e-?\d+)?", "…", note.partition(" have shown ")[0])


def coverage(scores: Rows) -> str:
    """The table of coverage of the 95 % intervals by effect and parameter."""
    found = covered(of_set(scores, "single", "pair"))
    lines = []
    for own, label in ((True, "as its candidate"), (False, "another")):
        chosen = {key: inside for key, inside in found.items() if key[2] == own}
        every = list(chain(*chosen.values()))
        lines.append(("all", "", label, share(sum(every), len(every))))
        lines += [
            (f"`{name}`", key, label, f"{sum(inside)}/{len(inside)}")
            for (name, key, _), inside in sorted(chosen.items())
        ]
    return table(("effect", "parameter", "hidden form", "truth inside"), lines)


def failures(scores: Rows) -> str:
    """The table of logs with an inexact set of effects or a false name, by seed."""
    lines = []
    for one in scores:
        good = not one.false if one.row["set"] in POOR else one.exact
        if not good and one.row["set"] != "beyond":
            row = one.row
            said = row.get("error", one.said)
            lines.append(
                (row["set"], one.hidden, row["noise"], str(row["seed"]), one.verdict.replace("_", " "), said)
            )
    return table(("set", "hidden", "noise", "seed", "verdict", "said"), sorted(lines))
