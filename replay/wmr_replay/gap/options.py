"""The options of a gap analysis."""

from dataclasses import dataclass, field

from wmr_replay.gap.settings import GateSettings
from wmr_schemas.errors import InvalidSetting

MOST_EFFECTS = 12
MODE_SOURCES = ("identified", "ideal", "given")


@dataclass(frozen=True)
class GapOptions:
    """What a user decides.

    ``modes``: from the identifier, ideal throughout, or as the log's mode track gives them. An effect counts
    when it moves the simulated path by more than ``tolerance_m`` over ``tolerance_s``. Up to ``max_effects``
    are looked for. ``seed`` draws the placebo logs and the bootstrap. ``gates`` holds every threshold.
    Raises InvalidSetting for a value out of its range.
    """

    modes: str = "identified"
    tolerance_m: float = 0.003
    tolerance_s: float = 4.0
    max_effects: int = 3
    seed: int = 0
    gates: GateSettings = field(default_factory=GateSettings)

    def __post_init__(self) -> None:
        if self.modes not in MODE_SOURCES:
            raise InvalidSetting(f"modes are one of {', '.join(MODE_SOURCES)}, not {self.modes!r}")
        if not self.tolerance_m >= 0:
            raise InvalidSetting(f"the tolerance must not be below 0 m, not {self.tolerance_m:g} m")
        if not 1 <= self.tolerance_s <= 8:
            raise InvalidSetting(f"the tolerance is over 1 to 8 s, not {self.tolerance_s:g} s")
        if not 1 <= self.max_effects <= MOST_EFFECTS:
            raise InvalidSetting(f"one to {MOST_EFFECTS} effects are looked for, not {self.max_effects}")
