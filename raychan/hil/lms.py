"""What an LMS221-like scanner answers: modes, baud rates, variants, configuration, status, type, errors, restart.

Byte offsets count from the command byte. They follow what drivers of LMS2xx scanners read: sicktoolbox
(SickLMS2xx.cc), MRPT (CSickLaserSerial.cpp), ARIA (ArLMS2xx.cpp). Fields that none of them reads are 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from raychan.hil.scans import DISTANCE_BITS, MOST_BEAMS, UNITS_M, ScanValues, encode_scan
from raychan.hil.telegrams import ACK, HOST_TO_SCANNER, NAK, Telegram, frame
from raychan.sensors.laser import Scanner as Laser
from raychan.world.errors import SceneError

BAUD_CODES = {0x42: 9600, 0x41: 19200, 0x40: 38400, 0x48: 500000}
INSTALLATION, STREAM, ON_REQUEST, SUBRANGE, TURNS = 0x00, 0x24, 0x25, 0x27, 0x2A
"""Operating modes: configuration may be written; each scan is sent; scans are sent when asked for; some beams of each
scan are sent; each turn of the mirror is sent for itself."""
RESTART, MODE, POLL, STATUS, ERRORS, TYPE, VARIANT, CONFIGURATION, CONFIGURE = (
    0x10, 0x20, 0x30, 0x31, 0x32, 0x3A, 0x3B, 0x74, 0x77,
)  # fmt: skip
ANSWER = 0x80
"""Is added to a command to name its answer."""
RESTARTING, STARTED = 0x91, 0x90
PASSWORD = b"SICK_LMS"
NAME = b"LMS221;30206;V01.00"
"""Type and version. A driver looks for `LMS221;30206`, the outdoor model that measures to 80 m."""
STATUS_LENGTH = 152
STATUS_BYTE = 0x10
"""Last byte of each answer, without an error. MRPT takes a change of the baud rate for failed where it is 0."""
VARIANTS = {90: (25, 50, 100), 100: (25, 50, 100), 180: (25, 50, 100)}
"""Fans [deg], and the steps [deg/100] that each allows. The real scanner has no 180 deg in steps of 0.25 deg."""
_DIVIDED_HZ = 1e6
_MOST_TURNS = 0xFFFF  # a minute, of a mirror: what two bytes tell
_SET_LENGTH, _LEAST_SET = 34, 7


def check_sendable(scanner: Laser) -> list[str]:
    """Return lines on what the telegrams cannot tell of a scene's scanner. Raises: SceneError where a scan has more
    beams than a telegram holds."""
    if scanner.count > MOST_BEAMS:
        problem = f"a scan of {scanner.count:,} beams is longer than a telegram of the scanner"
        most = (MOST_BEAMS - 1) * scanner.step_deg
        allowed = f"a fan of {most:g} deg at most in steps of {scanner.step_deg:g} deg, or larger scanner.step_deg"
        raise SceneError(problem, key="scanner.fan_deg", value=scanner.fan_deg, allowed=allowed)
    said, whole = [], round(scanner.fan_deg)
    if whole != scanner.fan_deg:
        said.append(f"telegrams tell whole degrees: a fan of {whole} for {scanner.fan_deg:g} (scanner.fan_deg)")
    if 60.0 * scanner.mirror_hz > _MOST_TURNS:
        said.append(f"the status tells {_MOST_TURNS:,} turns of the mirror a minute at most (scanner.mirror_hz)")
    return said


def refuse_variant(fan_deg: int, step_deg: float) -> bool:
    """Return False: the variant stays as it is."""
    return False


@dataclass
class Scanner:
    """The scanner's end of the line: keeps its mode and answers commands.

    Fields: latest returns the last scan, of which range and flags count; angle_deg and step_deg of its fan; unit 0 (cm)
    or 1 (mm); baud of the line; refused telegrams that it answered with NAK; set_variant (fan [deg], step [deg]) tells
    whether the fan changed so; mirror_hz, turns of the mirror a second; mode of operation; starting whether STARTED is
    still to be sent after a restart.
    """

    latest: Callable[[], ScanValues]
    angle_deg: int = 180
    step_deg: float = 1.0
    unit: int = 0
    baud: int = 9600
    refused: int = 0
    set_variant: Callable[[int, float], bool] = refuse_variant
    mirror_hz: float = 75.0
    mode: int = ON_REQUEST
    measuring_mode: int = 0
    starting: bool = False
    _set: bytearray = field(default_factory=lambda: bytearray(_SET_LENGTH))
    _beams: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        self._start_baud = self.baud

    @property
    def streaming(self) -> bool:
        """Whether it sends each scan unasked."""
        return self.mode in (STREAM, SUBRANGE, TURNS)

    def answer(self, telegram: Telegram) -> bytes:
        """Return the bytes sent back: ACK and a telegram, or NAK for what is unknown; b"" if not addressed to it.

        A new baud rate holds once these bytes are sent: the answer goes out at the old one.
        """
        if telegram.address != HOST_TO_SCANNER:
            return b""
        command, rest = telegram.payload[0], telegram.payload[1:]
        if command == POLL:
            return bytes((ACK,)) + frame(encode_scan(self._stamped()))
        if command == RESTART:
            return bytes((ACK,)) + self._restart()
        body = self._body(command, rest)
        if body is None:
            return self.refuse()
        return bytes((ACK,)) + frame(bytes((command | ANSWER,)) + body + bytes((STATUS_BYTE,)))

    def refuse(self) -> bytes:
        """Return NAK, and count it: for a command that is unknown or came damaged."""
        self.refused += 1
        return bytes((NAK,))

    def started(self) -> bytes:
        """Return the telegram that ends a restart."""
        self.starting = False
        return frame(bytes((STARTED,)) + NAME + bytes((STATUS_BYTE,)))

    def scan(self) -> bytes:
        """Return the last scan as telegrams: one, or in mode TURNS one for each turn of the mirror."""
        whole = self._stamped()
        if self.mode == SUBRANGE:
            first, last = self._beams
            part = replace(whole, range_m=whole.range_m[first - 1 : last], fields=whole.fields[first - 1 : last])
            return frame(encode_scan(replace(part, first=first)))
        if self.mode != TURNS:
            return frame(encode_scan(whole))
        turns = round(1.0 / self.step_deg)
        each = (
            replace(whole, range_m=whole.range_m[k::turns], fields=whole.fields[k::turns], offset_deg=k * self.step_deg)
            for k in range(turns)
        )
        return b"".join(frame(encode_scan(one)) for one in each)

    def _stamped(self) -> ScanValues:
        bits = DISTANCE_BITS[self.measuring_mode]
        return replace(self.latest(), unit=self.unit, status=STATUS_BYTE, bits=bits)

    def _body(self, command: int, rest: bytes) -> bytes | None:
        """Return an answer between command and status byte; None for a command that is refused."""
        if command == MODE and rest:
            return self._switch(rest[0], rest[1:])
        if command == VARIANT and len(rest) == 4:
            return self._change_variant(int.from_bytes(rest[:2], "little"), int.from_bytes(rest[2:], "little"))
        if command == CONFIGURE:
            return self._configure(rest)
        fixed = {STATUS: self._status, ERRORS: bytes, TYPE: lambda: NAME, CONFIGURATION: self._configuration}
        return fixed[command]() if command in fixed else None

    def _switch(self, mode: int, rest: bytes) -> bytes | None:
        if rest and mode not in (INSTALLATION, SUBRANGE):
            return None
        if mode in BAUD_CODES:
            self.baud = BAUD_CODES[mode]
            return b"\x00"
        if mode == INSTALLATION and rest != PASSWORD:
            return b"\x01"
        if mode == SUBRANGE:
            first, last = int.from_bytes(rest[:2], "little"), int.from_bytes(rest[2:4], "little")
            if len(rest) != 4 or not 1 <= first <= last <= len(self.latest().range_m):
                return None
            self._beams = first, last
        if mode not in (INSTALLATION, STREAM, ON_REQUEST, SUBRANGE, TURNS):
            return None
        self.mode = mode
        return b"\x00"

    def _change_variant(self, angle: int, step: int) -> bytes:
        """Change the fan if it can be, and stop streaming, as the scanner does; return done or not, and the fan."""
        known = step in VARIANTS.get(angle, ())
        same = (angle, step) == (self.angle_deg, round(100.0 * self.step_deg))
        done = known and (same or self.set_variant(angle, step / 100.0))
        if done:
            self.angle_deg, self.step_deg, self.mode = angle, step / 100.0, ON_REQUEST
        return bytes((done,)) + self._fan()

    def _fan(self) -> bytes:
        return self.angle_deg.to_bytes(2, "little") + round(100.0 * self.step_deg).to_bytes(2, "little")

    def _configure(self, rest: bytes) -> bytes | None:
        """Take a configuration in installation mode; return done or not, and the configuration that holds."""
        if not _LEAST_SET <= len(rest) <= _SET_LENGTH:
            return None
        done = self.mode == INSTALLATION and rest[5] in DISTANCE_BITS and rest[6] < len(UNITS_M)
        if done:
            self._set[: len(rest)] = rest
            self.measuring_mode, self.unit = rest[5], rest[6]
        return bytes((done,)) + self._configuration()

    def _configuration(self) -> bytes:
        self._set[5:7] = bytes((self.measuring_mode, self.unit))
        return bytes(self._set)

    def _restart(self) -> bytes:
        """Go back to the baud rate and the mode of the start; what was configured stays."""
        self.mode, self.baud, self.starting = ON_REQUEST, self._start_baud, True
        return frame(bytes((RESTARTING, STATUS_BYTE)))

    def _status(self) -> bytes:
        p = bytearray(STATUS_LENGTH)
        p[1:8] = b"V01.00 "
        p[8] = self.mode
        p[67:69] = min(round(60.0 * self.mirror_hz), _MOST_TURNS).to_bytes(2, "little")  # mirror [turns/min]
        p[102] = self.measuring_mode
        p[107:111] = self._fan()
        p[116:118] = (0x8000 | int(_DIVIDED_HZ / self.baud) - 1).to_bytes(2, "little")
        p[122] = self.unit
        p[124:131] = b"V01.00 "
        return bytes(p[1:-1])
