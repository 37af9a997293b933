"""Hosts for tests of `raychan hil`: a client of the scanner written after the telegram page alone, a reader of lines,
and the command as a process."""

import json
import os
import select
import signal
import subprocess
import sys
import termios
import time
import tty

from support.scene_texts import but_compiling

SCENE = """
[ship]
model = "container"

[sea]
reflectivity = 0.1

[[bodies]]
name = "quay"
shape = "box"
params = { length = 4000.0, width = 4.0, height = 20.0 }
position = [0.0, 40.0, 0.0]
"""
"""A container ship along a quay."""


def check_sum(data):
    """Return the check sum as the scanner's makers print it, in other steps than raychan's."""
    register, pair = 0, 0
    for byte in data:
        pair = (pair << 8 | byte) & 0xFFFF
        register = (register & 0x7FFF) << 1 ^ (0x8005 if register & 0x8000 else 0) ^ pair
    return register


def command(payload):
    """Return a telegram to the scanner. Args: payload in hexadecimal."""
    payload = bytes.fromhex(payload)
    body = b"\x02\x00" + len(payload).to_bytes(2, "little") + payload
    return body + check_sum(body).to_bytes(2, "little")


class End:
    """A peer's end of a line: opened raw, as drivers do."""

    def __init__(self, name):
        self.fd = os.open(name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.fd)
        self.data = b""

    def write(self, data):
        """Send bytes."""
        os.write(self.fd, data)

    def wait(self, seconds):
        """Read once what comes within a time; return whether anything came."""
        ready, _, _ = select.select([self.fd], [], [], seconds)
        if ready:
            self.data += os.read(self.fd, 65536)
        return bool(ready)

    def flush(self):
        """Throw away what has come, as drivers do before a command."""
        termios.tcflush(self.fd, termios.TCIOFLUSH)
        self.data = b""

    def lines(self, seconds):
        """Return the lines that end within a time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.wait(end - time.monotonic())
        *found, self.data = self.data.split(b"\r\n")
        return found

    def close(self):
        """Go away."""
        os.close(self.fd)


class LmsHost(End):
    """A client of the scanner: sends a command, waits for ACK and the answer; reads the stream."""

    bad = 0

    def ask(self, payload, within=3.0, answer=None):
        """Return the payload of the answer to a command, None after NAK. Raises: TimeoutError."""
        self.flush()
        self.write(command(payload))
        wanted, end, acknowledged = answer or int(payload[:2], 16) | 0x80, time.monotonic() + within, False
        while time.monotonic() < end:
            self.wait(max(0.0, end - time.monotonic()))
            while self.data and not acknowledged and self.data[:1] in b"\x06\x15":
                acknowledged, refused, self.data = True, self.data[:1] == b"\x15", self.data[1:]
                if refused:
                    return None
            telegram = self.telegram()
            while telegram is not None:
                if telegram[0] == wanted:
                    assert acknowledged, "no ACK before the answer"
                    return telegram
                telegram = self.telegram()
                acknowledged = acknowledged or self.data[:1] == b"\x06"
        raise TimeoutError(payload)

    def telegram(self):
        """Return the next whole telegram's payload, or None; a wrong check sum is counted."""
        while True:
            at = self.data.find(b"\x02\x80")
            if at < 0 or len(self.data) < at + 6:
                return None
            length = int.from_bytes(self.data[at + 2 : at + 4], "little")
            end = at + 4 + length
            if length > 2048:
                self.data, self.bad = self.data[at + 1 :], self.bad + 1
                continue
            if len(self.data) < end + 2:
                return None
            body, said = self.data[at:end], int.from_bytes(self.data[end : end + 2], "little")
            if check_sum(body) == said:
                if b"\x06" in self.data[:at]:
                    self.data = b"\x06" + self.data[end + 2 :]
                else:
                    self.data = self.data[end + 2 :]
                return body[4:]
            self.data, self.bad = self.data[at + 1 :], self.bad + 1

    def scans(self, seconds):
        """Return payloads of scans that come within a time."""
        end, found = time.monotonic() + seconds, []
        while time.monotonic() < end:
            self.wait(max(0.0, end - time.monotonic()))
            while (one := self.telegram()) is not None:
                found.append(one)
        return [p for p in found if p[0] in (0xB0, 0xB7)]


class Hil:
    """`raychan hil` as a process. Fields: ports, names by channel."""

    def __init__(self, folder, *options, scene=SCENE):
        file = folder / "ship.toml"
        file.write_text(scene)
        self.out = folder / "out"
        call = [sys.executable, "-m", "raychan", "hil", str(file), "--ports", "--out", str(self.out), *options]
        self.process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        said = self.process.stdout.readline()
        assert said, self.process.stderr.read()
        self.ports = json.loads(said)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def end(self, number=signal.SIGINT):
        """End the run by a signal; return its exit code, what it said, and the numbers of summary.json."""
        if number is not None:
            self.process.send_signal(number)
        said, trouble = self.process.communicate(timeout=120)
        assert but_compiling(trouble) == "", trouble
        return self.process.returncode, said, json.loads((self.out / "summary.json").read_text())
