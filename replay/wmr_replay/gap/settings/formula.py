"""Settings of formulas: what is missing outside of the library, as a sum of terms of a dictionary."""

from dataclasses import dataclass

Shares = tuple[tuple[str, tuple[float, ...]], ...]
"""Shapes, each with the numbers with which it is tried, in root mean squares of their quantity."""


@dataclass(frozen=True)
class FormulaSettings:
    """Which terms are tried, and what each and the formula must prove. Units of deviance."""

    something_left: float = 2.0
    """From this ratio of the disturbance's density to a calm one's on, a formula is looked for. As
    ``SelectionSettings.something_left``."""

    most_groups: int = 5
    """Most groups of terms in a formula; a wave's sine and cosine are one group. Judgement: five numbers
    describe a curve to a few per cent, and a longer formula is not read."""

    margin: float = 10.0
    """What a group must explain beyond its price. Statistics: "very strong" after Kass and Raftery (1995)."""

    first_margin: float = 20.0
    """The same for the first group, for which the whole dictionary was searched. Statistics: twice that,
    since a formula says that the library is not enough."""

    placed_margin: float = 30.0
    """The same for a place, a heading or a time in which alone what is found holds. As ``beyond_margin``:
    what is found without one is the better known."""

    most_of_a_row: float = 5.0
    """Most that one held-out row says for or against a formula, in −2 log likelihood. Statistics: "positive"
    and not "strong" evidence after Kass and Raftery (1995), since neighbours say the same."""

    as_good: float = 2.0
    """A group that explains less than the best by no more than this is as good: that of the fewest quantities
    is taken. So is a formula that holds the robot back, in place of one that pushes. Statistics: "not worth
    more than a bare mention" after Kass and Raftery (1995)."""

    steepest_mps2: float = 3.0
    """Largest acceleration by a place. Physics: a slope of 18°; what seems steeper is a slip."""

    most_cancelling: float = 10.0
    """Largest root mean square of a term, in those of all terms together. Judgement: of larger ones a tenth
    is left, and a change of a few per cent in either turns the curve about."""

    most_of_one_pass: float = 0.75
    """Largest share of what efforts do at a place, in squares, in one pass of it, where an identifier says
    the modes. Judgement: a second pass shows a third as much."""

    seen_of_a_pass: float = 0.01
    """Share of the largest square from which on a pass is one. Numerics: a tenth of the term."""

    between_passes_s: float = 2.0
    """Least time between two passes, s. Judgement: efforts change their sign within a pass, for less."""

    hardly_pushes: float = 0.05
    """Share of a drag that swings, which may push. Statistics: one in twenty."""

    beyond_library: float = 0.15
    """Share of the library's gain by which a formula must exceed it to take the place of a named effect.
    As ``SelectionSettings.remainder_share``: the wrong form of an effect leaves as much."""

    beyond_margin: float = 30.0
    """Least excess beside named effects. As ``SelectionSettings.margin_identified``."""

    shown_share: float = 0.5
    """What manoeuvres must gain a row by efforts that may answer a disturbance, a share of what all rows do.
    Statistics: of what is there, as many manoeuvres gain less than the mean as more."""

    most_change: float = 2.0
    """Most by which a formula may change the size of a named effect beside it, a factor. Judgement."""

    least_mps2: float = 0.03
    """Least root mean square of a formula's acceleration, m/s². As ``MisfitSettings.negligible_mps2``."""

    least_length_m: float = 1.5
    """Shortest wave, m. Physics: at 1.5 m/s a wave of 1.5 m passes in a second, 25 bins."""

    longest_in_spans: float = 1.0
    """Longest wave over x, y or t, in spans of the log. Statistics: a longer one is not told from a slope."""

    edge_places: tuple[float, ...] = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
    """Places of edges on the grid, shares of the span. Numerics: as far apart as their width."""

    edge_widths: tuple[float, ...] = (0.02, 0.1)
    """Widths of edges on the grid, shares of the span. Judgement: a line on the floor, or a ramp."""

    side_angles_rad: tuple[float, ...] = (0.52, 1.05, 2.09, 2.62)
    """Directions across lines that are neither x nor y. Numerics: 30° apart, with x and y between them."""

    strip_widths: tuple[float, ...] = (0.05, 0.12)
    """Widths of strips on the grid, shares of the span. Judgement: a mat or a ramp."""

    widest_line: float = 0.25
    """Widest side, strip or band, share of the span. Judgement: what changes more slowly is no line."""

    side_turn_rad: float = 0.02
    """Step of such an angle in a difference quotient. Numerics: over 30 m, a row moves by half a metre."""

    least_period_s: float = 4.0
    """Shortest wave over time, s. Physics: what swings faster is the disturbance, which lasts as long."""

    least_swing_s: float = 0.8
    """Shortest wave of the time alone, s. Physics: a load on .2 m of rope, an arm that picks and places. It
    goes on in step, as no disturbance does."""

    scale_shares: Shares = (
        ("fall", (0.1, 0.3, 0.8, 2.0)),
        ("over", (0.2, 0.45, 0.8, 1.3)),
        ("bell", (0.25, 0.6, 1.2)),
    )
    """Shapes on the grid. Numerics: from one number to the next a shape changes by less than Gauss–Newton
    makes up for."""

    rise_shares: tuple[float, ...] = (0.25, 0.6, 1.2)
    """Rises with which what is found is tried besides. As ``scale_shares``."""

    most_modulations: int = 2
    """Most such shapes that are fitted, to choose one. Numerics: each costs a fit."""

    ring_shares: tuple[tuple[float, ...], tuple[float, ...]] = ((0.4, 0.8, 1.2, 1.6), (0.25, 0.5))
    """Middles and widths of rings, in the same units. As ``scale_shares``."""

    side_shares: tuple[tuple[float, ...], tuple[float, ...]] = ((0.3, 0.8), (0.15, 0.4))
    """Where sides begin and over how much, in the same units. As ``scale_shares``."""

    softer: float = 1.5
    """Step of a friction's softness, a factor. Numerics: a friction changes little from one to the next."""

    most_softer: int = 4
    """Most such steps. Judgement: from .016 to 1.5 m/s or rad/s; what is softer is a drag."""

    scales: tuple[float, float] = (0.02, 5.0)
    """Smallest and largest number of a shape, in the same units. Statistics: beyond, it is a sign, or a
    constant."""

    least_scale: float = 1e-6
    """Least root mean square of a quantity. Numerics: what never moves has a shape of no scale."""

    gust_s: tuple[float, ...] = (4.0, 8.0, 16.0)
    """Widths of gusts on the grid, s. Judgement: from a squall to a shower."""

    least_gust_s: float = 3.0
    """Narrowest gust, and the least time before and after a step, s. As ``apart_s``: a held-out part must see
    it too."""

    most_gust: float = 0.5
    """Widest gust, share of the log. Judgement: a wider one is a drift."""

    step_s: float = 3.0
    """Time between two steps on the grid, s. Judgement: as the narrowest gust."""

    least_saw_s: float = 8.0
    """Shortest period of what builds up and drops, s. Judgement: twice the shortest wave over time, since a
    saw has two more."""

    longest_saw: float = 0.5
    """Longest such period, share of the log. Statistics: it drops twice."""

    saw_phases: tuple[float, ...] = (0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)
    """Beginnings of saws on the grid, shares of the period. Numerics: as ``scale_shares``."""

    saw_step: float = 0.02
    """Step of a saw's beginning in a difference quotient, share of the period; of the period that of it
    again. Numerics: less than the drop, which 50 periods put off by as much."""

    decay_spans: tuple[float, ...] = (0.1, 0.3, 1.0)
    """Times of decays on the grid, shares of the log. As ``scale_shares``."""

    overtones: tuple[int, ...] = (2, 3)
    """Harmonics of a wave that are tried beside it. Physics: what a washboard or a loose contact has."""

    most_turns: int = 30
    """Most half turns over a span of a wave along a direction. Numerics: the grid grows by its square."""

    turns: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0)
    """Waves over the heading, periods a turn. Physics: a wind has one, a floor with a grain two, one of
    squares four."""

    slanted: float = 0.2
    """Least share of each direction in such a wave. Judgement: 12° off x or y; nearer it is a wave over
    those."""

    push_rows: int = 4
    """Rows of a push, by whose answers groups are scored at once. Numerics: .16 s, within which a robot's
    motion changes little."""

    pushes: int = 64
    """Pushes after which an answer is over. Numerics: 10 s, longer than the filter remembers a push."""

    most_stretches: int = 12
    """About as many stretches of as many pushes are looked at in a long log, to find what is scored anew.
    Numerics: two minutes of ten."""

    stretches_in_a_row: int = 3
    """Stretches that follow one another there. Numerics: each run reads one stretch before it, too."""

    screened: int = 12
    """Most groups of a kind that the filter scores anew. Numerics: a tenth of a pass each."""

    rivals: tuple[tuple[str, int], ...] = (
        ("shape", 4),
        ("timed", 2),
        ("curve", 2),
        ("wave", 2),
        ("circle", 2),
    )
    """Groups of a kind whose numbers are refined; one of the other kinds. Judgement: curves of neighbouring
    quantities are told apart by their best numbers alone."""

    most_fitted: int = 4
    """Most groups of a scan that are fitted, to choose one. Numerics: each costs a fit."""

    most_apart: int = 3
    """Most groups that are no answer of a controller and are fitted besides. Numerics: each costs a fit."""

    way_lengths_m: tuple[float, float] = (1.5, 20.0)
    """Shortest and longest wave along the way, m. Judgement: what turns with a wheel or lies on a floor."""

    most_waves: int = 120
    """Most waves of a family. Numerics: each costs two columns of a pass."""

    bell_shares: tuple[float, ...] = (0.06, 0.1, 0.16, 0.25)
    """Radii of bells, shares of the path's mean span. Judgement: from a bump to half of the area."""

    wide_shares: tuple[float, ...] = (0.5, 1.0)
    """The same of frictions that change over the whole area. As ``bell_shares``."""

    away_shares: tuple[float, ...] = (0.12, 0.2, 0.35, 0.6)
    """The same of the distance at which what acts far from a place is half of all. As ``bell_shares``."""

    circle_shares: tuple[float, ...] = (0.17, 0.25, 0.35, 0.5)
    """The same of the radii of round paths. As ``bell_shares``."""

    circle_width: float = 0.1
    """Width of a round path on the grid, in those spans. As ``strip_widths``."""

    circle_step: float = 0.125
    """Step of the places about which paths are round, in those spans. Numerics: about their width."""

    widest_bell: float = 0.35
    """Largest radius of a bell, share of that span. Judgement: a wider one is flat or a slope."""

    rope_shares: tuple[float, float] = (0.05, 0.3)
    """How near its end a rope gets slack, on the grid, in the same spans. As ``bell_shares``."""

    rope_step: float = 0.25
    """Step of the places where a rope may be held, in those spans. Numerics: half a span away, its direction
    changes by half a right angle at most from one to the next."""

    rope_reach: float = 0.5
    """How far outside of the area a rope may be held, in those spans. Statistics: a pull from farther away is
    hardly told from a slope."""

    least_radius_m: float = 0.5
    """Smallest radius of a bell, m. Judgement: about a robot's length."""

    visits: int = 2
    """Least visits of a bell's middle. Statistics: what was seen once is a moment, and no place."""

    flank_radii: float = 2.0
    """How far from its middle a bell is seen, in radii. Numerics: a seventh of its height, half of its
    steepest slope."""

    apart_s: float = 4.0
    """Time between two visits, s. Judgement: as the held-out parts, so that a visit may prove another one."""

    chunk: int = 128
    """Columns of one pass. Numerics: memory."""

    shape_steps: int = 4
    """Gauss–Newton steps of a wave's number or a bell's place and radius. Numerics."""

    first_steps: tuple[float, ...] = (1.0, 0.4, 0.15)
    """Shares of the first such step that are tried, until one gains. Numerics: from a neighbouring cell of a
    grid a whole step may go too far."""

    wave_step_radps: float = 0.003
    """The same over time, rad/s. Numerics: a third of a radian over 90 s."""

    wave_step_radpm: float = 0.01
    """Step of a wave's number in a difference quotient, rad/m. Numerics: a third of a radian over 30 m."""

    bell_step: float = 0.05
    """Step of a bell's place and radius, shares of the radius. Numerics: far below its curvature."""

    shape_reach: float = 15.0
    """Longest change in one Gauss–Newton step, in those steps. Numerics: about a cell of the grids."""
