"""The proof of a model on another log: read it, simulate it with both models, and add what that shows."""

from dataclasses import asdict, dataclass, replace

import msgspec

from wmr_replay.gap import GapOptions
from wmr_replay.gap.result.elsewhere import Elsewhere, elsewhere
from wmr_replay.gap.wheel_speed.elsewhere import elsewhere_on_wheels
from wmr_replay.ingest import Between, LogPath
from wmr_replay.ingest.tracks import Progress, WholeLog, read_whole
from wmr_replay.jobs.base_model import check_same_robot
from wmr_replay.jobs.data_quality import checked_findings
from wmr_replay.jobs.gap import TRY_LONGER, GapRun, errors_naming, robot_of
from wmr_replay.jobs.gap_document import plain
from wmr_replay.jobs.gap_traces import traces_frame
from wmr_replay.jobs.measured_poses import with_measured_poses
from wmr_replay.jobs.wheel_speed import Request
from wmr_schemas.gap_file import Proof
from wmr_schemas.mapping_file import LogMapping


@dataclass(frozen=True)
class Wanted:
    """A proof that is wanted: on which log, and how it is read."""

    path: LogPath
    request: Request
    options: GapOptions
    mode_topic: str | None
    progress: Progress | None

    def whole(self, *, on_wheels: bool) -> WholeLog:
        """The other log. Raises LogUnusable."""
        if on_wheels:
            return self.request.read(self.path, self.progress)
        return read_whole(
            self.path,
            self.request.mapping or LogMapping(),
            Between(),
            self.mode_topic,
            self.progress,
            clock_offset_s=self.request.clock_offset_s,
        )


def proven(run: GapRun, wanted: Wanted) -> GapRun:
    """The analysis with its proof on another log. Raises LogUnusable."""
    on_wheels = run.result.base_model == "wheel_speed"
    whole = wanted.whole(on_wheels=on_wheels)
    check_same_robot(wanted.path, whole.log.robot, run.result.model)
    checked_findings(wanted.path, whole, robot_of(whole.log, run.base))
    whole = with_measured_poses(whole)
    with errors_naming(wanted.path, TRY_LONGER):
        found = compared(run, whole, wanted, on_wheels=on_wheels)
    document = msgspec.structs.replace(run.document, proof=proof_of(found, wanted.path, whole.sha256))
    return replace(run, document=document, proof=traces_frame(found.traces))


def compared(run: GapRun, whole: WholeLog, wanted: Wanted, *, on_wheels: bool) -> Elsewhere:
    """Both models on the other log. Raises InvalidSignal."""
    known = () if run.base is None else run.base.effects
    options = wanted.options if wanted.mode_topic is None else replace(wanted.options, modes="given")
    if on_wheels:
        driven_by = "command" if wanted.request.commands else "wheel_speed"
        return elsewhere_on_wheels(whole.log, known, run.result.model, options, driven_by)
    return elsewhere(whole.log, known, run.result.model, options)


def proof_of(found: Elsewhere, path: LogPath, sha256: str) -> Proof:
    """What gap.json says of it."""
    contents = {
        "log": str(path),
        "log_sha256": sha256,
        "gap": asdict(found.position) | {"yaw": asdict(found.yaw)},
        "left_out": found.left_out,
    }
    return msgspec.json.decode(msgspec.json.encode(contents, enc_hook=plain), type=Proof)
