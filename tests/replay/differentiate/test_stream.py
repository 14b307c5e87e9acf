"""The differentiator's backends against exact rationals: drift, bad samples, irregular stamps, coverage."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from wmr_replay.differentiate import Derivatives, Differentiator, KernelSpec
from wmr_replay.differentiate.backends import BlockBackend, DirectBackend
from wmr_replay.differentiate.stream import concatenate_derivatives
from wmr_schemas.status import Status


def no_inputs(t_ns):
    return np.empty((0, len(t_ns)))


def exact_fit(t_ns, samples, spec, window_ns, orders=3):
    """Weighted least squares on integer nanoseconds in exact rationals; derivatives at the delay, in s."""
    window, size = Fraction(window_ns), spec.degree + 1
    tau = [Fraction(int(t_ns[-1] - t)) / window for t in t_ns]
    weight = [a**spec.kappa * (1 - a) ** spec.mu for a in tau]
    moment = [sum(w * a**p for w, a in zip(weight, tau, strict=True)) for p in range(2 * size - 1)]
    rows = [
        [
            *moment[p : p + size],
            sum(w * a**p * Fraction(float(x)) for w, a, x in zip(weight, tau, samples, strict=True)),
        ]
        for p in range(size)
    ]
    for i in range(size):
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(size):
            if k != i:
                rows[k] = [x - rows[k][i] * y for x, y in zip(rows[k], rows[i], strict=True)]
    coefficients, at = [row[size] for row in rows], (1 - Fraction(spec.theta)) / 2
    out = []
    for n in range(orders):
        total = Fraction(0)
        for p in range(n, size):
            factor = 1
            for m in range(n):
                factor *= p - m
            total += coefficients[p] * factor * at ** (p - n)
        out.append(float(total / (-window / 10**9) ** n))
    return out


def exact_blend(t_ns, samples, spec, window_ns):
    """The fit of degree N, and of each higher degree its share of what it changes."""
    fits = [
        np.array(exact_fit(t_ns, samples, replace(spec, degree=degree, shares=()), window_ns))
        for degree in range(spec.degree, spec.top_degree + 1)
    ]
    return fits[0] + sum(share * step for share, step in zip(spec.shares, np.diff(fits, axis=0), strict=True))


@pytest.mark.parametrize("irregular", [False, True])
@pytest.mark.parametrize(
    "spec",
    [
        KernelSpec(2),
        KernelSpec(2, 1, 1),
        KernelSpec(3, 1, 1, 0.4),
        KernelSpec(5),
        KernelSpec(4, 0, 0, 1.0),
        KernelSpec(4, 2, 2),
        KernelSpec(6),
        KernelSpec(7),
        KernelSpec(2, 0, 1, 0.3, (1.1, 0.6, -0.2)),
        KernelSpec(3, 1, 1, 0.3, (0.5, 0.25)),
    ],
)
def test_estimates_are_the_exact_fit_in_spite_of_an_offset_of_a_million(spec, irregular):
    """Error below 1e-9 of the estimate's own sd at a noise of .01, under jitter of 30 % and 10 % dropouts."""
    rng = np.random.default_rng(5)
    t_ns = 10**18 + np.arange(300) * 1_000_000
    if irregular:
        t_ns = np.sort((t_ns + rng.integers(-300_000, 300_000, 300))[rng.random(300) > 0.1])
    t_s = (t_ns - t_ns[0]) * 1e-9
    x = 1e6 + 3 * t_s + np.sin(20 * t_s) + 0.01 * rng.normal(size=len(t_ns))
    differentiator = Differentiator(spec, window_s=0.04, step_s=0.001)
    out = differentiator.push(t_ns, x[None], no_inputs(t_ns))
    sd = out.sd(0.01)
    for i in rng.choice(np.flatnonzero(out.state == Status.OK), 8):
        first = int(np.searchsorted(t_ns, t_ns[i] - 40_000_002))
        expected = exact_blend(t_ns[first : i + 1], x[first : i + 1], spec, 40_000_000)
        assert out.estimates[0, 0, i] == pytest.approx(expected[0], rel=1e-15)
        for n in (1, 2):
            assert abs(out.estimates[0, n, i] - expected[n]) <= 1e-9 * sd[0, n, i]


def test_gains_on_irregular_stamps_are_the_sums_of_squared_taps():
    """Taps read off by sending unit impulses through, one window at a time."""
    rng = np.random.default_rng(8)
    t_ns = np.sort(10**18 + np.arange(30) * 10_000_000 + rng.integers(-3_000_000, 3_000_000, 30))
    spec = KernelSpec(3, 1, 0, 0.2)
    out = Differentiator(spec, window_s=0.2, step_s=0.01).push(t_ns, np.eye(30), np.empty((0, 30)))
    row = int(np.flatnonzero(out.state == Status.OK)[-1])
    taps = out.estimates[:, :, row]
    np.testing.assert_allclose(taps.T @ taps, out.gains[:, :, row], rtol=1e-9)


@pytest.mark.parametrize("irregular", [False, True])
def test_nothing_drifts_however_long_the_log(irregular):
    """Rows late in two million samples equal, to the bit, those of a log that begins whole blocks later.

    Blocks are counted from the first stamp and nothing passes from one to the next: true for any length.
    """
    rng = np.random.default_rng(0)
    n, step_ns = 2_000_000, 1_000_000
    t_ns = 10**18 + np.arange(n) * step_ns
    x = (1e3 + rng.normal(size=n).cumsum())[None]
    spec = KernelSpec(3)

    def fresh():
        return Differentiator(spec, window_s=0.5, step_s=0.001, folds=(2,))

    block_ns = 500_000_002
    if irregular:
        t_ns = t_ns + rng.integers(-300_000, 300_000, n)
        late = 1_990_000
        t_ns[late] = t_ns[0] + -(-(t_ns[late] - t_ns[0]) // block_ns) * block_ns
        t_ns[late + 1 :] += max(0, t_ns[late] - t_ns[late + 1] + 1)
    else:
        late = 500_000  # 1000 blocks hold 2 µs more than 500 s; the stamps there lie within the tolerance
        t_ns[late:] += 2000
    u = rng.normal(size=(1, n))
    whole = concatenate_derivatives(list(stream(fresh(), t_ns, x, u, 65_536)))
    short = fresh().push(t_ns[late:], x[:, late:], u[:, late:])
    tail = slice(late + 600, None)
    assert np.count_nonzero(short.state == Status.OK) > 9000
    assert np.array_equal(whole.estimates[:, :, tail], short.estimates[:, :, 600:])
    assert np.array_equal(whole.inputs[:, tail], short.inputs[:, 600:])


def stream(differentiator, t_ns, samples, inputs, size):
    for a in range(0, len(t_ns), size):
        yield differentiator.push(t_ns[a : a + size], samples[:, a : a + size], inputs[:, a : a + size])
    yield differentiator.finish()


@pytest.mark.parametrize("spec", [KernelSpec(2), KernelSpec(4, 2, 2)])
@pytest.mark.parametrize("jitter_ns", [0, 2_000_000])
def test_a_sample_that_is_not_a_number_spoils_the_windows_that_hold_it_and_no_other(spec, jitter_ns):
    rng = np.random.default_rng(2)
    t_ns = 10**18 + np.arange(400) * 10_000_000 + rng.integers(0, jitter_ns + 1, 400)
    samples, inputs = rng.normal(size=(2, 400)), rng.normal(size=(1, 400))

    def run(x, u):
        return Differentiator(spec, window_s=0.3, step_s=0.01, folds=(2,)).push(t_ns, x, u)

    clean = run(samples, inputs)
    spoilt_samples, spoilt_inputs = samples.copy(), inputs.copy()
    spoilt_samples[0, 200], spoilt_inputs[0, 200] = np.nan, np.inf
    spoilt = run(spoilt_samples, spoilt_inputs)
    age_ns = t_ns - t_ns[200]
    holds = (age_ns >= 0) & (age_ns <= 300_000_002)
    ok = clean.state == Status.OK
    assert np.isnan(spoilt.estimates[0, :, holds & ok]).all()
    assert np.array_equal(spoilt.estimates[0, :, ~holds & ok], clean.estimates[0, :, ~holds & ok])
    assert np.array_equal(spoilt.estimates[1], clean.estimates[1], equal_nan=True)
    assert np.array_equal(spoilt.inputs[0, ~holds & ok], clean.inputs[0, ~holds & ok])


def test_an_outlier_leaves_no_trace_once_out_of_the_window():
    rng = np.random.default_rng(2)
    t_ns = 10**18 + np.arange(300) * 10_000_000
    x = rng.normal(size=(1, 300))
    struck = x.copy()
    struck[0, 100] = 1e15
    spec = KernelSpec(2)
    clean = Differentiator(spec, window_s=0.3, step_s=0.01).push(t_ns, x, no_inputs(t_ns))
    after = Differentiator(spec, window_s=0.3, step_s=0.01).push(t_ns, struck, no_inputs(t_ns))
    assert np.array_equal(clean.estimates[..., 131:], after.estimates[..., 131:])


def test_predicted_sd_on_irregular_stamps_is_that_of_monte_carlo():
    rng = np.random.default_rng(4)
    n = 400
    t_ns = 10**18 + np.arange(n) * 10_000_000 + rng.integers(-1_000_000, 1_000_000, n)
    t_ns = t_ns[rng.random(n) > 0.05]
    noise = 0.1 * rng.normal(size=(4000, len(t_ns)))
    out = Differentiator(KernelSpec(2), window_s=0.4, step_s=0.01).push(t_ns, noise, no_inputs(t_ns))
    ok = out.state == Status.OK
    measured = np.sqrt(np.mean(out.estimates[:, :, ok] ** 2, axis=(0, 2)))
    predicted = np.sqrt(np.mean(out.sd(0.1)[0][:, ok] ** 2, axis=1))
    np.testing.assert_allclose(predicted, measured, rtol=0.01)


def test_coverage_is_the_share_of_the_nominal_samples_and_half_is_the_least():
    t_ns = 10**18 + np.arange(400) * 10_000_000
    keep = np.ones(400, bool)
    keep[100:200:2] = False  # every second sample is lost for a second
    keep[300:400] = False
    keep[300:400:4] = True  # then three of four
    t_ns = t_ns[keep]
    out = Differentiator(KernelSpec(2), window_s=0.4, step_s=0.01).push(
        t_ns, np.zeros((1, len(t_ns))), no_inputs(t_ns)
    )
    at = dict(zip(((t_ns - t_ns[0]) // 10_000_000).tolist(), range(len(t_ns)), strict=True))
    assert out.coverage[at[90]] == 1.0
    assert out.coverage[at[189]] == pytest.approx(21 / 41)
    assert out.state[at[60]] == Status.OK
    assert out.state[at[396]] == Status.GAP
    assert out.coverage[at[396]] < 0.5
    assert out.sd(1.0)[0, 2, at[161]] > out.sd(1.0)[0, 2, at[90]]


def test_instants_that_do_not_determine_the_fit_are_a_gap():
    """Bursts of stamps a few nanoseconds apart: many samples, but only two places in the window."""
    bursts = [np.arange(40) + k * 80_000_000 for k in range(12)]
    t_ns = 10**18 + np.concatenate(bursts)
    out = Differentiator(KernelSpec(3), window_s=0.3, step_s=0.01).push(
        t_ns, np.ones((1, len(t_ns))), no_inputs(t_ns)
    )
    late = slice(400, None)
    assert set(out.state[late]) <= {Status.OK, Status.GAP}
    assert np.isnan(out.estimates[0, :, out.state == Status.GAP]).all()
    assert np.isfinite(out.estimates[0, :, out.state == Status.OK]).all()


def test_estimates_return_once_the_window_is_whole_again():
    t_ns = 10**18 + np.arange(200) * 10_000_000
    t_ns[100:] += 2_000_000_000
    differentiator = Differentiator(KernelSpec(2), window_s=0.4, step_s=0.01)
    out = differentiator.push(t_ns, np.zeros((1, 200)), no_inputs(t_ns))
    assert (out.state[100:130] == Status.GAP).all()
    assert (out.state[131:] == Status.OK).all()
    assert np.isnan(out.delay_s[100:130]).all()
    assert (out.delay_s[131:] == differentiator.delay_s).all()


def test_a_change_of_rate_is_followed_on_the_actual_stamps():
    slow, fast = np.arange(200) * 10_000_000, 2_000_000_000 + np.arange(1000) * 2_000_000
    t_ns = 10**18 + np.concatenate([slow, fast])
    t_s = (t_ns - t_ns[0]) * 1e-9
    differentiator = Differentiator(KernelSpec(2), window_s=0.4, step_s=0.01)
    out = differentiator.push(t_ns, (t_s**2)[None], no_inputs(t_ns))
    ok = out.state == Status.OK
    assert ok[41:].all()
    np.testing.assert_allclose(out.estimates[0, 1, ok], 2 * (t_s[ok] - differentiator.delay_s), atol=1e-9)
    assert out.coverage[-1] == pytest.approx(201 / 41)


def test_steep_kernels_take_the_direct_road():
    differentiators = [
        Differentiator(spec, window_s=0.4, step_s=0.01) for spec in (KernelSpec(3, 1, 1), KernelSpec(7))
    ]
    assert [type(d._backend) for d in differentiators] == [BlockBackend, DirectBackend]


def test_finish_gives_no_rows_before_and_after_data():
    differentiator = Differentiator(KernelSpec(2), window_s=0.1, step_s=0.01)
    assert isinstance(differentiator.finish(), Derivatives)
    t_ns = np.arange(30) * 10_000_000
    differentiator.push(t_ns, np.zeros((3, 30)), no_inputs(t_ns))
    assert differentiator.finish().estimates.shape == (3, 3, 0)
