"""Each frame that a channel is given is sent, or is dropped and counted; answers come before the next frame."""

import math

import numpy as np
import pytest

from raychan.hil.channel import Channel
from raychan.hil.pacing import Lateness, line_time


class FakePort:
    """A peer that comes, goes, and reads as much as it likes."""

    name, paced, unread, reconnects = "fake", False, 0, 0

    def __init__(self):
        self.here, self.room, self.got, self.leaves = True, math.inf, b"", False
        self.baud = None

    def write(self, data):
        if self.leaves:
            self.here = self.leaves = False
            return 0
        part = data[: int(min(self.room, len(data)))]
        self.room -= len(part)
        self.got += part
        return len(part)

    def read(self):
        return b""

    def set_baud(self, baud):
        self.baud = baud


def total(channel):
    t = channel.tally()
    return t.sent + t.busy + t.no_peer + t.not_reading + t.unfinished


@pytest.mark.parametrize("seed", range(20))
def test_every_frame_is_sent_or_counted_and_none_is_cut(seed):
    rng, port = np.random.default_rng(seed), FakePort()
    channel, frame = Channel("x", port, 38400), b"\x02" + b"." * 98 + b"\x03"
    for k in range(2000):
        now, event = k / 75.0, rng.integers(12)
        if event == 0:
            port.here = not port.here
            if not port.here:
                channel.read()
                port.got = port.got[: len(port.got) // 100 * 100]  # a peer that goes loses what it has begun
        elif event == 1:
            port.room = int(rng.integers(0, 300))
        elif event == 2:
            port.room = math.inf
        elif event == 3 and port.here:
            port.leaves = True
        channel.frame(now, now, frame)
        for part in rng.uniform(0.0, 1 / 75.0, 3).cumsum():
            channel.pump(now + part)
        if not port.here:
            port.got = port.got[: len(port.got) // 100 * 100]
    port.here, port.room = True, math.inf
    channel.pump(1e9)
    tally = channel.tally()
    assert tally.made == 2000 == total(channel) and tally.sent > 100
    assert port.got == frame * (len(port.got) // 100), "no half of a frame"
    assert tally.sent == len(port.got) // 100


def test_a_frame_leaves_when_its_last_byte_would():
    port = FakePort()
    channel = Channel("x", port, 38400)
    channel.frame(1.0, 1.0, bytes(372))
    end = 1.0 + line_time(372, 38400)
    assert channel.due == end
    channel.pump(end - 1e-6)
    assert port.got == b""
    channel.pump(end)
    assert len(port.got) == 372 and channel.lateness.timing().jitter_p99 == 0.0


def test_a_serial_port_paces_itself():
    port = FakePort()
    port.paced = True
    channel = Channel("x", port, 38400)
    channel.frame(1.0, 1.0, bytes(372))
    channel.pump(1.0)
    channel.frame(1.05, 1.05, bytes(372))
    assert len(port.got) == 372 and channel.tally().busy == 1


def test_an_answer_waits_for_the_frame_on_the_line_and_comes_before_the_next():
    port = FakePort()
    channel = Channel("x", port, 38400)
    channel.frame(0.0, 0.0, b"f" * 372)
    channel.answer(0.01, b"\x06answer", first=1)
    channel.frame(0.0134, 0.0134, b"g" * 372)
    channel.pump(0.0978)
    assert port.got == b"f" * 372 + b"\x06", "the ACK does not wait for the answer"
    channel.pump(0.1)
    assert port.got.endswith(b"\x06answer") and channel.tally().busy == 1 and channel.tally().answers == 1


def test_the_rate_changes_after_the_answer():
    port = FakePort()
    channel = Channel("x", port, 9600)
    channel.answer(0.0, bytes(96), baud=500_000)
    channel.pump(0.1)
    assert channel.line.baud == 9600 and len(port.got) == 96
    channel.pump(0.11)
    assert channel.line.baud == port.baud == 500_000


def test_a_host_that_asks_and_does_not_read_loses_answers_and_they_are_counted():
    port = FakePort()
    port.room = 10
    channel = Channel("x", port, 500_000)
    for k in range(1000):
        channel.answer(k * 0.01, bytes(158))
        channel.pump(k * 0.01 + 0.009)
    tally = channel.tally()
    assert tally.answers == 0 and tally.answers_dropped > 500
    port.room = math.inf
    channel.pump(1e9)
    assert channel.tally().answers + tally.answers_dropped == 1000


def test_lateness_of_a_long_run_is_kept_evenly():
    late = Lateness()
    for k in range(300_000):
        late.note(k * 1e-6)
    timing = late.timing()
    assert timing.ticks == 300_000
    assert timing.drift == pytest.approx(0.9 * 0.3, rel=1e-3) and timing.jitter_p99 == pytest.approx(0.1485, rel=1e-3)
