"""Named, versioned sets of logs: what they hold, how they are written, and the manifest that describes them.

``definition`` says what a set is, ``catalogue`` names ours, ``own`` reads a user's file, ``damage`` breaks
files on purpose, ``writer`` writes sets and ``manifest`` says and checks what was written.
"""

from wmr_synth.suites.catalogue import SUITES, find_suite
from wmr_synth.suites.definition import LogSpec, Suite
from wmr_synth.suites.manifest import MANIFEST, Manifest, read_manifest
from wmr_synth.suites.own import read_suite
from wmr_synth.suites.writer import write_log, write_suite

__all__ = [
    "MANIFEST",
    "SUITES",
    "LogSpec",
    "Manifest",
    "Suite",
    "find_suite",
    "read_manifest",
    "read_suite",
    "write_log",
    "write_suite",
]
