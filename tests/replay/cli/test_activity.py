"""What is said of the work that goes on: at a terminal, in a pipe, and the time that is left."""

import io
import sys
import time

import pytest

from wmr_replay.cli import activity, verbosity
from wmr_replay.cli.activity import Activity, Stage, bar_line, clock, plain_line
from wmr_replay.cli.printing.progress import TimeLeft, batch_progress, byte_progress


class Stream(io.StringIO):
    """Standard error, at a terminal or not."""

    def __init__(self, at_terminal):
        super().__init__()
        self._at_terminal = at_terminal

    def isatty(self):
        return self._at_terminal

    def until(self, text):
        """Wait until a text stands there."""
        end_s = time.monotonic() + 20
        while text not in self.getvalue():
            assert time.monotonic() < end_s, self.getvalue()
            time.sleep(0.005)


@pytest.fixture
def stderr(monkeypatch, request):
    stream = Stream(request.param)
    stream.use = lambda: monkeypatch.setattr(sys, "stderr", stream)  # in the test: pytest sets its own before
    monkeypatch.delenv(activity.VARIABLE, raising=False)
    for name in ("FIRST_S", "EVERY_S", "QUIET_S"):
        monkeypatch.setattr(activity, name, 0.02)
    yield stream
    verbosity.speak_normally()


@pytest.mark.parametrize("stderr", [True], indirect=True)
def test_a_terminal_shows_every_stage_at_once_and_the_line_goes(stderr):
    stderr.use()
    with activity.activity():
        stderr.until("loading  0 s")
        with byte_progress("reading a.mcap", "writing") as tell:
            stderr.until("reading a.mcap  0 s")
            tell(25, 100)
            stderr.until("reading a.mcap  [#####...............]  25%")
            tell(100, 100)
            stderr.until("writing  0 s")
        assert stderr.getvalue().endswith(activity.ERASE)


@pytest.mark.parametrize("stderr", [False], indirect=True)
def test_a_pipe_gets_one_line(stderr):
    stderr.use()
    with activity.activity():
        activity.tell("reading a.mcap", 1, 4)
        stderr.until("\n")
        activity.stop()
        activity.tell("something else")
        time.sleep(0.06)
    assert stderr.getvalue() == "reading a.mcap, 25% …\n"


@pytest.mark.parametrize("stderr", [False], indirect=True)
@pytest.mark.parametrize("variable", ["never", None])
def test_nothing_is_said_of_short_work_or_where_it_is_not_wanted(stderr, variable, monkeypatch):
    stderr.use()
    monkeypatch.setattr(activity, "QUIET_S", 0.02 if variable else 60)
    if variable:
        monkeypatch.setenv(activity.VARIABLE, variable)
    with activity.activity():
        time.sleep(0.06)
    assert stderr.getvalue() == ""


@pytest.mark.parametrize("stderr", [True, False], indirect=True)
def test_verbose_is_a_line_for_each_stage(stderr):
    stderr.use()
    verbosity.speak(verbosity.Level.VERBOSE)
    with activity.activity():
        for share in (0.1, 0.2):
            activity.tell("simulating", share, 1)
        activity.tell("fitting")
    lines = [line.split(" s  ")[1] for line in stderr.getvalue().splitlines()]
    assert lines == ["simulating", "fitting"]


@pytest.mark.parametrize("stderr", [True], indirect=True)
def test_the_line_is_never_wider_than_the_terminal(stderr, monkeypatch):
    stderr.use()
    monkeypatch.setenv("COLUMNS", "40")
    work = Activity()
    work.tell("x" * 100, 1, 2)
    work._draw()
    assert len(stderr.getvalue().removeprefix(activity.ERASE)) < 40


def test_time_left_follows_from_share_and_time_spent():
    stage = Stage("reading", 30, 120, since_s=100.0)
    assert stage.left_s(110.0) == pytest.approx(30)
    assert bar_line(stage, 110.0) == "reading  [#####...............]  25%  10 s  about 30 s left"
    assert stage.left_s(100.5) is None
    assert Stage("x", 1, 120, since_s=0.0).left_s(60.0) is None
    assert plain_line(Stage("loading")) == "loading"


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (59.4, "59 s"), (60, "1:00"), (185, "3:05"), (7385, "2:03:05")]
)
def test_times_are_read_at_a_glance(seconds, text):
    assert clock(seconds) == text


def test_a_failed_or_skipped_log_says_nothing_of_the_time_left():
    now = [0.0]
    left = TimeLeft(lambda: now[0])
    now[0] = 0.1
    left.ended(900, replayed=False)
    assert left.left_s(1900) is None
    now[0] = 10.1
    left.ended(1400, replayed=True)
    assert left.left_s(1900) == pytest.approx(10.1)
    now[0] = 20.1
    left.ended(1900, replayed=True)
    assert left.left_s(1900) == 0


@pytest.mark.parametrize("stderr", [False], indirect=True)
def test_lines_of_a_batch_keep_a_sane_time_after_a_failed_log(stderr, monkeypatch):
    stderr.use()
    from wmr_replay.api.batch import Outcome

    now = iter([0.0, 0.0, 20.0, 40.0])
    monkeypatch.setattr("wmr_replay.cli.printing.progress.TimeLeft", lambda: TimeLeft(lambda: next(now)))
    with batch_progress() as tell:
        tell(None, 0, 400)
        tell(Outcome("bad.mcap", problem="broken"), 200, 400)
        tell(Outcome("a.mcap"), 300, 400)
        tell(Outcome("b.mcap"), 400, 400)
    assert stderr.getvalue().splitlines() == [
        " 50%  failed: bad.mcap",
        " 75%  done: a.mcap  (about 20 s left)",
        "100%  done: b.mcap",
    ]
