"""The forms in which effects act, hidden and plain, one function each; plain is the candidates' form.

Robot conventions; speeds in m/s, torques in N·m, accelerations in m/s².
"""

import math

from wmr_schemas.compiled import compiled

SOFT_SIGN_MPS = 0.02
"""Plain friction changes its sign over this speed, as tanh(v/.02)."""
SHARP_SIGN_MPS = 0.005
"""Hidden friction changes its sign over this speed, as v/√(v² + .005²)."""
CASTER_MPS, PLAIN_CASTER_MPS, CASTER_MPS2 = 0.02, 0.05, 0.002
"""Least speeds at which casters have a direction, and least change of it that they oppose in full."""
STRIBECK_EXCESS, STRIBECK_MPS = 0.25, 0.15
DRAG_EXPONENT = 1.9
SATURATION_SHARPNESS = 6.0
BUMP_SHARE, BUMP_LENGTH_M = 0.25, 3.0
LOADING_S = 2.0
SLIP_EDGE_S = 0.2
PATCH_EDGE_M = 0.1


@compiled
def sign(speed: float, plain: bool) -> float:
    """Sgn of a friction: v/√(v² + s²), s = .005 m/s; plain tanh(v/.02 m/s)."""
    if plain:
        return math.tanh(speed / SOFT_SIGN_MPS)
    return speed / math.sqrt(speed**2 + SHARP_SIGN_MPS**2)


@compiled
def swivel(s0: float, moving: tuple[float, float], freely: tuple[float, float], plain: bool) -> float:
    """What casters take of the acceleration in yaw: (v, turn) moves in a direction, which it would turn by
    q = |(v, turn)| d(direction)/dt; they keep it up to Q = s₀ cos², s₀ cos q/√(q² + Q²); plain with fourth
    powers and roots, in a speed of at least .05 m/s.
    """
    speed = math.sqrt(moving[0] ** 2 + moving[1] ** 2 + PLAIN_CASTER_MPS**2)
    if not plain:
        speed = math.hypot(moving[0], moving[1])
        if speed < CASTER_MPS:
            return 0.0
    cos, sin = moving[0] / speed, moving[1] / speed
    q, most = cos * freely[1] - sin * freely[0], s0 * cos * cos + CASTER_MPS2
    if plain:
        return s0 * cos * q / math.sqrt(math.sqrt(q * q * q * q + most * most * most * most))
    return s0 * cos * q / math.sqrt(q * q + most * most)


@compiled
def trailing(v: float, turn: float, plain: bool) -> tuple[float, float]:
    """Direction of the way of a support that drags, (v, turn)/√(v² + turn² + s²), s = .005 m/s; plain .02."""
    soft = SOFT_SIGN_MPS if plain else SHARP_SIGN_MPS
    speed = math.sqrt(v**2 + turn**2 + soft**2)
    return v / speed, turn / speed


@compiled
def rolling(c0: float, v: float, plain: bool) -> float:
    """−c₀ sgn(v) (1 + .25 exp(−(v/.15)²)), Stribeck's; plain without the bracket."""
    if c0 == 0.0:
        return 0.0
    excess = 0.0 if plain else STRIBECK_EXCESS * math.exp(-((v / STRIBECK_MPS) ** 2))
    return -c0 * (1.0 + excess) * sign(v, plain)


@compiled
def drag(c2: float, v: float, plain: bool) -> float:
    """−c₂ sgn(v) |v|^1.9, equal to the plain −c₂ v|v| at 1 m/s."""
    if c2 == 0.0:
        return 0.0
    return -c2 * v * (abs(v) if plain else abs(v) ** (DRAG_EXPONENT - 1.0))


@compiled
def drag_around(e2: float, v: float, turn: float, plain: bool) -> float:
    """−e₂ turn V^.9, V² = v² + turn², equal to the plain −e₂ turn V at 1 m/s."""
    if e2 == 0.0:
        return 0.0
    speed = math.hypot(v, turn)
    return -e2 * turn * (speed if plain else speed ** (DRAG_EXPONENT - 1.0))


@compiled
def dead_zone(u: float, threshold: float, plain: bool) -> float:
    """U − δ tanh(u/δ), which tends to the plain sgn(u)·max(|u| − δ, 0)."""
    if threshold == 0.0:
        return u
    if plain:
        return math.copysign(max(abs(u) - threshold, 0.0), u)
    return u - threshold * math.tanh(u / threshold)


@compiled
def saturation(u: float, limit: float, plain: bool) -> float:
    """U/(1 + (|u|/L)⁶)^(1/6); plain clip(u, −L, L)."""
    if limit == math.inf:
        return u
    if plain:
        return max(-limit, min(limit, u))
    return float(u / (1.0 + (abs(u) / limit) ** SATURATION_SHARPNESS) ** (1.0 / SATURATION_SHARPNESS))


@compiled
def slope(grade_x: float, grade_y: float, x: float, y: float, plain: bool) -> tuple[float, float]:
    """Downhill acceleration (world x, y): the mean grade g, and bumps of .25 |g| over 3 m; plain g alone.

    The bumps b_x = .25|g| sin(2π x/3 + .7), b_y = .25|g| sin(2π y/3 + 2.1) are the gradient of a surface.
    """
    if plain:
        return grade_x, grade_y
    bump = BUMP_SHARE * math.sqrt(grade_x**2 + grade_y**2)
    wave = 2.0 * math.pi / BUMP_LENGTH_M
    return grade_x + bump * math.sin(wave * x + 0.7), grade_y + bump * math.sin(wave * y + 2.1)


@compiled
def load(mass_ratio: float, t0: float, t: float, plain: bool) -> float:
    """The ratio grows linearly from t₀ − 1 s to t₀ + 1 s; plain at once at t₀."""
    if plain:
        return mass_ratio if t >= t0 else 0.0
    return mass_ratio * min(1.0, max(0.0, (t - t0) / LOADING_S + 0.5))


@compiled
def interval(loss: float, start: float, end: float, t: float, plain: bool) -> float:
    """The loss within [start, end], with edges of .2 s centred on both; plain without."""
    if plain:
        return loss if start <= t < end else 0.0
    rising = min(1.0, max(0.0, (t - start) / SLIP_EDGE_S + 0.5))
    return loss * (rising - min(1.0, max(0.0, (t - end) / SLIP_EDGE_S + 0.5)))


@compiled
def patch(loss: float, radius: float, distance: float, plain: bool) -> float:
    """The loss within the radius, with an edge loss/2 · (1 − tanh((d − R)/.1 m)); plain without an edge."""
    if plain:
        return loss if distance < radius else 0.0
    return loss * 0.5 * (1.0 - math.tanh((distance - radius) / PATCH_EDGE_M))
