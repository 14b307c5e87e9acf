"""What a log of poses and torques cannot tell apart, and the manoeuvre that would."""

EXACT: dict[frozenset[str], tuple[str, ...]] = {
    frozenset({"drive_gain"}): ("drive_gain", "wheel_radius", "wheel_inertia", "torque_constant"),
    frozenset({"yaw_inertia"}): ("yaw_inertia", "half_track"),
    frozenset({"payload", "yaw_inertia"}): ("payload", "yaw_inertia", "drive_gain"),
    frozenset({"payload", "drive_gain"}): ("payload", "yaw_inertia", "drive_gain"),
    frozenset({"yaw_inertia", "drive_gain"}): ("payload", "yaw_inertia", "drive_gain"),
    frozenset({"cornering_stiffness"}): ("cornering_stiffness", "epsilon", "lateral_mass"),
    frozenset({"input_delay"}): ("input_delay", "pose_clock_offset"),
    frozenset({"wheel_viscous"}): ("wheel_viscous", "back_emf"),
    frozenset({"viscous_drag", "yaw_damping"}): ("viscous_drag", "yaw_damping", "wheel_viscous", "back_emf"),
}
"""Effects that give the same poses whatever is driven; names outside the library are no candidates."""

_REVERSING = "drive the same stretch forwards and in reverse"
_HEADING = "drive the same profile in several headings"
_SPEEDS = "hold several speeds, slow to fast, each for some seconds"
_STEPS = "change the torque fast: steps or a chirp, several times a second"
_TURNING = "turn at several yaw rates at one speed, and at several speeds at one yaw rate"
_TWICE = "cross the same place a second time"
_SMALL = "drive gently, with torques near zero, and hard"
SEPARATED: tuple[tuple[frozenset[str], str], ...] = (
    (frozenset({"rolling_resistance", "torque_bias_common"}), _REVERSING),
    (frozenset({"rolling_resistance", "slope"}), _HEADING),
    (frozenset({"torque_bias_common", "slope"}), _HEADING),
    (frozenset({"rolling_resistance", "viscous_drag", "aerodynamic_drag"}), _SPEEDS),
    (frozenset({"wheel_coulomb", "wheel_viscous"}), _SPEEDS),
    (frozenset({"rolling_resistance", "wheel_coulomb"}), _TURNING),
    (frozenset({"viscous_drag", "wheel_viscous"}), _TURNING),
    (frozenset({"scrub_torque", "wheel_coulomb"}), _TURNING),
    (frozenset({"yaw_damping", "wheel_viscous"}), _TURNING),
    (frozenset({"scrub_torque", "yaw_damping"}), "turn slowly and fast, each for some seconds"),
    (frozenset({"actuator_lag", "input_delay"}), _STEPS),
    (frozenset({"com_offset", "yaw_damping"}), _TURNING),
    (frozenset({"pose_lever_arm", "undeclared_skid"}), _TURNING),
    (frozenset({"heading_misalignment", "yaw_drift"}), "drive for longer"),
    (frozenset({"heading_misalignment", "pose_lever_arm"}), "drive straight, then turn on the spot"),
    (frozenset({"low_friction_patch", "slip_interval"}), _TWICE),
    (frozenset({"load_step", "slip_interval"}), "go on driving for a while after the change"),
    (frozenset({"torque_deadzone", "torque_saturation", "drive_gain", "payload"}), _SMALL),
    (
        frozenset({"payload", "drive_gain", "yaw_inertia"}),
        "turn on the spot with hard torques, and go straight",
    ),
)


SKIDS = frozenset({"cornering_stiffness", "undeclared_skid"})
"""Where the identifier says the modes, it declares the skid, and the stiffness is what is left."""


def confound_class(names: tuple[str, ...], name: str, *, identified: bool = False) -> tuple[str, ...]:
    """Everything that cannot be told from ``name`` beside the other effects found, itself first."""
    found = {name} | (SKIDS if identified and name in SKIDS else frozenset())
    for members, whole in EXACT.items():
        if name in members and members <= set(names):
            found |= set(whole)
    return (name, *sorted(found - {name}))


def separate_with(name: str, alternatives: tuple[str, ...]) -> str:
    """The manoeuvres that tell ``name`` from the alternatives; empty where none is needed or known."""
    wanted = [
        manoeuvre
        for members, manoeuvre in SEPARATED
        if name in members and any(other in members for other in alternatives)
    ]
    return "; ".join(dict.fromkeys(wanted))
