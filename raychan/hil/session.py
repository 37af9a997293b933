"""Hardware in the loop in real time: a ship's loop goes on, its scanner and instruments talk, and orders come back.

One thread waits for the next tick or byte, whichever is first. A scan that begins at t is whole one scan later, and all
that was measured at t leaves then. The loop works out the next scan between two ticks.
"""

from __future__ import annotations

import gc
import math
import select
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from raychan.hil.channel import Channel
from raychan.hil.geodesy import Origin
from raychan.hil.instruments import Instruments, Reading, ScannedShip, reading
from raychan.hil.lms import Scanner
from raychan.hil.orders import OrderReader
from raychan.hil.pacing import Schedule, run_first
from raychan.hil.scans import ScanValues
from raychan.hil.telegrams import Telegram, TelegramReader
from raychan.run.ship.loop import Frame
from raychan.run.ship.places import LostScans

SCANNER, POSITION, HEADING, ATTITUDE = "scanner", "position", "heading", "attitude"
CHANNELS = (SCANNER, POSITION, HEADING, ATTITUDE)
LONGEST_COMMAND = 64
"""Longest payload [bytes] of a command; a configuration has 35. Trades how long damaged bytes that promise more keep
the reader waiting; not measured."""
_SILENT = 0.2
"""Time [s] of silence after which half a telegram is given up; the longest takes 73 ms at 9600 baud. Not measured."""
_LOOK = 0.05
"""Time [s] between looks for a peer that has come back. Trades how soon against system calls; not measured."""
_RESTARTS = 1.0
"""Time [s] that the scanner takes to restart."""
_TOO_FAR = 2.0
"""Time [s] that the loop may owe while it runs before other programs; then it cannot keep up, and gives way to them."""
_LEAD_US, _GRID_US = 50_000, 100_000
"""Least time [us] before the start, and the grid of UTC [us] that it lies on: at 10 sentences a second all have times
of whole tenths, as a satellite receiver's."""


@dataclass
class HostTally:
    """What came from hosts: telegrams, orders, and of these how many the ship does not take."""

    telegrams: int = 0
    orders: int = 0
    orders_refused: int = 0


@dataclass
class Session:
    """A run in real time.

    Fields: loop of the ship; channels by name, one for each of CHANNELS; origin of the scene on the globe; rate [1/s]
    of the sentences; tell is called with each reading whose sentences were sent; behind and most_behind, scans that the
    loop owes; longest_step [s] that it took for one; first, whether it runs before other programs; ended says why the
    run ended, failed whether the ship could not sail on. `scanner` is the scanner's end of the line. A run leaves its
    `ticks` of scans, `cycles` of sentences, `instruments` and `seconds`.
    """

    loop: ScannedShip
    channels: dict[str, Channel]
    origin: Origin
    rate: float
    tell: Callable[[Instruments, Reading], None] = lambda instruments, at: None
    host: HostTally = field(default_factory=HostTally)
    first: bool = False
    behind: int = 0
    most_behind: int = 0
    longest_step: float = 0.0
    ended: str = ""
    failed: bool = False

    def __post_init__(self) -> None:
        self.commands = TelegramReader(LONGEST_COMMAND)
        self.lost = LostScans()
        self.orders = {name: OrderReader() for name in CHANNELS if name != SCANNER}
        self._whole = self._older = self._newer = self.loop.step_scan()
        fan, baud = self.loop.scene.scanner, self.channels[SCANNER].line.baud
        self.scanner = Scanner(
            lambda: scan_values(self._whole), round(fan.fan_deg), fan.step_deg, baud=baud, set_variant=self._set_fan,
            mirror_hz=fan.mirror_hz,
        )  # fmt: skip
        self._heard_at = self._look_at = -math.inf
        self._restart_at = math.inf
        self._gave_back = False

    def run(self, duration: float, stopped: Callable[[], bool]) -> None:
        """Run for a duration [s] of real time, or until `stopped`, or to the end of logged poses."""
        self._warm_up()
        gc.collect()
        gc.freeze()  # what is there now stays; collections look only at what is new
        scan_time = self.loop.scene.scanner.duration
        start, epoch = _start()
        self.instruments = Instruments(self.origin, epoch)
        self.ticks = Schedule(start + scan_time, scan_time)
        self.cycles = Schedule(start + scan_time, 1.0 / self.rate)
        end = start + scan_time + duration
        while not self.ended:
            now = time.monotonic()
            self._look(now)
            if now >= self.ticks.due:
                self._tick(now)
            if now >= self.cycles.due and self._reached():
                self._cycle(now)
            for channel in self.channels.values():
                channel.pump(now)
            if self.behind:
                self._step()
            self._wait(end)
            if stopped():
                self.ended = "stopped"
            elif time.monotonic() >= end and not self.ended:
                self.ended = "duration"
        self.seconds = time.monotonic() - start
        gc.unfreeze()

    def _warm_up(self) -> None:
        """Do once what every tick does: the first time imports modules, which takes longer than a scan."""
        at, instruments = reading(self._older, self._newer, 0.0), Instruments(self.origin, datetime.now(UTC))
        for sentences in (instruments.position, instruments.heading, instruments.attitude):
            sentences(at)
        self.scanner.scan()

    def _tick(self, now: float) -> None:
        due = self.ticks.due
        self._whole = self._newer
        # After a change of the fan the scan that had begun is of the old one.
        if self.scanner.streaming and len(self._whole.scan.range) == self.loop.scene.scanner.count:
            self.channels[SCANNER].frame(now, due, self.scanner.scan())
        self.behind += 1 + self.ticks.tick(now)
        self.most_behind = max(self.most_behind, self.behind)
        if self.first and self.behind * self.ticks.period > _TOO_FAR:
            self.first = run_first(False)

    def _step(self) -> None:
        """Work out one scan of those that the loop owes."""
        if not self.loop.steerable and self.loop.done:
            self.ended = "end of the logged poses"
            return
        began = time.monotonic()
        try:
            self._older, self._newer = self._newer, self.loop.step_scan()
            self.lost.add(self._newer.lost_in, self._newer.time)
        except (ValueError, OverflowError) as error:
            self._give_back(error)
            return
        self._gave_back = False
        self.behind -= 1
        self.longest_step = max(self.longest_step, time.monotonic() - began)

    def _give_back(self, error: Exception) -> None:
        """Take the host's orders away where the model does not hold under them; end where it still does not."""
        if self._gave_back or not self.loop.steerable:
            self.ended = f"the ship cannot sail on after {self.loop.now:.2f} s: {error}"
            self.failed = True
            return
        self.loop.order()
        self.host.orders_refused += 1
        self._gave_back = True

    def _reached(self) -> bool:
        """Whether the loop has come to the time of the sentences that are due, or is so late that it will not soon."""
        moved = self._newer is not self._older
        return moved and (self.behind > 1 or self._newer.time >= self.cycles.due - self.cycles.start)

    def _cycle(self, now: float) -> None:
        """Send the sentences of a time that lies between the last two frames."""
        due = self.cycles.due
        when = min(due - self.cycles.start, self._newer.time)
        self.cycles.tick(now)
        at = reading(self._older, self._newer, when)
        for name, sentences in (
            (POSITION, self.instruments.position),
            (HEADING, self.instruments.heading),
            (ATTITUDE, self.instruments.attitude),
        ):
            self.channels[name].frame(now, due, sentences(at))
        self.tell(self.instruments, at)

    def _wait(self, end: float) -> None:
        """Wait for the next thing to do, and take what hosts have sent."""
        here = [c for c in self.channels.values() if c.port.here]
        blocked = [c.port for c in here if c.blocked]
        until = min(self.ticks.due, self.cycles.due, end, self._look_at, *(c.due for c in here))
        pause = 0.0 if self.behind else max(0.0, until - time.monotonic())
        readable, _, _ = select.select([c.port for c in here], blocked, [], pause)
        now = time.monotonic()
        for channel in here:
            if channel.port in readable:
                self._take(channel, channel.read(), now)

    def _take(self, channel: Channel, data: bytes, now: float) -> None:
        gone = not channel.port.here
        if channel.name == SCANNER:
            self._heard_at = now
            self._obey(self.commands.feed, data, now)
            if gone:
                self._obey(lambda data: self.commands.give_up(), data, now)
            return
        reader = self.orders[channel.name]
        for order in reader.feed(data):
            self.host.orders += 1
            try:
                self.loop.order(order.rudder, order.shaft)
            except ValueError:
                self.host.orders_refused += 1
        if gone:
            reader.give_up()

    def _obey(self, found: Callable[[bytes], list[Telegram]], data: bytes, now: float) -> None:
        """Answer the telegrams that bytes complete; a damaged one with NAK."""
        channel, damaged = self.channels[SCANNER], self.commands.damaged
        for telegram in found(data):
            self.host.telegrams += 1
            answer = self.scanner.answer(telegram)
            if answer:
                channel.answer(now, answer, self.scanner.baud, first=len(answer) > 1)
            if self.scanner.starting:
                self._restart_at = now + _RESTARTS
        if self.commands.damaged > damaged:
            channel.answer(now, self.scanner.refuse())

    def _look(self, now: float) -> None:
        """Look for peers, for a host that fell silent within a telegram, for a scanner that has restarted."""
        if now < self._look_at:
            return
        self._look_at = now + _LOOK
        for channel in self.channels.values():
            if not channel.port.here:
                channel.port.look(now)
        if self.commands.waiting and now - self._heard_at > _SILENT:
            self._obey(lambda data: self.commands.give_up(), b"", now)
        if now >= self._restart_at and self.scanner.starting:
            self._restart_at = math.inf
            self.channels[SCANNER].answer(now, self.scanner.started())

    def _set_fan(self, fan_deg: int, step_deg: float) -> bool:
        """Change the scanner's fan and step [deg]; the scan that has begun is still of the old ones."""
        before = self.loop.scene.scanner
        after = replace(before, fan_deg=float(fan_deg), step_deg=step_deg)
        self.loop.scan_with(after)
        self.ticks.change(self.ticks.due, after.duration)
        self.cycles.start += after.duration - before.duration
        return True


def _start() -> tuple[float, datetime]:
    """Return when the run starts, on the monotonic clock [s] and in UTC."""
    now, utc = time.monotonic(), datetime.now(UTC)
    wait = _LEAD_US + -(utc.microsecond + _LEAD_US) % _GRID_US
    return now + 1e-6 * wait, utc + timedelta(microseconds=wait)


def scan_values(frame: Frame) -> ScanValues:
    """Return the scan of a frame as a telegram's: without flags, which are not simulated."""
    return ScanValues(frame.scan.range, np.zeros(len(frame.scan.range), np.uint8))
