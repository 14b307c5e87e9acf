"""The contact modes that a model sees by the likelihood that sums over them."""

import importlib
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.test_unknown_modes import BASE, FITTED, NOISE, made_problem

from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.estimation.relabel import with_modes
from wmr_replay.gap.estimation.smoothed_modes import (
    smooth,
    smoothed_modes,
    switches_of,
)
from wmr_replay.gap.estimation.unknown_modes import chain_of
from wmr_replay.gap.formula import other_modes
from wmr_replay.gap.formula.modes import Start, once_more, whole_cost
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.modes import ContactMode

BENCH = Path(__file__).parents[3] / "bench"
LOSS = "unnamed:longitudinal:abs(effort_sum)*soft(v,0.08)"
SETTINGS = GateSettings()


def posteriors(first, switches, likelihoods) -> np.ndarray:
    """Probabilities (n, m) of a chain's states given all rows, by every history one by one."""
    n, m = likelihoods.shape
    total = np.zeros((n, m))
    for history in product(range(m), repeat=n):
        p = first[history[0]] * likelihoods[0, history[0]]
        for k in range(1, n):
            p *= switches[k, history[k - 1], history[k]] * likelihoods[k, history[k]]
        for k, state in enumerate(history):
            total[k, state] += p
    return total / total.sum(axis=1, keepdims=True)


def filtered(first, switches, likelihoods) -> np.ndarray:
    """Probabilities (n, m) of a chain's states given the rows before."""
    weights, before = np.zeros_like(likelihoods), first
    for k, row in enumerate(likelihoods):
        at = (before if k == 0 else before @ switches[k]) * row
        weights[k] = before = at / at.sum()
    return weights


@pytest.mark.parametrize("seed", range(5))
def test_smoothed_weights_are_those_of_all_histories(seed):
    rng = np.random.default_rng(seed)
    switches, first = rng.dirichlet(np.ones(4), size=(5, 4)), rng.dirichlet(np.ones(4))
    likelihoods = rng.uniform(0.01, 1, (5, 4))
    weights = filtered(first, switches, likelihoods)
    smooth(weights, switches, np.zeros(4))
    np.testing.assert_allclose(weights, posteriors(first, switches, likelihoods))


def test_a_mode_that_no_row_leads_to_stays_impossible():
    switches = np.broadcast_to(np.diag([1.0, 1.0, 1.0, 0.0]), (6, 4, 4))
    weights = np.tile([0.5, 0.3, 0.2, 0.0], (6, 1))
    smooth(weights, switches, np.zeros(4))
    assert np.all(np.isfinite(weights))
    assert np.all(weights[:, 3] == 0)


def test_switches_are_probabilities_that_a_longer_step_makes_likelier():
    chain = chain_of(made_problem(1.0, 4))
    switches = switches_of(chain, np.array([0.01, 0.04]))
    np.testing.assert_allclose(switches.sum(axis=2), 1.0)
    left = 1.0 - switches[:, 0, 0]
    np.testing.assert_allclose(left, 1 - np.exp(-chain.rates_per_s[0] * np.array([0.01, 0.04])))


@pytest.mark.parametrize(("acts", "mode"), [(1.0, ContactMode.IDEAL), (0.2, ContactMode.SLIPPING)])
def test_what_follows_tells_when_slipping_began(acts, mode):
    problem = made_problem(acts, 40)
    seen = smoothed_modes(problem, Extension(BASE), NOISE)
    assert np.all(seen[: FITTED - 8] == ContactMode.IDEAL)
    assert np.all(seen[FITTED + 4 : FITTED + 25] == mode)


def test_labels_count_for_nothing():
    problem = made_problem(0.2, 40)
    seen = smoothed_modes(problem, Extension(BASE), NOISE)
    for mode in (ContactMode.SKIDDING, ContactMode.SLIPPING):
        other = problem.relabelled(with_modes(problem.binned, np.full(len(problem.binned), mode)))
        assert np.array_equal(smoothed_modes(other, Extension(BASE), NOISE), seen)


@pytest.fixture(scope="module")
def lossy():
    """A minute of shunting with gears that lose a share of their torque, and skids and slips of its own: the
    log, its rows with the simulation's modes, and the model with that loss, fitted to them.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        case = importlib.import_module("worlds.case").Case(1, "shunting", "rtk", "", 4, 60.0)
        log = importlib.import_module("formulas.plants").hidden_world("gear_loss_under_load", case).world.log
    truth = Problem.of(bin_log(log, SETTINGS, log.mode))
    model = Extension(base_of(log.robot)).with_effect(LOSS, {"coefficient": -0.1})
    return log, truth, fit_model(truth, model, None).extension


def test_a_model_is_likelier_with_the_modes_that_it_sees_itself(lossy):
    log, truth, model = lossy
    identified = Problem.of(bin_identified(log, likely_modes(log, model, SETTINGS), SETTINGS))
    start = Start(identified, fit_model(identified, model, None), Extension(model.base))
    seen = once_more(log, start, GapOptions(modes="identified"))
    assert whole_cost(seen) < whole_cost(start) - 500
    rolls = truth.binned.mode == ContactMode.IDEAL
    assert np.mean(seen.problem.binned.mode[rolls] == ContactMode.IDEAL) > 0.95
    assert np.mean(identified.binned.mode[rolls] == ContactMode.IDEAL) < 0.95


def test_what_is_seen_keeps_the_names_and_the_price(lossy):
    log, truth, model = lossy
    start = Start(truth, fit_model(truth, model, None), Extension(model.base), 7.0)
    seen = once_more(log, start, GapOptions(modes="identified"))
    assert seen.price == 7.0
    assert seen.rest is start.rest
    assert [*seen.fit.extension.effects] == [LOSS]


def a_start(cost: float, names: tuple[str, ...] = ()) -> SimpleNamespace:
    """A model with its modes, as far as it is compared: its cost and price, and what it stands beside."""
    problem = SimpleNamespace(settings=SETTINGS, binned=None)
    fit = SimpleNamespace(extension=SimpleNamespace(effects={name: {} for name in names}))
    return SimpleNamespace(cost=cost, price=0.0, problem=problem, rest=fit, fit=fit)


@pytest.mark.parametrize(
    ("cost", "names", "price"),
    [(20.0, (), 5.0), (20.0, ("scrub_torque",), 12.0), (10.0 + SETTINGS.modes.hopeless + 1.0, (), None)],
)
def test_a_start_that_is_nearly_as_likely_is_grown_first(monkeypatch, cost, names, price):
    """The formula that is grown pays for the named effects beside it; far behind, nothing is grown."""
    start, grown = a_start(cost, names), SimpleNamespace(fit="grown", price=lambda _problem: 5.0)
    tried = SimpleNamespace(beside=lambda _effects: None)
    for name, stands_in in {
        "takes_place": lambda one, *_: one is not start,
        "named": lambda *_: SimpleNamespace(cost=10.0, price=7.0),
        "whole_cost": lambda one: one.cost,
        "fit_model": lambda *_: SimpleNamespace(extension=start.rest.extension),
        "groups_of": lambda *_: tried,
        "grown_both_ways": lambda *_: [grown],
        "replace": lambda _start, **changed: SimpleNamespace(**changed),
    }.items():
        monkeypatch.setattr(other_modes, name, stands_in)
    found = other_modes.that_takes_place(start, start.problem, None)
    assert (found and (found.fit, found.price)) == (None if price is None else ("grown", price))
