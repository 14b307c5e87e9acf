"""Writes the tables of the schema pages from the code, between ``<!-- begin NAME -->`` and its ``end``, and
the JSON Schema of gap.json.

Run it after a change of columns, parameters or effects: ``python docs/make_schema_pages.py``. With
``--check`` it writes nothing and names the pages that are out of date.
"""

import json
import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

from wmr_schemas import gap_file
from wmr_schemas.effects import BEYOND, BaseModel, effects_of
from wmr_schemas.findings import KINDS
from wmr_schemas.gap_file import gap_schema
from wmr_schemas.mapping_file import PoseFields, TorqueFields, TruthFields
from wmr_schemas.model_file import NoiseModel, Provenance
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import STATUS_MEANING
from wmr_schemas.tables import CONFUSION, GAP_TRACES, HINDSIGHT, SAMPLES, SEGMENTS, SUMMARY, TRUTH, Column
from wmr_schemas.wheel_fields import CommandFields, WheelSpeedFields
from wmr_synth.hidden.drawing import describe_range
from wmr_synth.hidden.registry import words_of

DOCS = Path(__file__).parent
GAP_SCHEMA = Path(gap_file.__file__).with_name(gap_file.SCHEMA_NAME)
BLOCK = re.compile(r"(<!-- begin (\w+) -->\n)(.*?)(<!-- end \2 -->)", re.DOTALL)


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table; a bar inside a cell is escaped."""
    lines = [head, ("---",) * len(head), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)


def code(text: str) -> str:
    """As code."""
    return f"`{text}`"


def columns(listed: tuple[Column, ...]) -> str:
    """The columns of a result table."""
    head = ("column", "type", "unit", "meaning")
    rows = ((code(c.name), str(c.dtype).partition("(")[0], c.unit, c.meaning) for c in listed)
    return table(head, rows)


def keys(record: type) -> str:
    """The fields of a dataclass that describes its fields."""
    described = ((f.name, f.metadata) for f in fields(record))
    return table(("key", "unit", "meaning"), ((code(n), m["unit"], m["meaning"]) for n, m in described))


def further(record: type) -> str:
    """The fields of a mapping section's record, with the type that the file holds."""
    described = ((f.name, f.metadata) for f in fields(record))
    return table(("key", "type", "meaning"), ((code(n), m["unit"], m["meaning"]) for n, m in described))


def modes() -> str:
    """The contact modes."""
    bits = {mode: code(f"{mode.bit:#06b}") if mode >= 0 else "–" for mode in ContactMode}
    rows = ((str(int(mode)), code(mode.label), bits[mode]) for mode in ContactMode)
    return table(("number", "label", "bit in `mode_set`"), rows)


def statuses() -> str:
    """The outcomes of a row."""
    return table(("status", "meaning"), ((code(s.label), meaning) for s, meaning in STATUS_MEANING.items()))


def findings() -> str:
    """The kinds of findings on a log's data."""
    head = ("finding", "what it means", "what to do", "status of barred rows", "not told beside")
    rows = (
        (
            code(kind.code),
            kind.meaning,
            kind.advice,
            "–" if kind.bars is None else code(kind.bars.label),
            ", ".join(map(code, kind.explained_by)) or "–",
        )
        for kind in KINDS.values()
    )
    return table(head, rows)


def effects(base: BaseModel) -> str:
    """The effects of a base model."""
    forms = effects_of(base).values()
    units = {form.name: ", ".join(f"`{key}` ({unit})" for key, unit in form.units.items()) for form in forms}
    rows = ((code(form.name), form.channel, form.formula_of(base), units[form.name]) for form in forms)
    return table(("name", "acts on", "form", "parameters (unit)"), rows)


def hidden(base: BaseModel) -> str:
    """The effects that the simulator can hide on a base model."""
    beyond = {name: effect for name, effect in BEYOND.items() if base in effect.models}
    rows = (
        (
            code(name),
            words_of(name, base),
            ", ".join(f"{code(key)} {describe_range(within)}" for key, within in effect.ranges.items()),
        )
        for name, effect in (effects_of(base) | beyond).items()
    )
    return table(("name", "form in the simulator", "range of a bare name"), rows)


def gap() -> str:
    """The tables of gap.json, out of its JSON Schema."""
    tables = gap_schema()["$defs"]
    return "\n".join(gap_table(name, tables[name]) for name in tables)


def gap_table(name: str, schema: dict[str, Any]) -> str:
    """One table of gap.json: key, kind, meaning."""
    listed = schema["properties"].items()
    rows = ((code(key), kind(form), form.get("description", "–")) for key, form in listed)
    return f"### {name}\n\n{schema['description']}\n\n" + table(("key", "type", "meaning"), rows)


def kind(form: dict[str, Any]) -> str:
    """The type of a JSON value in a word or two; tables by their name."""
    if "$ref" in form:
        return form["$ref"].rpartition("/")[2]
    if "enum" in form:
        return ", ".join(code(value) for value in form["enum"])
    if "anyOf" in form:
        return " or ".join(kind(choice) for choice in form["anyOf"])
    if form["type"] == "array":
        inside = form["prefixItems"] if "prefixItems" in form else [form["items"]]
        return f"[{', '.join(map(kind, inside))}{'' if 'prefixItems' in form else ', …'}]"
    if form["type"] == "object":
        return f"{{name: {kind(form['additionalProperties'])}}}"
    return str(form["type"])


BLOCKS: dict[str, Callable[[], str]] = {
    "samples": lambda: columns(SAMPLES),
    "hindsight": lambda: columns(HINDSIGHT),
    "segments": lambda: columns(SEGMENTS),
    "summary": lambda: columns(SUMMARY),
    "confusion": lambda: columns(CONFUSION),
    "truth": lambda: columns(TRUTH),
    "gap_traces": lambda: columns(GAP_TRACES),
    "robot": lambda: keys(RobotParameters),
    "pose_fields": lambda: further(PoseFields),
    "torque_fields": lambda: further(TorqueFields),
    "truth_fields": lambda: further(TruthFields),
    "wheel_fields": lambda: further(WheelSpeedFields),
    "command_fields": lambda: further(CommandFields),
    "noise": lambda: keys(NoiseModel),
    "provenance": lambda: keys(Provenance),
    "modes": modes,
    "statuses": statuses,
    "findings": findings,
    "effects": lambda: effects("torque"),
    "wheel_speed_effects": lambda: effects("wheel_speed"),
    "hidden": lambda: hidden("torque"),
    "hidden_wheel_speed": lambda: hidden("wheel_speed"),
    "gap": gap,
}


def filled(text: str) -> str:
    """The page with its tables as the code has them now. Raises KeyError for an unknown table."""
    return BLOCK.sub(lambda block: f"{block[1]}\n{BLOCKS[block[2]]()}\n{block[4]}", text)


def outdated(docs: Path = DOCS) -> dict[Path, str]:
    """The pages that should read otherwise, and how; with our own ones the JSON Schema in the package."""
    pages = {path: path.read_text(encoding="utf-8") for path in sorted(docs.rglob("*.md"))}
    wanted = {path: filled(text) for path, text in pages.items()}
    if docs == DOCS:
        pages[GAP_SCHEMA] = GAP_SCHEMA.read_text(encoding="utf-8") if GAP_SCHEMA.exists() else ""
        wanted[GAP_SCHEMA] = json.dumps(gap_schema(), indent=2, ensure_ascii=False) + "\n"
    return {path: text for path, text in wanted.items() if text != pages[path]}


def main() -> None:
    """Write the pages, or say which are out of date."""
    pages = outdated()
    if "--check" in sys.argv[1:]:
        sys.exit("\n".join(f"out of date: {path}" for path in pages) or None)
    for path, text in pages.items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
