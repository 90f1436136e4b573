"""Delivery of events to a program's function: in order, beside everything else, with a bound that is said."""

import logging
import threading

import pytest

from coneskin.robot.guard.signals.journal import GuardEvent
from coneskin.session.event_delivery import EventDelivery
from coneskin.session.event_log import EventLog


def numbered(*numbers):
    return [GuardEvent("contact", float(number), {"number": number}) for number in numbers]


def test_every_event_comes_in_order_and_the_rest_at_the_end():
    seen = []
    delivery = EventDelivery(seen.append)
    for number in range(500):
        delivery.put(numbered(number))
    delivery.close()
    assert seen == numbered(*range(500))
    delivery.close()


def test_a_function_that_blocks_delays_nobody_and_is_told_what_it_has_missed(caplog):
    free, took, seen = threading.Event(), threading.Event(), []

    def block(event):
        took.set()
        free.wait(20.0)
        seen.append(event)

    delivery = EventDelivery(block, bound=5)
    delivery.put(numbered(0))
    assert took.wait(20.0)
    delivery.put(numbered(*range(1, 20)))  # returns, though nobody takes them
    with caplog.at_level(logging.WARNING, "coneskin"):
        free.set()
        delivery.close()
    assert seen[:6] == numbered(*range(6))
    (gap,) = seen[6:]
    assert "14 events were not delivered" in gap.details["what"]
    assert "14 events" in caplog.text


def test_one_that_raises_is_not_called_again_and_the_log_goes_on(caplog):
    seen = []

    def fail(event):
        seen.append(event)
        raise KeyError("mine")

    log = EventLog(on_event=fail)
    with caplog.at_level(logging.ERROR, "coneskin"):
        for event in numbered(1, 2, 3):
            log._write([event.block()])
        log.close()
    assert seen == numbered(1)
    assert [event.details["number"] for event in log.events] == [1, 2, 3]
    assert "is not called any more" in caplog.text


def test_the_function_itself_may_end_the_session():
    done = threading.Event()

    def close(event):
        delivery.close()
        done.set()

    delivery = EventDelivery(close)
    delivery.put(numbered(1))
    assert done.wait(20.0)


@pytest.mark.parametrize("request_", [3, 4])
def test_an_answer_is_known_by_its_number(request_):
    log = EventLog()
    log._write([GuardEvent("refused", 1.0, {"request": number}).block() for number in (3, 4)])
    log._write([GuardEvent("message", 1.0, {"what": "something else"}).block()])
    answer = log.wait_for(("activated", "refused"), 0.0, 0, lambda event: event.details.get("request") == request_)
    assert answer is not None
    assert answer.details["request"] == request_
