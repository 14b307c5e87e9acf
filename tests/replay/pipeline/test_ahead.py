"""Items made in a thread ahead: their order, errors, and an early stop."""

import threading
import time

import pytest

from wmr_replay.pipeline.ahead import ahead


def test_items_come_in_their_order_and_are_made_in_one_other_thread():
    made_in = set()

    def items():
        for k in range(50):
            made_in.add(threading.get_ident())
            yield k

    assert list(ahead(items())) == list(range(50))
    assert len(made_in) == 1
    assert threading.get_ident() not in made_in


def test_one_item_is_made_while_another_is_used_and_no_more():
    made = []
    items = ahead(made.append(k) or k for k in range(9))
    assert next(items) == 0
    time.sleep(0.05)
    assert made == [0, 1]
    items.close()


def test_an_error_is_raised_in_its_place():
    def items():
        yield 1
        raise OSError("unreadable")

    got = ahead(items())
    assert next(got) == 1
    with pytest.raises(OSError, match="unreadable"):
        next(got)


def test_who_stops_early_leaves_no_thread_behind():
    before, closed = threading.active_count(), []

    def items():
        try:
            yield from range(9)
        finally:
            closed.append(True)

    got = ahead(items())
    assert next(got) == 0
    got.close()
    del got
    assert closed
    assert threading.active_count() == before
