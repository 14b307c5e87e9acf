"""Rows that two monitors bar have the status of the cause, as the findings name the cause alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.quality import Quality
from wmr_schemas.findings import KINDS
from wmr_schemas.status import Status

ROWS = SimpleNamespace(t_ns=np.arange(6))
N = len(ROWS.t_ns)


class Fake:
    """A monitor that bars the same rows at every push."""

    def __init__(self, code: str, rows: slice, *, tells: bool = True) -> None:
        marked = np.zeros(N, bool)
        marked[rows] = True
        self.status = np.where(marked, KINDS[code].bars, Status.OK).astype(np.int8)
        self.barred = {code: marked} if tells else {}

    def push(self, rows: SimpleNamespace) -> np.ndarray:
        return self.status

    def findings(self) -> list:
        return []


def statuses(*monitors: Fake) -> list[Status]:
    return [Status(s) for s in Quality(monitors).push(ROWS)]


OK, HEADING, IMPLAUSIBLE = Status.OK, Status.NO_HEADING, Status.IMPLAUSIBLE


@pytest.mark.parametrize("turned", [False, True])
def test_the_cause_gives_the_status_whichever_monitor_comes_first(turned: bool) -> None:
    pair = [Fake("heading_not_along_path", slice(0, 4)), Fake("yaw_unit", slice(2, 5))]
    expected = [HEADING, HEADING, IMPLAUSIBLE, IMPLAUSIBLE, IMPLAUSIBLE, OK]
    assert statuses(*pair[:: -1 if turned else 1]) == expected


def test_what_is_no_cause_leaves_the_first_monitors_status() -> None:
    pair = Fake("no_heading", slice(0, 4)), Fake("yaw_unit", slice(2, 5))
    assert statuses(*pair) == [HEADING] * 4 + [IMPLAUSIBLE, OK]
    sign = Fake("no_heading", slice(1, 3)), Fake("torque_sign", slice(0, 4))
    for pair in (sign, sign[::-1]):
        assert statuses(*pair) == [IMPLAUSIBLE, HEADING, HEADING, IMPLAUSIBLE, OK, OK]


def test_rows_that_the_reader_bars_keep_its_status() -> None:
    reader = Fake("no_heading", slice(0, 3), tells=False)
    pair = Fake("heading_not_along_path", slice(0, 4)), Fake("yaw_unit", slice(0, 4))
    assert statuses(reader, *pair) == [HEADING] * 3 + [IMPLAUSIBLE, OK, OK]
