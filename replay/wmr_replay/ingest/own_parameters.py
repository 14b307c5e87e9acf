"""The robot's parameters out of a log's own metadata, of which every value is untrusted."""

from collections.abc import Mapping
from dataclasses import fields

from wmr_schemas.errors import InvalidFile
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.messages import METADATA_NAME
from wmr_schemas.robot import RobotParameters, out_of_sense

_LONGEST_SHOWN = 40


def own_parameters(record: Mapping[str, str]) -> tuple[RobotParameters, list[Finding]]:
    """The parameters that make sense, and a finding about each of the others, which count as unknown."""
    known: dict[str, str] = {}
    findings = []
    for key in (entry.name for entry in fields(RobotParameters)):
        if key not in record:
            continue
        if problem := what_is_wrong(key, record[key]):
            text = f"metadata record {METADATA_NAME}: {key}: {problem}"
            findings.append(finding("parameter_without_sense", Severity.WARNING, text))
        else:
            known[key] = record[key]
    return RobotParameters.from_metadata(known), findings


def what_is_wrong(key: str, text: str) -> str:
    """Why a value makes no sense as that parameter; empty when it does."""
    try:
        value = getattr(RobotParameters.from_metadata({key: text}), key)
    except InvalidFile:
        return f"{text[:_LONGEST_SHOWN]!r} is no number above 0"
    return out_of_sense(key, value)
