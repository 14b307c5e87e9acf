"""The work that a long log may ask for; what is long is 60 s here, and the beginning 30 s."""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions, analyse
from wmr_replay.gap.analyse import limited_work, what_was_left_out
from wmr_replay.gap.estimation import problem as filtered_logs
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.work import Work, begin_work, work_on
from wmr_replay.gap.settings import GateSettings
from wmr_synth import hidden_log

USUAL = GateSettings()
BEGUN = replace(USUAL.begun, lasts_s=30.0, long_s=60.0)


def long_at(most_passes: float) -> GateSettings:
    return replace(USUAL, begun=BEGUN, work=replace(USUAL.work, most=most_passes))


@pytest.fixture(scope="module")
def log():
    """90 s with a viscous drag."""
    return hidden_log("patrol", seed=90_131, hide=["viscous_drag:c1_per_s=.25"], noise="rtk")[0]


def test_work_is_allowed_up_to_its_limit():
    work = Work(10.0)
    work.add(9.0)
    assert work.allows("a rival")
    work.add(1.0)
    assert not any(work.allows(what) for what in ("a rival", "a formula", "a rival"))
    assert list(work.left_out) == ["a rival", "a formula"]
    assert "ended early: a rival, a formula were not tried" in what_was_left_out(work)
    assert not what_was_left_out(Work())


def test_only_long_logs_have_a_limit(log):
    assert limited_work(log, USUAL).most == np.inf
    bins = (log.pose.t_ns[-1] - log.pose.t_ns[0]) / 1e9 / USUAL.bins.bin_s
    assert limited_work(log, long_at(7.0)).most == pytest.approx(7 * bins)
    assert work_on(log.pose).most == pytest.approx(7 * bins)


def test_a_pass_of_the_filter_counts_once(log):
    work = begin_work(log.pose, np.inf)
    problem = Problem.of(bin_log(log, USUAL, log.mode))
    extension, noise = Extension(base_of(log.robot)), Diffusion(0.05, 0.4, 0.05, 0.4, 0.01, 0.2)
    for _ in range(2):
        problem.filtered(extension, noise)
    assert work.rows == len(problem.binned)
    problem.relabelled(log.mode).filtered(extension, noise)
    assert work.rows == 2 * len(problem.binned)


def test_a_search_that_is_cut_short_says_so_and_keeps_what_it_found(log, monkeypatch):
    passes, filter_pass = [], filtered_logs.filter_pass
    monkeypatch.setattr(filtered_logs, "filter_pass", lambda *args: passes.append(1) or filter_pass(*args))
    full = analyse(log, None, GapOptions(gates=long_at(1e9)))
    n_full = len(passes)
    short = [analyse(log, None, GapOptions(gates=long_at(1.0))) for _ in range(2)]
    assert len(passes) - n_full < 2 * n_full
    assert not [note for note in full.notes if note.startswith("the log is long")]
    said = [[note for note in one.notes if note.startswith("the log is long")] for one in short]
    assert said[0] == said[1] != []
    assert [effect.name for effect in full.effects] == ["viscous_drag"]
    for one in short:
        assert [effect.name for effect in one.effects] == ["viscous_drag"]
        assert one.effects[0].parameters == short[0].effects[0].parameters
