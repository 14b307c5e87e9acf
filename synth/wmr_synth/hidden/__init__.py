"""The extended plant: the switched model with effects that the base model lacks.

Effects have forms of their own (``forms``), other than those of the candidates that a gap analysis tries;
with ``plain`` they have the candidates' form, and the plant simulates an extended model.
"""

from wmr_synth.hidden.disturbance import DEFAULT_DISTURBANCE, Disturbance
from wmr_synth.hidden.drawing import draw_effect
from wmr_synth.hidden.parse import parse_hide
from wmr_synth.hidden.registry import OwnForm, register_form, words_of
from wmr_synth.hidden.world import World, describe_effects

__all__ = [
    "DEFAULT_DISTURBANCE",
    "Disturbance",
    "OwnForm",
    "World",
    "describe_effects",
    "draw_effect",
    "parse_hide",
    "register_form",
    "words_of",
]
