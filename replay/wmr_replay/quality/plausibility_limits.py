"""From when on a comparison of signs and units means something, and the reason for each value."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PlausibilityLimits:
    """Factors between two signals are decimal logarithms (decades)."""

    least_votes: int = 10
    """Cells with clear motion before a factor counts: 5 s."""
    least_path_votes: int = 5
    """The same for yaw and path, of which there is one per half second of a turn: a single turn of 90°."""
    most_spread: float = 0.2
    """Interquartile range of a constant factor. Clean logs: below .06, at 1 mm as at 5 cm of noise."""
    most_path_spread: float = 0.8
    """The same of yaw over path. Yaw in degrees at 10 Hz turns by whole circles between two poses; its factor
    is wide, and far from 1 all the same, and takes ``least_votes`` in place of ``least_path_votes``.
    """
    most_exceptions: float = 0.1
    """Share of votes for the other sign."""
    least_t: float = 6.0
    """Of an answer to torques. Torques that fight a slope or a bump, and turns with speed: up to 4."""
    clear_t: float = 9.0
    """The same of a crossed answer that the other channel does not confirm: half as much again."""
    least_share_sign: float = 0.3
    """Of the acceleration's variance that an answer explains, for its sign. By chance and by turns: .2."""
    least_share_size: float = 0.4
    """The same for its size: slipping for half of the log leaves .4."""
    least_torque_s: float = 10.0
    """The regression has seen so much, a few changes of speed."""
    long_s: float = 60.0
    """A robot that has turned on no path by then turns on the spot; its yaw is taken for right."""
    speed: tuple[float, float] = (-0.2, 0.2)
    """Speed over wheel speed × radius: 1.6 either way. Tyres wear by a tenth, and a slip has to last for half
    of the log to count.
    """
    turn: tuple[float, float] = (-0.6, 0.22)
    """Yaw rate × half track over half the difference of the wheels. Wheels that scrub turn the robot by up to
    4 times less than the track says; none turns it more.
    """
    path: tuple[float, float] = (-0.5, 0.5)
    """Turning of the yaw over that of the path: drifts turn them apart, not 3 times."""
    torque: tuple[float, float] = (-1.2, 0.7)
    """Answer to the torques over the robot's α: slipping takes up to nine tenths, nothing makes it 5-fold."""
    tolerance: tuple[float, float, float, float, float] = (0.12, 0.3, 0.2, 0.7, 0.7)
    """How far speed, turn, path and both answers may be from what one fault predicts."""
    least_fault: float = 0.2
    """The least factor that a fault is blamed for: 1.6."""
    fast_mps: float = 60.0
    """A median speed of no wheeled robot: 216 km/h."""
    fast_mps2: float = 50.0
    """A median centripetal acceleration of no wheeled robot: 5 g."""
    barring_torque: float = 1.6
    """Torques 40 times too large: the model foresees accelerations that never come, and calls that slipping.
    The paper's robot, slipping throughout, answers 26 times less than its parameters say.
    """


LIMITS = PlausibilityLimits()
