"""The page of a gap analysis: what the model lacks, the proof, where it shows, and what remains.

It is drawn from ``gap.json`` and ``gap_traces.parquet`` alone.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence

import msgspec
import polars as pl

from wmr_replay.report import gap_elsewhere, page
from wmr_replay.report import gap_figures as figures
from wmr_replay.report.charts import Figure
from wmr_schemas.gap_file import Candidate, Effect, Estimate, Gap, GapFile, HeldOut, Proof, YawGap
from wmr_schemas.text import figure, json_text

VERDICTS = {
    "named": ("Named.", "#1f7a4d"),
    "ambiguous": ("Ambiguous.", "#b26a00"),
    "unnamed": ("Unnamed.", "#b26a00"),
    "nothing_missing": ("Nothing missing.", "#1d6f8f"),
    "not_enough_excitation": ("Not enough excitation.", "#8a3d8f"),
}
WHERE = {
    "longitudinal": "the longitudinal acceleration",
    "lateral": "the lateral motion",
    "yaw": "the yaw acceleration",
    "both": "the longitudinal and the yaw acceleration",
    "input": "the torques",
    "measurement": "the measured pose",
}
WHERE_BY_WHEELS = {
    "longitudinal": "the velocity ahead",
    "lateral": "the velocity sideways",
    "yaw": "the yaw rate",
    "both": "the velocity ahead and the yaw rate",
    "input": "the wheel speeds",
}
MOST_CANDIDATES = 10
SMALLEST_P = 1e-12
INTERVAL = re.compile(r" \([^\s()]+ to [^\s()]+\)")
"""The interval of a coefficient in the text of a formula."""


def gap_page(gap: GapFile, traces: pl.DataFrame, name: str, other: pl.DataFrame | None = None) -> str:
    """The page of an analysis of the log ``name``, as the text of a file; ``other`` are the paths on another
    log. Raises MissingExtra.
    """
    sheet = page.Page(name, "gap between simulation and measurement")
    word, tone = VERDICTS[gap.verdict]
    sheet.add(page.verdict(word, gap.sentence.strip(), tone), page.facts(fact_list(gap)))
    if gap.effects:
        sheet.section("What is missing")
        sheet.add(*missing(gap))
        sheet.add(effect_table(gap.effects))
    sheet.section("Data quality")
    sheet.add(quality(gap))
    sheet.section("The proof" if gap.effects else "What the base model leaves")
    sheet.figures(*proof(gap, traces))
    sheet.section("Where it shows", where_lead(gap))
    sheet.figures(*[[one] for one in figures.path_figures(gap, traces)])
    sheet.figures([figures.error_figure(traces, extended=bool(gap.effects), seconds=gap.gap.seconds)])
    sheet.add(page.details("Where, in numbers", where_table(gap)))
    if gap.proof is not None and other is not None:
        sheet.section("On another log", gap_elsewhere.lead(gap.proof))
        sheet.add(page.facts(proof_facts(gap.proof)))
        gap_elsewhere.add_figures(sheet, gap, gap.proof, other)
    if gap.candidates:
        sheet.section(
            "Candidates and their scores",
            "Score: drop of the deviance less the price of the parameters. The best of a stage is tested.",
        )
        sheet.add(*candidate_tables(list(formulas_as_one(gap))))
    alternatives(sheet, gap)
    remains(sheet, gap)
    sheet.section("How it was made")
    sheet.add(
        page.details(
            "The extended model", f"<pre>{page.lines(json_text(msgspec.to_builtins(gap.model)))}</pre>"
        )
    )
    sheet.add(page.footer(origin(gap)))
    return sheet.text()


def missing(gap: GapFile) -> Iterator[str]:
    """What each effect acts on; the terms of a formula in one line, whose intervals the table has."""
    known = WHERE | (WHERE_BY_WHEELS if gap.base_model == "wheel_speed" else {})
    for effect in figures.named(gap):
        place, formula = page.escape(known.get(effect.channel, effect.channel)), page.escape(effect.formula)
        yield f"<p><b>{page.escape(effect.name)}</b> acts on {place}: <code>{formula}</code></p>"
    for one in gap.formulas:
        place, size = page.escape(known.get(one.channel, one.channel)), figure(one.rms_mps2)
        formula = page.escape(INTERVAL.sub("", one.text))
        yield f"<p><b>A formula</b> acts on {place}, by {size} m/s² (rms): <code>{formula}</code></p>"


def origin(gap: GapFile) -> list[str]:
    """Log, hash, version and what was asked for."""
    asked = gap.settings
    limits = f"tolerance {1e3 * asked.tolerance_m:.3g} mm in {asked.tolerance_s:g} s"
    most = f"at most {asked.max_effects} effects, seed {gap.seed}"
    return [gap.log, f"SHA-256 {gap.log_sha256}", f"wmr-replay {gap.version}; {limits}, {most}"]


def fact_list(gap: GapFile) -> Iterator[tuple[str, str, str]]:
    """The gap before and after, and what it was made with."""
    yield metric_fact("held-out gap, position", gap.gap.held_out, "mm", gap.gap.windows)
    yield metric_fact("held-out gap, yaw", gap.gap.yaw.held_out, "mrad", gap.gap.yaw.windows)
    if gap.gap.in_slip is not None:
        slip = gap.gap.in_slip
        moved = f"{thousandths(slip.before)} → {thousandths(slip.after)} mm"
        yield "gap in slip, position", moved, f"{slip.windows} windows that the held-out gap leaves out"
    yield ("base model", gap.base, "what the log is compared with")
    yield (
        "contact modes",
        gap.modes.partition(":")[0],
        gap.modes.partition(":")[2] or "how they were obtained",
    )


def proof_facts(proof: Proof) -> Iterator[tuple[str, str, str]]:
    """The gap on another log before and after."""
    yield metric_fact("gap there, position", proof.gap.held_out, "mm", proof.gap.windows)
    yield metric_fact("gap there, yaw", proof.gap.yaw.held_out, "mrad", proof.gap.yaw.windows)


def metric_fact(name: str, held: HeldOut, unit: str, windows: int) -> tuple[str, str, str]:
    """A gap before and after in thousandths of its unit, and what noise alone would leave."""
    if held.before is None:
        return name, "–", "no held-out window"
    before, after, floor = map(thousandths, (held.before, held.after, held.floor))
    value = before if held.after == held.before else f"{before} → {after}"
    low, high = held.reduction_ci95
    less = (
        f"reduced by {100 * low:z.0f} to {100 * high:z.0f} %; "
        if low is not None and high is not None and held.after != held.before
        else ""
    )
    return name, f"{value} {unit}", f"{less}noise alone: {floor} {unit}; {windows} windows"


def effect_table(effects: tuple[Effect, ...]) -> str:
    """A line for each parameter: value, interval, significance."""
    rows = []
    for effect in effects:
        for k, (key, p) in enumerate(effect.parameters.items()):
            first = (effect.name, p_words(effect.p_value)) if k == 0 else ("", "")
            unit = "" if p.unit == "1" else p.unit
            rows.append((first[0], key, f"{figure(p.value)} {unit}".strip(), interval(p), first[1]))
    head = ("effect", "parameter", "value", "95 % interval", "p")
    return page.table(head, rows, numeric=(2, 3, 4))


def interval(p: Estimate) -> str:
    """The 95 % interval."""
    return f"{figure(p.ci95[0])} … {figure(p.ci95[1])}"


def p_words(p: float | None) -> str:
    """A probability."""
    if p is None:
        return "–"
    return f"< {SMALLEST_P:.0e}" if p < SMALLEST_P else f"{p:.2g}"


def quality(gap: GapFile) -> str:
    """Findings and notes."""
    found = page.finding_list([msgspec.to_builtins(one) for one in gap.findings])
    notes = "".join(f"<li>{page.escape(note)}</li>" for note in gap.notes)
    return (found or page.NOTHING_FOUND) + (f"<ul class=soft>{notes}</ul>" if notes else "")


def proof(gap: GapFile, traces: pl.DataFrame) -> list[list[Figure | None]]:
    """The scatter of each effect beside its residual over time; without an effect the residuals alone."""
    words = figures.residuals_of(gap)
    if not gap.effects:
        alone = [figures.residual_figure(one, traces, extended=False, residuals=words) for one in words]
        return [list(alone)]
    pairs = figures.shown_of(gap)
    scatters = [figures.scatter_figure(one, traces, words) for one in pairs]
    shown = dict.fromkeys(one.residual or "longitudinal" for one in pairs)
    others = [channel for channel in ("longitudinal", "yaw") if channel not in shown][: 2 - len(shown)]
    over_time = [
        figures.residual_figure(channel, traces, extended=True, residuals=words)
        for channel in (*shown, *others)
    ]
    return [scatters, list(over_time)]


def where_lead(gap: GapFile) -> str:
    """Where the disturbance lies, by channel."""
    if not gap.effects or not gap.where.channels:
        return ""
    factors = ", ".join(f"{name} ×{figure(q, 3)}" for name, q in gap.where.channels.items() if q is not None)
    return (
        f"Disturbance that the base model needs, over that of the extended model: {factors}."
        if factors
        else ""
    )


def where_table(gap: GapFile) -> str:
    """Stretches, places and regimes with the largest errors."""
    times = [(f"{i.start_s:.1f} … {i.end_s:.1f} s", share(i.share)) for i in gap.where.intervals]
    places = [
        (f"({r.x_m:.1f}, {r.y_m:.1f}) m ± {r.radius_m:.1f} m", share(r.share)) for r in gap.where.regions
    ]
    regimes = [
        (
            name,
            f"{figure(b.low)} … {figure(b.high)}",
            f"{b.seconds:.1f}",
            figure(b.longitudinal),
            figure(b.lateral),
            figure(b.yaw),
        )
        for name, bins in gap.where.regime.items()
        for b in bins
    ]
    parts = [
        page.table(("stretch", "share of the excess"), times, numeric=(1,)),
        page.table(("place", "share of the excess"), places, numeric=(1,)),
        page.paragraph("Mean squared prediction error by regime; 1 is what noise leaves.", "soft")
        if regimes
        else "",
        page.table(
            ("regime", "from … to", "seconds", "longitudinal", "lateral", "yaw"),
            regimes,
            numeric=(2, 3, 4, 5),
        ),
    ]
    return "".join(parts)


def share(value: float | None) -> str:
    """A share, or a dash."""
    return "–" if value is None else f"{value:.0%}"


def formulas_as_one(gap: GapFile) -> Iterator[Candidate]:
    """The candidates; terms of a formula that stand or fall together are one line."""
    terms = {name for one in gap.formulas for name in one.terms}
    together = Counter((one.stage, one.score) for one in gap.candidates if one.name in terms)
    said = set[tuple[int, float | None]]()
    for one in gap.candidates:
        key = (one.stage, one.score)
        if one.name not in terms or together[key] == 1:
            yield one
        elif key not in said:
            said.add(key)
            yield msgspec.structs.replace(one, name="the formula")


def candidate_tables(candidates: Sequence[Candidate]) -> Iterator[str]:
    """A table of bars for each stage, the best first."""
    for stage in sorted({one.stage for one in candidates}):
        ranked = [one for one in candidates if one.stage == stage][:MOST_CANDIDATES]
        most = max((one.score or 0.0 for one in ranked), default=0.0)
        title = "first effect" if stage == 0 else f"beside {stage} effect{'s' if stage > 1 else ''}"
        rows = "".join(candidate_row(one, most, best=k == 0) for k, one in enumerate(ranked))
        head = "<tr><th>candidate</th><th class=n>score</th><th></th><th class=n>p</th><th></th></tr>"
        inside = f"<thead>{head}</thead><tbody>{rows}</tbody>"
        made = f'<div class="scroll"><table class="scores">{inside}</table></div>'
        yield f"<h3>{page.escape(title)}</h3>{made}"


def candidate_row(one: Candidate, most: float, *, best: bool) -> str:
    """A candidate with its score as a bar."""
    width = 0.0 if one.score is None or most <= 0 else 100 * max(one.score, 0.0) / most
    colour = "#1f7a4d" if best and not one.failed else "#9aa1ac"
    bar = f'<div class="gauge"><i style="width:{width:.1f}%;background:{colour}"></i></div>'
    name = f"<b>{page.escape(one.name)}</b>" if best and not one.failed else page.escape(one.name)
    score = f"<td class=n>{figure(one.score)}</td><td>{bar}</td><td class=n>{p_words(one.p_value)}</td>"
    return f"<tr><td>{name}</td>{score}<td class=soft>{page.escape(one.failed)}</td></tr>"


def alternatives(sheet: page.Page, gap: GapFile) -> None:
    """What else explains the log, and the manoeuvre that would tell."""
    if not gap.effects:
        return
    sheet.section("Alternatives, and how to separate them")
    named = figures.named(gap)
    told = [one for one in gap.effects if one in named or one.alternatives or len(one.confound_class) > 1]
    for effect in told:
        sheet.add(f"<h3>{page.escape(effect.name)}</h3>", page.paragraph(f"By theory, {by_theory(effect)}."))
        rows = [(one.name, figure(one.delta_bic), one.separate_with or "–") for one in effect.alternatives]
        head = ("next best on this log", "worse by (ΔBIC)", "told apart by")
        sheet.add(page.table(head, rows, numeric=(1,)))
        if effect.separate_with:
            sheet.add(page.paragraph(f"To tell them apart: {effect.separate_with}"))
        if effect.alternatives and gap.base_model == "torque":
            pair = f"{effect.name},{effect.alternatives[0].name}"
            sheet.add(f"<p>A drive that tells: <code>{page.escape(gap_elsewhere.designing(pair))}</code></p>")
    if len(told) < len(gap.effects):
        sheet.add(
            "<h3>The formula</h3>", page.paragraph("By theory, no effect of the library moves as it does.")
        )


def by_theory(effect: Effect) -> str:
    """Which effects no motion tells from one."""
    same = [name for name in effect.confound_class if name != effect.name]
    return f"no motion tells it from {', '.join(same)}" if same else "no other effect gives the same motion"


def remains(sheet: page.Page, gap: GapFile) -> None:
    """What is left after the effects, and what the log could not have shown."""
    sheet.section("What remains")
    rows = [
        metric_row(name, metric, unit)
        for name, metric, unit in (("position", gap.gap, "mm"), ("yaw", gap.gap.yaw, "mrad"))
    ]
    head = (
        f"gap over {gap.gap.seconds} s",
        "fitted: before",
        "after",
        "held out: before",
        "after",
        "noise alone",
    )
    sheet.add(page.table(head, rows, numeric=range(1, 6)))
    if gap.remains is not None:
        sheet.add(page.paragraph(gap_elsewhere.still_left(gap.remains)))
    if gap.unnameable:
        sheet.add(
            page.paragraph(
                f"Not to be named from a base calibrated on this log: {', '.join(gap.unnameable)}."
            )
        )
    sizes = [
        (name, "–" if least.value is None else figure(least.value), "" if least.unit == "1" else least.unit)
        for name, least in gap.minimum_detectable.items()
    ]
    listed = page.table(("effect", "would have been seen from", "unit"), sizes, numeric=(1,))
    quiet = gap.verdict in ("nothing_missing", "not_enough_excitation")
    sheet.add(
        listed
        if quiet
        else page.details("The smallest size of each effect that this log would have shown", listed)
    )


def metric_row(name: str, metric: Gap | YawGap, unit: str) -> tuple[str, ...]:
    """Fitted and held-out gaps in thousandths of the unit."""
    train, held = metric.train, metric.held_out
    sizes = (train.before, train.after, held.before, held.after, held.floor)
    return (f"{name} [{unit}]", *(thousandths(size) for size in sizes))


def thousandths(size: float | None) -> str:
    """A length or an angle in mm or mrad, or a dash."""
    return figure(None if size is None else 1e3 * size, 3)
