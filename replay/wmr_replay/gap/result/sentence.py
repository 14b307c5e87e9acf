"""The verdict in one sentence."""

from wmr_replay.gap.result.formulas import is_term, short_text_of
from wmr_replay.gap.result.result import FoundEffect, Verdict
from wmr_replay.gap.settings.result import ReportSettings


def sentence_of(
    verdict: Verdict, effects: tuple[FoundEffect, ...], notes: tuple[str, ...], settings: ReportSettings
) -> str:
    """The verdict with the effects and their sizes, or with the notes; a long formula is cut short."""
    parts = [described(effect) for effect in effects if not is_term(effect)]
    formula = short_text_of(effects, settings)
    said = " and ".join([*parts, formula] if formula else parts)
    if parts and formula:
        said += ", for which the library has no name"
    if verdict == "named":
        return f"The model lacks {said}."
    if verdict == "ambiguous":
        return f"The model lacks {said}, or what looks the same on this log: {'; '.join(notes)}."
    if verdict == "unnamed" and not effects:
        return f"Something is missing that no effect of the library explains: {'; '.join(notes)}."
    if verdict == "unnamed":
        unknown = "; " + "; ".join(notes) if notes else ", for which the library has no name"
        return f"The model lacks {said}{'' if parts else unknown}."
    if verdict == "not_enough_excitation":
        return f"This log cannot tell: {'; '.join(notes)}."
    return "Nothing is missing that this log could show."


def described(effect: FoundEffect) -> str:
    """An effect with its parameters, units and intervals."""
    parts = []
    for key, p in effect.parameters.items():
        unit = f" {p.unit}" if p.unit not in ("", "1") else ""
        parts.append(f"{key} {p.value:.3g}{unit} ({p.ci95[0]:.3g} to {p.ci95[1]:.3g})")
    return f"{effect.name} ({', '.join(parts)})" if parts else effect.name
