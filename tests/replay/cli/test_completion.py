"""What a shell offers behind Tab, through the protocol of its script, and that no name is out of date."""

import os
import subprocess
import sys

import pytest

from wmr_replay.api.request import SettingsArguments
from wmr_replay.api.suite import suites
from wmr_replay.api.synthesise import hidden_effects, scenarios
from wmr_replay.cli.options import names
from wmr_replay.cli.options.completion import complete_effect
from wmr_replay.regress.criteria import COLUMNS

HEAVY = {"numba", "polars", "scipy", "numpy", "rich"}


def test_the_names_are_those_that_there_are():
    assert set(names.SCENARIOS) == set(scenarios()["name"])
    assert set(names.SUITES) == {suite["name"] for suite in suites()}
    assert names.METRICS == COLUMNS
    assert tuple(SettingsArguments.__annotations__) == names.SETTINGS


def offered(*words, shell="bash"):
    """The offers for the last word."""
    environment = os.environ | {
        "_WMR_REPLAY_COMPLETE": f"{shell}_complete",
        "COMP_WORDS": " ".join(["wmr-replay", *words]),
        "COMP_CWORD": str(len(words)),
    }
    call = [sys.executable, "-m", "wmr_replay"]
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
    return [tuple(line.split(",", 1)) for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("words", "some"),
    [
        (["sy"], {"synth"}),
        (["synth", "paper-a"], {"paper-acceleration", "paper-alpha-ideal"}),
        (["synth", "patrol", "--hide", "vis"], {"viscous_drag"}),
        (["synth", "patrol", "--hide", "viscous_drag:"], {"viscous_drag:c1_per_s="}),
        (["suite", "noi"], {"noise-sweep"}),
        (["check", "--require", "accur"], {"accuracy", "accuracy_decided"}),
        (["check", "--require", "accuracy"], {"accuracy>=", "accuracy<="}),
        (["compare", "a", "--set-a", "window"], {"window_s="}),
        (["gap", "--fail-on", "named,un"], {"named,unnamed"}),
        (["gap", "--modes", "i"], {"identified", "ideal"}),
        (["run", "--ident"], {"--identifier"}),
        (["run", "--identifier", "b"], {"bank"}),
    ],
)
def test_offers(words, some):
    assert some <= {value for _, value in offered(*words)}


def test_a_log_is_completed_as_a_file():
    assert offered("run", "dri") == [("file", "dri")]
    assert offered("suite", "my.to") == [("file", "my.to")]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_each_shell(shell):
    environment = os.environ | {"_WMR_REPLAY_COMPLETE": f"{shell}_source"}
    call = [sys.executable, "-m", "wmr_replay"]
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
    assert "_WMR_REPLAY_COMPLETE" in done.stdout


def test_every_effect_that_can_be_hidden_is_offered_with_its_parameters():
    effects = {effect["name"]: effect["parameters"] for effect in hidden_effects()}
    assert effects.keys() <= {item.value for item in complete_effect(None, None, "")}
    for name, parameters in effects.items():
        offers = {item.value for item in complete_effect(None, None, f"{name}:")}
        assert offers == {f"{name}:{key}=" for key in parameters}


def test_no_heavy_package_is_imported_for_it():
    code = "import sys; from wmr_replay.cli import synth, suite, check; print(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert HEAVY.isdisjoint(done.stdout.split())
