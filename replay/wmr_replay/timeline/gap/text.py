"""The text panel of a gap recording: the verdict, the effects as a table, how to read the rest."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from wmr_replay.timeline.description import findings_text
from wmr_schemas.text import markdown

if TYPE_CHECKING:
    from wmr_replay.gap.result.result import FoundEffect, GapMetric, GapResult

HOW_TO_READ = """\
**Path**: as measured, in the colour of the position's error (key above it; grey: not simulated). White \
vectors: the largest error of each window, from the measured to the simulated position, magnified {factor:g} \
times. Above with the base model, below with the extended one, in the same colours and scale. Simulated from \
the log's own {inputs} over windows of {seconds} s, each from its own fitted start. Broad grey beneath: \
held out. \
Yellow circles: where most of the gap lies.

**Gap**: measured minus simulated. **Speed**: along the heading, mean over {speed_s:g} s. **Residual**: the \
{residual} that a model leaves unexplained{filtered}. Base model red, extended model blue.
"""


def how_to_read(result: "GapResult", factor: float, speed_s: float) -> str:
    """The explanation of a recording."""
    torque = result.base_model == "torque"
    return HOW_TO_READ.format(
        factor=factor,
        speed_s=speed_s,
        inputs="torques" if torque else "wheel speeds",
        seconds=result.position.metric.rpartition("_")[2].removesuffix("s"),
        residual="acceleration (sideways: the velocity)" if torque else "slip velocity",
        filtered=", as a filter sees it" if torque else ", over a second",
    )


def gap_text(result: "GapResult", log_name: str, findings: Sequence[Mapping[str, Any]] = ()) -> str:
    """Markdown for the text panel."""
    blocks = [f"**{markdown(result.sentence.strip())}**"]
    if result.effects:
        head = "| effect | parameter | 95 % interval |\n| --- | --- | --- |"
        blocks.append("\n".join([head, *(row for effect in result.effects for row in effect_rows(effect))]))
    rows = (gap_row("position", result.position, "mm"), gap_row("yaw", result.yaw, "mrad"))
    head = "| held-out gap | before | after | floor |\n| --- | --- | --- | --- |"
    blocks.append("\n".join([head, *rows]))
    blocks += [findings_text(findings), f"Log: {markdown(log_name)}"]
    return "\n\n".join(block for block in blocks if block)


def effect_rows(effect: "FoundEffect") -> list[str]:
    """One line for each parameter."""
    return [
        f"| {markdown(effect.name) if k == 0 else ''} | {markdown(key)} = {p.value:.4g} {unit(p.unit)} "
        f"| {p.ci95[0]:.4g} … {p.ci95[1]:.4g} |"
        for k, (key, p) in enumerate(effect.parameters.items())
    ]


def gap_row(name: str, gap: "GapMetric", shown_unit: str) -> str:
    """The held-out gap in thousandths of its unit."""
    held = gap.held_out
    shown = " | ".join(f"{1e3 * value:.3g} {shown_unit}" for value in (held.before, held.after, held.floor))
    return f"| {name} | {shown} |"


def unit(text: str) -> str:
    """The unit behind a number; a ratio has none."""
    return "" if text == "1" else text
