"""How far a model simulated forward runs from the measured path, in windows from fitted starts."""

import numpy as np

from loop.pair import Pair
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.path_error import window_errors, windows_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.model_file import Model

WINDOWS_S = (4.0, 10.0)


def path_errors(pair: Pair, model: Model) -> dict[str, float]:
    """Median over the other log's windows of the root mean square distance in m, under the true modes."""
    if pair.modes is None:
        return {}
    binned = bin_log(pair.other, GateSettings(), pair.modes)
    extension = base_model(pair.other, model, GapOptions()).extension
    found = {}
    for seconds in WINDOWS_S:
        windows = windows_of(binned, np.ones(len(binned), bool), seconds)
        found[f"{seconds:g}"] = float(np.median(window_errors(binned, extension, windows).position_m))
    return found
