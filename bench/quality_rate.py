"""What is told of skids and slips at low rates of the pose: from which rate on is it better than nothing?

    python bench/quality_rate.py [--logs 12]

By rate: rows right, wrong and undecided; of the rows told as skids and as slips, the share that are; and the
share of rows right if every row were called ideal.
"""

import argparse

import numpy as np
from quality_logs import clean_log

from wmr_replay.pipeline.memory import replay_columns
from wmr_replay.quality import rate
from wmr_schemas.modes import ContactMode
from wmr_schemas.status import Status

RATES_HZ = (1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0)
FAMILIES = ("patrol", "stop-go", "teleoperated", "friction-limit")


def told(family: str, noise: str, seed: int, rate_hz: float) -> np.ndarray:
    """Mode and true mode (2, n) of the rows after warm-up."""
    batches = replay_columns(clean_log(family, seed, noise=noise, rate_hz=rate_hz))
    mode, true, status = (np.concatenate([b[k] for b in batches]) for k in ("mode", "mode_true", "status"))
    return np.stack([mode, true])[:, (status != Status.WARMING_UP) & (true >= 0)]


def main() -> None:
    """Print the table; nothing is barred while it is measured."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=3, help="per family and noise")
    n_logs = parser.parse_args().logs
    rate.LONGEST_STEP_S = np.inf
    print(f"{'Hz':>4}{'right':>8}{'wrong':>8}{'none':>8}{'skids':>8}{'slips':>8}{'ideal':>8}")
    for rate_hz in RATES_HZ:
        cases = [(f, n, s) for f in FAMILIES for n in ("mocap", "rtk") for s in range(n_logs)]
        mode, true = np.concatenate([told(*case, rate_hz) for case in cases], axis=1)
        shares = [np.mean(mode == true), np.mean((mode != true) & (mode >= 0)), np.mean(mode < 0)]
        shares += [np.mean(true[mode == m] == m) for m in (ContactMode.SKIDDING, ContactMode.SLIPPING)]
        shares += [np.mean(true == ContactMode.IDEAL)]
        print(f"{rate_hz:>4g}" + "".join(f"{share:>8.3f}" for share in shares), flush=True)


if __name__ == "__main__":
    main()
