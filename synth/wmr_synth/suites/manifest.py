"""The manifest of a written suite: what every log is, and the sha256 of every file."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from wmr_schemas import __version__
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_synth.suites.damage import DAMAGES
from wmr_synth.suites.definition import LogSpec, Suite

MANIFEST = "manifest.json"
GENERATOR = f"wmr-replay {__version__}"
BLOCK_BYTES = 1 << 20


@dataclass(frozen=True)
class Manifest:
    """A suite as written with ``seed``; ``files`` maps each log's name to its files and their sha256."""

    suite: Suite
    seed: int
    generator: str
    files: Mapping[str, Mapping[str, str]]

    def to_json(self) -> str:
        """The text of ``manifest.json``; the same for the same files."""
        head = {"suite": self.suite.name, "version": self.suite.version, "seed": self.seed}
        head |= {"generator": self.generator, "description": self.suite.description}
        logs = [described(log, self.files[log.name]) for log in self.suite.logs]
        return json.dumps(head | {"logs": logs}, indent=2, ensure_ascii=False) + "\n"

    def describes(self, suite: Suite, seed: int) -> bool:
        """Whether this is that suite, written with that seed by this version."""
        return (self.suite, self.seed, self.generator) == (suite, seed, GENERATOR)

    def is_whole(self, directory: Path, log: LogSpec) -> bool:
        """Whether every file of the log lies in ``directory`` with the hash of the manifest."""
        files = self.files.get(log.name, {})
        return bool(files) and all(sha256_of(directory / name) == sha256 for name, sha256 in files.items())


def described(log: LogSpec, files: Mapping[str, str]) -> dict[str, Any]:
    """One log's entry: the specification, the sensors that follow from it, and the files."""
    entry: dict[str, Any] = {"name": log.name, "scenario": log.scenario, "seed": log.seed}
    entry |= {
        "parameters": dict(log.parameters),
        "duration_s": log.duration_s,
        "sensors": asdict(log.sensors()),
    }
    if log.damage is not None:
        damage = DAMAGES[log.damage]
        entry |= {"damage": log.damage, "meaning": damage.description, "expected": damage.expected()}
    return entry | {"files": dict(files)}


def read_manifest(directory: Path) -> Manifest | None:
    """The manifest in ``directory``; None without one. Raises InvalidFile where it cannot be understood."""
    path = directory / MANIFEST
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise InvalidFile(path, "", f"cannot be read as JSON ({error})") from None
    try:
        logs = tuple(
            LogSpec(e["name"], e["scenario"], e["seed"], e["parameters"], e.get("damage"))
            for e in content["logs"]
        )
        suite = Suite(content["suite"], content["version"], content["description"], logs)
        files = {entry["name"]: entry["files"] for entry in content["logs"]}
        return Manifest(suite, content["seed"], content["generator"], files)
    except (KeyError, TypeError, AttributeError, InvalidSetting) as error:
        raise InvalidFile(path, "", f"is no manifest of a suite that this version knows ({error})") from None


def sha256_of(path: Path) -> str | None:
    """The hash of a file; None where there is none."""
    if not path.is_file():
        return None
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()
