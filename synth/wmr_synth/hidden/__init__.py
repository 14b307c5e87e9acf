"""The extended plant: the switched model with effects that the base model does not know, and their sizes.

Effects stand in forms of their own (``forms``), other than those of the candidates that a gap analysis tries;
with ``plain`` they stand in the candidates' form, and the plant is then an extended model as a simulator.
"""

from wmr_synth.hidden.disturbance import DEFAULT_DISTURBANCE, Disturbance
from wmr_synth.hidden.parse import parse_hide
from wmr_synth.hidden.sizes import SIZES, draw_effect
from wmr_synth.hidden.world import World, describe_effects

__all__ = [
    "DEFAULT_DISTURBANCE",
    "SIZES",
    "Disturbance",
    "World",
    "describe_effects",
    "draw_effect",
    "parse_hide",
]
