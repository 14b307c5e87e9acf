"""One log on both bases: what each says, and what the two say together.

Torques show what lies between a torque and the motion, wheel speeds what lies between the wheels and the
motion. An effect on each side may be one cause: a wheel radius is a drive gain on torques and a wheel scale
on wheel speeds. The confound classes of the catalogue hold the cause that the two have in common.
"""

from dataclasses import replace

import msgspec

from wmr_replay.jobs.gap import GapRun
from wmr_schemas.effects import EFFECTS
from wmr_schemas.gap_file import Bases, Effect, GapFile, OnBase, SameCause

NOTHING = "nothing_missing"
BETWEEN = {
    "torque": "between the torques and the motion of the wheels: the wheels roll as the model says",
    "wheel_speed": "between the wheels and the ground: the torques move the robot as the model says",
}
"""Where a thing is missing that one base alone sees."""


def with_both(torque: GapRun, wheels: GapRun) -> tuple[GapRun, GapRun]:
    """Both runs, each of whose documents says what the two say together."""
    both = bases_of(torque.document, wheels.document)
    first, second = (msgspec.structs.replace(run.document, bases=both) for run in (torque, wheels))
    return replace(torque, document=first), replace(wheels, document=second)


def bases_of(torque: GapFile, wheels: GapFile) -> Bases:
    """What the analyses on torques and on wheel speeds say together."""
    same = tuple(
        cause
        for one in torque.effects
        for other in wheels.effects
        if (cause := same_cause(one, other)) is not None
    )
    apart = disputed(torque, wheels, same) + disputed(wheels, torque, same)
    return Bases(
        torque=on_base(torque),
        wheel_speed=on_base(wheels),
        same=same,
        disputed=apart,
        sentence=sentence_of(torque, wheels, same, apart),
    )


def on_base(gap: GapFile) -> OnBase:
    """The answer on one base."""
    return OnBase(gap.verdict, tuple(effect.name for effect in gap.effects), gap.sentence)


def same_cause(torque: Effect, wheels: Effect) -> SameCause | None:
    """The cause that two effects have in common; None where they are different things."""
    if torque.name == wheels.name:
        return SameCause(torque.name, wheels.name, torque.name, intervals_meet(torque, wheels))
    common = sorted(set(torque.confound_class) & set(wheels.confound_class))
    return SameCause(torque.name, wheels.name, common[0], None) if common else None


def intervals_meet(one: Effect, other: Effect) -> bool:
    """Whether the intervals of every parameter overlap."""
    spans = [(one.parameters[key].ci95, p.ci95) for key, p in other.parameters.items()]
    known = [(a, b) for a, b in spans if None not in (*a, *b)]
    return all(a[0] <= b[1] and b[0] <= a[1] for a, b in known)  # type: ignore[operator]


def disputed(gap: GapFile, other: GapFile, same: tuple[SameCause, ...]) -> tuple[str, ...]:
    """Effects that both bases have, that one names, and that the other would have seen and does not name."""
    shared = {
        name for name, effect in EFFECTS.items() if len(effect.models) > 1 and not effect.needs_commands
    }
    explained = {name for cause in same for name in (cause.torque, cause.wheel_speed)}
    return tuple(
        effect.name
        for effect in gap.effects
        if effect.name in shared - explained and would_be_seen(effect, other)
    )


def would_be_seen(effect: Effect, other: GapFile) -> bool:
    """Whether the other analysis would have shown an effect of this size."""
    least = other.minimum_detectable.get(effect.name)
    size = next(iter(effect.parameters.values())).value
    return least is not None and least.value is not None and size is not None and abs(size) > least.value


def sentence_of(torque: GapFile, wheels: GapFile, same: tuple[SameCause, ...], apart: tuple[str, ...]) -> str:
    """Both answers in a sentence or two."""
    said = [f"{c.torque} on torques and {c.wheel_speed} on wheel speeds may be one {c.cause}" for c in same]
    said = [agreed(c) if c.torque == c.wheel_speed else text for c, text in zip(same, said, strict=True)]
    said += [f"only one of the two bases names {name}, which the other would have seen" for name in apart]
    if said:
        return "; ".join(said)[:1].upper() + "; ".join(said)[1:] + "."
    for one, other in ((torque, wheels), (wheels, torque)):
        if one.effects and other.verdict == NOTHING:
            return f"What is missing lies {BETWEEN[one.base_model]}."
    if torque.verdict == wheels.verdict == NOTHING:
        return "Neither torques nor wheel speeds show that anything is missing."
    if torque.effects and wheels.effects:
        return "Different things are missing on the two sides of the wheels."
    return "One of the two bases gives no answer that the other could be compared with."


def agreed(cause: SameCause) -> str:
    """An effect that both bases name."""
    sizes = "with sizes that agree" if cause.sizes_agree else "with sizes that differ"
    return f"both bases name {cause.cause}, {sizes}"
