"""The robot's parameters out of a log's own metadata, of which every value is untrusted."""

from collections.abc import Mapping
from dataclasses import fields

from wmr_schemas.errors import InvalidFile
from wmr_schemas.messages import METADATA_NAME
from wmr_schemas.robot import RobotParameters

LEAST, MOST = 1e-9, 1e12
"""No parameter of a wheeled robot in its unit lies outside; the largest are stiffnesses over ε, below 1e9."""
_LONGEST_SHOWN = 40


def own_parameters(record: Mapping[str, str]) -> tuple[RobotParameters, list[str]]:
    """The parameters that make sense, and a sentence about each of the others, which count as unknown."""
    known: dict[str, str] = {}
    notes = []
    for key in (entry.name for entry in fields(RobotParameters)):
        if key in record:
            problem = what_is_wrong(key, record[key])
            if problem:
                notes.append(f"metadata record {METADATA_NAME}: {key}: {problem}; it is taken as unknown")
            else:
                known[key] = record[key]
    return RobotParameters.from_metadata(known), notes


def what_is_wrong(key: str, text: str) -> str:
    """Why a value makes no sense as that parameter; empty when it does."""
    try:
        value = getattr(RobotParameters.from_metadata({key: text}), key)
    except InvalidFile:
        return f"{text[:_LONGEST_SHOWN]!r} is not a number above 0"
    if isinstance(value, float) and not LEAST <= value <= MOST:
        return f"{value:g} lies outside {LEAST:g} to {MOST:g}"
    return ""
