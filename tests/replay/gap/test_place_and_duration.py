"""What a place or a duration rules out: tyres where only one place skids, a slip that lasts like a load."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, made_fit, made_log, problem_of

from wmr_replay.gap.evidence.one_place import skids_at_one_place
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.fit_candidates import is_ruled_out


@pytest.fixture(scope="module")
def drive():
    """40 s of the base model."""
    return problem_of(made_log(1))


@pytest.mark.parametrize(
    ("name", "at_m", "said"),
    [
        ("cornering_stiffness", (2.0,), True),
        ("cornering_stiffness", (2.0, 2.8), True),
        ("cornering_stiffness", (2.0, 6.0), False),
        ("viscous_drag", (2.0,), False),
    ],
)
def test_skids_at_one_place_alone_may_be_the_ground(drive, name, at_m, said):
    """Sensitivities within 30 cm of some places of a straight path of 8 m, there and back."""
    n = len(drive.binned)
    x_m = 8.0 * np.abs(np.linspace(-1, 1, n))
    binned = replace(drive.binned, pose=np.stack([x_m, np.ones(n), np.zeros(n)], axis=1))
    near = np.any([np.abs(x_m - one) < 0.3 for one in at_m], axis=0)
    psi = np.random.default_rng(5).normal(size=(n, 3, 1)) * near[:, None, None]
    there = replace(drive, binned=binned)
    fit = made_fit(there, Extension(BASE, {name: {candidate_of(name).free[0]: -0.5}}), np.zeros((n, 3)), psi)
    reason = skids_at_one_place(name, there, fit)
    assert bool(reason) is said
    assert not said or f"about x {np.mean(at_m):.1f} m, y 1.0 m alone" in reason
    small = replace(there, binned=replace(binned, pose=binned.pose * (0.1, 1, 1)))
    assert skids_at_one_place(name, small, fit) == ""


@pytest.mark.parametrize(("lasts_s", "another"), [(35.0, False), (37.0, True)])
def test_a_loss_that_lasts_is_no_slip(drive, lasts_s, another):
    interval = {"start_s": 1.0, "end_s": 1.0 + lasts_s, "loss": 0.3}
    fit = made_fit(drive, Extension(BASE, {"slip_interval": interval}), np.zeros((len(drive.binned), 3)))
    assert is_ruled_out(drive, fit, "slip_interval") is another
