"""Thresholds as data: every one has a reason, none stands elsewhere in the analysis, a changed one acts."""

import ast
import inspect
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.errors import InvalidSignal
from wmr_synth import synthesise

ROOMS = Path(inspect.getfile(GateSettings)).parents[1]
SOURCES = ("Statistics", "Physics", "Numerics", "Presentation", "Judgement", "Patrol", "As ", "``")
GROUPS = ("GateSettings", "WheelSpeedSettings")
"""Classes whose fields are groups of settings."""
STRUCTURE = {
    "LOG_TWO_PI",
    "N_FREE",
    "FOLDS",
    "NO_TARGETS",
    "PRODUCT_COLUMNS",
    "PIECE_ROWS",
    "START_ALPHA",
    "MOST_EXACT",
    "POWERS",
}
"""Module constants that lay out arrays or are mathematics; all other numbers belong to the settings."""


def trees(*rooms: str):
    """The syntax trees of rooms' modules, with their paths."""
    for room in rooms:
        for path in sorted((ROOMS / room).rglob("*.py")):
            yield path, ast.parse(path.read_text(encoding="utf-8"))


def settings_with_text():
    """(Class, name, its own text, its class's text) of every setting; the text follows the setting."""
    for _, tree in trees("settings"):
        for owner in (node for node in tree.body if isinstance(node, ast.ClassDef)):
            for node, after in zip(owner.body, [*owner.body[1:], None], strict=True):
                if isinstance(node, ast.AnnAssign) and owner.name not in GROUPS:
                    own = after.value.value if isinstance(after, ast.Expr) else ""
                    yield owner.name, node.target.id, own, ast.get_docstring(owner)


def test_every_setting_says_what_it_is_and_why():
    settings = list(settings_with_text())
    assert len(settings) > 100
    assert [name for _, name, own, _ in settings if len(own.split()) < 5] == []
    unfounded = [name for _, name, own, shared in settings if not any(s in own + shared for s in SOURCES)]
    assert unfounded == []


def test_every_group_is_read_here():
    whole = {field.name: getattr(GateSettings(), field.name) for field in fields(GateSettings)}
    wheels = whole.pop("wheel_speed")
    groups = whole | {f"wheel_speed.{field.name}": getattr(wheels, field.name) for field in fields(wheels)}
    assert {type(group).__name__ for group in groups.values()} == {
        owner for owner, *_ in settings_with_text()
    }
    assert all(is_dataclass(group) or isinstance(group, tuple) for group in groups.values())


def numbers_in(node: ast.expr) -> bool:
    """Whether an assigned value is a number or an array or tuple of numbers."""
    return any(isinstance(x, ast.Constant) and isinstance(x.value, int | float) for x in ast.walk(node))


def test_no_threshold_stands_beside_the_settings():
    """Module constants and default arguments of the rooms that decide; ``model`` has constants of motion."""
    found = set()
    for path, tree in trees("estimation", "scan", "evidence", "search", "formula", "result"):
        for node in tree.body:
            if isinstance(node, ast.Assign) and numbers_in(node.value):
                found |= {f"{path.name}: {t.id}" for t in node.targets if isinstance(t, ast.Name)}
            if isinstance(node, ast.FunctionDef):
                defaults = [*node.args.defaults, *filter(None, node.args.kw_defaults)]
                if any(isinstance(d, ast.Constant) and isinstance(d.value, float) for d in defaults):
                    found.add(f"{path.name}: {node.name}()")
    assert {one for one in found if one.split(": ")[1] not in STRUCTURE} == set()


def test_every_setting_is_read_somewhere():
    read = {node.attr for _, tree in trees(".") for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert {name for _, name, *_ in settings_with_text()} <= read


def test_changed_settings_act():
    log = synthesise("patrol", seed=2, duration_s=7.0).log
    with pytest.raises(InvalidSignal, match="200 are needed"):
        bin_log(log, GateSettings())
    short = replace(GateSettings(), bins=replace(GateSettings().bins, least_rows=100, bin_s=0.05))
    binned = bin_log(log, short)
    assert len(binned) == pytest.approx(7.0 / 0.05, abs=2)
    assert len(binned.finer()) == pytest.approx(2 * len(binned), abs=2)
    assert binned.finer().settings is short


def test_options_carry_the_default_gates_and_compare_by_value():
    assert GapOptions() == GapOptions(gates=GateSettings())
    wide = replace(GateSettings(), placebo=replace(GateSettings().placebo, draws=19))
    assert GapOptions(gates=wide) != GapOptions()
    assert hash(GapOptions()) == hash(GapOptions())
