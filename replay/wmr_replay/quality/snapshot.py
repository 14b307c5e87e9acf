"""The numbers from which a finding on signs or units is told."""

from dataclasses import dataclass

from wmr_replay.quality.judgement import Comparisons, Judgement
from wmr_replay.quality.signs import Torques, Wheels
from wmr_schemas.robot import RobotParameters


@dataclass(frozen=True)
class Snapshot:
    """The numbers after one cell, from which a finding is told. Unknown ones are NaN."""

    seconds: float
    fault: int
    size: float
    decades: tuple[float, ...]
    torques: Torques
    wheels: Wheels
    clockwise: bool
    alone: bool
    alpha: float
    alpha_t: float
    turn_t: float
    speed_mps: float
    robot: RobotParameters


def snapshot(c: Comparisons, judged: Judgement, k: int) -> Snapshot:
    """The numbers after cell ``k``."""
    response, told = c.response, judged.explained
    one_side = judged.torques[k] in (Torques.LEFT_REVERSED, Torques.RIGHT_REVERSED)
    ahead = response.ahead_by_difference if one_side else response.ahead_by_sum
    turn = response.turn_by_sum if one_side else response.turn_by_difference
    return Snapshot(
        seconds=float(response.n[k]),
        fault=int(told.fault[k]),
        size=float(told.size[k]),
        decades=tuple(float(d) for d in told.decades[:, k]),
        torques=Torques(judged.torques[k]),
        wheels=Wheels(judged.wheels[k]),
        clockwise=bool(judged.clockwise[k]),
        alone=bool(told.alone[k]),
        alpha=float(ahead.slope[k]),
        alpha_t=float(ahead.t[k]),
        turn_t=float(turn.t[k]),
        speed_mps=float(10 ** c.path.speed_mps.log10[k]),
        robot=c.robot,
    )
