"""What a calibrated base model cannot follow on its own calibration log, by effect.

One pass scores every effect of the library on the calibration log, beside the parameters that were fitted.
Its best size, and twice its standard deviation on top, is how much of it the base model leaves there: the
resistance of a caster, a creeping tyre. A rest of that size on another log of the robot is no finding. Of
effects that the log does not show, for want of excitation too, it is no more than is negligible in practice.

One log shows a rest on one drive: the same caster brakes otherwise on another. So the base model is held no
better than four fifths of what is negligible in practice. Beside an effect that matters, everything
negligible is a rest: a mechanism of the world acts on more channels than its effect does, and not quite in
its form. How a pose is mounted is no part of such a mechanism.
What turns the robot beside its torques, such as swivel casters and pads that drag, may turn it by far more
than is negligible, and twice as much on another drive.
"""

from collections.abc import Mapping

import numpy as np

from wmr_replay.gap.estimation.calibrate import SWIVELS
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.scan import scan
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.effects import UNNAMED_PREFIX, WITHHOLDING, built_in, effects_of
from wmr_schemas.model_file import Model
from wmr_schemas.terms import COEFFICIENT, parse_term

IN_PARAMETERS = ("payload", "yaw_inertia", "drive_gain")
"""What a calibration takes into α and α_yaw."""
OF_THE_DRIVES = ("actuator_lag", "input_delay", "torque_deadzone", "torque_saturation")
"""What motors and their drivers do to every torque; a base model holds it."""
IN_TURNING = ("yaw_inertia", "yaw_damping")
"""How a robot answers a turning torque, and what brakes its turns: a base model may leave much of both."""
TURNING = ("yaw_damping", "com_offset", "scrub_torque")
"""Effects that resist or help a turn in proportion to the yaw rate, or by its sign."""
LOADED = "load_step"
TURNING_TORQUE = "torque_bias_differential"
"""A torque that turns the robot: α_yaw says what it accelerates."""
ONE_WAY = ("torque_imbalance", TURNING_TORQUE)
"""Torques that turn a robot one way."""


def misfit_of(problem: Problem, fit: Fit) -> dict[str, float]:
    """Sizes by effect, of those that act always and have no grid; two components by their length."""
    own, scanned = problem.settings.misfit, scan(problem, fit.extension, fit.noise, fit.psi)
    found: dict[str, float] = {}
    for one in scanned.scored:
        information = scanned.unit_information.get(one.name, (0.0, 0.0))[1]
        if one.name in IN_PARAMETERS or not may_be_rest(one.name) or not information > 0:
            continue
        size, open_to = size_of(one.name, one.parameters), own.in_sd / float(np.sqrt(information))
        unseen = size <= open_to
        most = negligible(one.name, fit.extension, own) if unseen else np.inf
        found[one.name] = min(size + open_to, most)
    return found


def may_be_rest(name: str) -> bool:
    """Whether an effect of the library acts always and in proportion to its parameters."""
    candidate = candidate_of(name)
    declaration = candidate.declaration
    lasting = declaration.extent == "always" and declaration.zero_is_absent
    return lasting and not candidate.grid and declaration in built_in("torque")


def with_parameters(
    misfit: Mapping[str, float], model: Model, ratios: tuple[float, float], own: MisfitSettings
) -> dict[str, float]:
    """The misfit with that of the calibrated parameters: what their standard deviations leave open, what a
    controller hides, and of α_yaw what casters that carry load leave. What is hidden of α_yaw counts twice on
    another drive (:func:`floor_of`), that of α here.
    """
    robot, found = model.robot, dict(misfit)
    for key, value, names, times in (
        ("alpha", robot.alpha, ("payload", "drive_gain"), own.other_drives),
        ("alpha_yaw", robot.alpha_yaw, ("yaw_inertia",), 1.0),
    ):
        if value:
            open_to = own.in_sd * model.robot_sd.get(key, 0.0) / value
            found |= {name: open_to + times * hidden_by_answer(ratios, name, own) for name in names}
    if on_loaded_casters(model, own):
        found["yaw_inertia"] = max(found.get("yaw_inertia", 0.0), own.on_casters)
    return found


def on_loaded_casters(model: Model, own: MisfitSettings) -> bool:
    """Whether the calibration found casters that hold the robot in its curve, or something that pushes it
    about as casters do while they swing.
    """
    held_mps2 = sum(effect.parameters["s0_mps2"] for effect in model.effects if effect.name == SWIVELS)
    pushes = model.noise.swing_yaw_mps2_rthz or 0.0, model.noise.disturbance_yaw_mps2_rthz or 0.0
    return held_mps2 >= own.least_swivels_mps2 or float(np.hypot(*pushes)) >= own.least_swings_mps2_rthz


def hidden_by_answer(ratios: tuple[float, float], name: str, own: MisfitSettings) -> float:
    """The share of α, of ``yaw_inertia`` that of α_yaw, that torques which answer the disturbance hide.

    ``ratios`` are the standard deviations of what the torques ask for, ahead and in yaw, over the
    disturbance's. With u = r + w and α w = −n, efforts that answer the disturbance n, least squares of
    α u + n on u are off by −var(n)/var(α u), 1/ratio² of α. Torques that never vary show nothing of it, for
    which ``own.most_open`` stands.
    """
    ratio = ratios[name == "yaw_inertia"]
    return min(1 / ratio**2, own.most_open) if ratio > 0 else own.most_open


def is_rest(name: str, extension: Extension, own: MisfitSettings) -> bool:
    """Whether a fitted effect is no larger than what the base model leaves on its calibration log; of a
    weight put on meanwhile, than what it leaves of a payload.
    """
    sizes = extension.effects[name]
    if name == LOADED:
        name, sizes, extension = "payload", {"mass_ratio": sizes["mass_ratio"]}, extension.without(name)
    least = floor_of(name, extension, own)
    return least > 0 and size_of(name, sizes) <= least


def is_slight_term(name: str, extension: Extension, binned: BinnedLog, own: MisfitSettings) -> bool:
    """Whether ``name`` is a term that accelerates the robot of a calibrated base model by no more than is
    negligible, root mean square: swinging casters and tyres leave as much, in another form on each drive.
    """
    if not extension.misfit or not name.startswith(UNNAMED_PREFIX):
        return False
    total = extension.effects[name][COEFFICIENT] * parse_term(name).evaluate(columns_of(binned))
    return bool(np.sqrt(np.mean(total * total)) <= own.negligible_mps2)


def gain_as_inertia(extension: Extension) -> Extension:
    """A drive gain g beside a payload p as what is exactly the same: the payload (1 + p)/(1 + g) − 1 and the
    yaw inertia 1/(1 + g) − 1; the extension where it has not both.

    Beside a payload, a gain says of turning alone.
    """
    if not {"drive_gain", "payload"} <= extension.effects.keys():
        return extension
    gain = 1 + extension.effects["drive_gain"]["ratio"]
    load = {"mass_ratio": (1 + extension.effects["payload"]["mass_ratio"]) / gain - 1}
    inertia = {"ratio": 1 / gain - 1}
    return extension.without("drive_gain").with_effect("payload", load).with_effect("yaw_inertia", inertia)


def gain_is_rest(extension: Extension, own: MisfitSettings) -> bool:
    """Whether a drive gain beside a payload says no more of turning than the base model leaves."""
    same = gain_as_inertia(extension)
    return same is not extension and is_rest("yaw_inertia", same, own)


def withholds_a_rest(name: str, problem: Problem, extension: Extension, own: MisfitSettings) -> bool:
    """Whether a dead zone or a saturation holds back no larger share of the log's torques than the base
    model's gain may be off by on it: half of its rest, or twice what the calibration leaves.

    The share is 1 − k, with k the gain of least squares from the torques as asked for to those that act.
    """
    if name not in WITHHOLDING:
        return False
    asked = extension.without(name).mean_torques(problem.binned)
    acting = extension.mean_torques(problem.binned)
    power = float(np.sum(asked * asked))
    floor = floor_of("drive_gain", extension.without(name), own)
    left = left_on_other_drives("drive_gain", extension.without(name), own)
    known_to = max(floor / own.other_drives, left)
    return power - float(np.sum(asked * acting)) <= known_to * power


def size_of(name: str, parameters: Mapping[str, float]) -> float:
    """The size of an effect or a term."""
    return candidate_of(name).size_of(parameters)


def floor_of(name: str, extension: Extension, own: MisfitSettings) -> float:
    """Largest size of an effect that is a rest; 0 where every size is a finding, as where the base model's
    misfit is not known.
    """
    declaration = effects_of("torque").get(name)
    if not extension.misfit or declaration is None:
        return 0.0
    if declaration.extent != "always" or not declaration.zero_is_absent:
        return 0.0
    small, left = negligible(name, extension, own), extension.misfit.get(name, 0.0)
    if name in IN_TURNING:
        left *= own.other_drives
    if not finds_what_matters(extension, own, but=name):
        return max(left, own.least_share * small)
    spills = name in extension.misfit and declaration.acts_on != "pose"
    return max(left, own.beside * small if spills else small)


def finds_what_matters(extension: Extension, own: MisfitSettings, *, but: str = "") -> bool:
    """Whether an effect of the extension, but for one of them, is more than negligible."""
    found = ((name, sizes) for name, sizes in extension.effects.items() if name != but)
    return any(size_of(name, sizes) > negligible(name, extension, own) for name, sizes in found)


def misfit_beside(extension: Extension, misfit: Mapping[str, float], own: MisfitSettings) -> dict[str, float]:
    """The ``misfit`` of a base model that takes in the effects of the extension: what is a rest beside one
    that matters stays a rest on other logs. Of what may be twice as large there (:func:`floor_of`), half of
    that: α_yaw is known no worse for it.
    """
    if not finds_what_matters(extension, own):
        return dict(misfit)
    times = dict.fromkeys(IN_TURNING, own.beside / own.other_drives)
    least = {name: times.get(name, own.beside) * negligible(name, extension, own) for name in misfit}
    return {name: max(left, least[name]) for name, left in misfit.items()}


def surely_left(name: str, extension: Extension, own: MisfitSettings) -> float:
    """Size that an effect must exceed by its standard deviations: what the base model leaves on other drives.

    Where something else turns the robot, no less than what is negligible, of an effect that turns it no less
    than a rest beside an effect that matters, of what brakes its turns several times what the calibration log
    leaves, and of a yaw inertia some times what it leaves of α_yaw.
    """
    least = left_on_other_drives(name, extension, own)
    if least <= 0 or not turning_is_unknown(extension.misfit, own):
        return least
    if name in IN_TURNING:
        times = own.unknown_inertia if name == "yaw_inertia" else own.unknown_turning
        return times * extension.misfit.get(name, np.inf)
    if effects_of("torque")[name].acts_on == "pose":
        return least
    return max(
        least, (own.beside if name in (*TURNING, *ONE_WAY) else 1.0) * negligible(name, extension, own)
    )


def left_on_other_drives(name: str, extension: Extension, own: MisfitSettings) -> float:
    """What the base model leaves of an effect on other drives; of one that its calibration log does not
    measure, its floor. Of a yaw inertia, what it left on its own: more of that is what the torques of another
    drive hide (:func:`hidden_by_answer`).
    """
    floor = floor_of(name, extension, own)
    if name not in extension.misfit:
        return floor
    times = 1.0 if name == "yaw_inertia" else own.other_drives
    return min(floor, times * extension.misfit[name])


def turning_is_unknown(misfit: Mapping[str, float], own: MisfitSettings) -> bool:
    """Whether the calibration log does not show α_yaw to within what is negligible of a yaw inertia:
    something else turns the robot, too, such as casters that swing round or pads that drag.
    """
    relevant = effects_of("torque")["yaw_inertia"].relevant
    return relevant is not None and misfit.get("yaw_inertia", 0.0) > own.negligible_share * relevant


def negligible(name: str, extension: Extension, own: MisfitSettings) -> float:
    """The size below which an effect does not matter in practice; 0 where none is known."""
    declaration = effects_of("torque").get(name)
    if declaration is None:
        return 0.0
    if declaration.relevant is not None:
        return own.negligible_share * declaration.relevant
    turns = name == TURNING_TORQUE
    half_torque = 1 / (2 * (extension.base.alpha_yaw if turns else extension.base.alpha))
    sizes: Mapping[str, float] = {
        "m/s²": own.negligible_mps2,
        "N·m": own.negligible_mps2 * half_torque,
        "N·m/(rad/s)": own.negligible_per_s * half_torque * extension.wheel_radius_m,
        "m": own.negligible_m,
    }
    return sizes.get(next(iter(declaration.units.values())), 0.0)
