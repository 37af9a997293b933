"""`raychan hil` as a host meets it: four lines that talk and listen, peers that come and go, garbage, exit codes."""

import csv
import json
import math
import os
import re
import signal
import time
import tty

import numpy as np
import pytest
from pynmeagps import NMEAReader
from support.hil_host import SCENE, End, Hil, LmsHost, command

from raychan.cli import invoke
from raychan.hil.orders import order_sentence
from raychan.hil.scans import decode_scan


def balanced(numbers):
    """Whether each frame of each channel was sent or counted as dropped."""
    parts = ("sent", "busy", "no_peer", "not_reading", "unfinished")
    return all(c["made"] == sum(c[part] for part in parts) for c in numbers["channels"].values())


def test_a_client_goes_through_the_whole_sequence(tmp_path):
    with Hil(tmp_path) as hil:
        host = LmsHost(hil.ports["scanner"])
        assert host.ask("20 40")[:2] == b"\xa0\x00"
        assert host.ask("20 25")[:2] == b"\xa0\x00"
        assert host.ask("3A")[0] == 0xBA
        status = host.ask("31")
        assert len(status) == 152 and status[9] == 0
        assert host.ask("74")[0] == 0xF4
        assert host.ask("99") is None, "NAK for what it has not"
        assert len(decode_scan(host.ask("30")).range_m) == 181
        assert host.ask("20 24")[:2] == b"\xa0\x00"
        scans = [decode_scan(p) for p in host.scans(1.5)]
        assert 3 <= len(scans) <= 17 and host.bad == 0, "97 ms each"
        # The quay's near side is 38 m to the left of the ship, beyond the water's reach.
        assert any(np.isfinite(s.range_m).any() for s in scans)
        assert host.ask("31")[8] == 0x24, "an answer while it streams"
        assert host.ask("20 48")[:2] == b"\xa0\x00"
        time.sleep(0.3)
        assert len(host.scans(1.0)) > 20
        assert host.ask("3B 64 00 19 00")[:2] == b"\xbb\x01" and host.ask("20 24")
        assert len(decode_scan(host.scans(0.6)[-1]).range_m) == 401
        assert host.ask("20 25") and host.ask("10", answer=0x91)
        assert host.wait(3.0), "it says when it has started again"
        host.close()
        code, said, numbers = hil.end()
    assert code == 0 and balanced(numbers)
    assert re.search(r"sent: scanner \d+ of \d+", said)
    assert numbers["ended"] == "stopped" and numbers["host"]["telegrams_damaged"] == 0
    assert numbers["host"]["telegrams_refused"] == 1 and numbers["channels"]["scanner"]["busy"] > 0


def test_sentences_say_what_the_track_says(tmp_path):
    with Hil(tmp_path, "--duration", "3", "--origin=-33.5,151.0") as hil:
        ends = {name: End(hil.ports[name]) for name in ("position", "heading", "attitude")}
        time.sleep(2.0)
        lines = {name: end.lines(0.2) for name, end in ends.items()}
        code, _, numbers = hil.end(None)
    assert code == 0 and numbers["ended"] == "duration" and balanced(numbers)
    with (hil.out / "track.csv").open() as file:
        track = {row["utc"][11:22]: row for row in csv.DictReader(file)}
    seen = 0
    for line in lines["position"]:
        fix = NMEAReader.parse(line + b"\r\n")
        if fix.msgID == "GGA":
            row = track[f"{fix.time:%H:%M:%S}.{fix.time.microsecond // 10_000:02d}"]
            assert fix.lat == pytest.approx(float(row["latitude_deg"]), abs=2e-9)
            assert fix.lon == pytest.approx(float(row["longitude_deg"]), abs=2e-9)
            seen += 1
    assert seen >= 5
    for line in lines["attitude"]:
        if line.startswith(b"$PASHR"):
            clock = line.split(b",")[1].decode()
            row = track[f"{clock[:2]}:{clock[2:4]}:{clock[4:]}"]
            assert float(line.split(b",")[4]) == pytest.approx(float(row["roll_deg"]), abs=1e-3)
    headings = [NMEAReader.parse(line + b"\r\n").headingT for line in lines["heading"]]
    assert len(headings) >= 10 and all(0.0 <= h < 360.0 for h in headings)


def test_orders_turn_the_ship_and_bad_ones_are_counted(tmp_path):
    with Hil(tmp_path) as hil:
        end = End(hil.ports["heading"])
        time.sleep(0.3)
        end.write(b"$PRCHN,35,*00\r\n$GPHDT,0.000,T*35\r\n" + order_sentence(rudder_deg=20.0))
        time.sleep(3.0)
        end.close()
        other = End(hil.ports["position"])
        time.sleep(0.2)
        other.write(order_sentence(rudder_deg=20.0, shaft_rpm=1e9) + order_sentence()[:9])
        time.sleep(0.3)
        code, _, numbers = hil.end(signal.SIGTERM)
    assert code == 0
    host = numbers["host"]
    assert (host["orders"], host["sentences_bad"], host["sentences_ignored"]) == (2, 1, 1)
    with (hil.out / "track.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert max(abs(float(row["rudder_deg"])) for row in rows) > 5.0
    assert float(rows[-1]["heading_deg"]) not in (0.0, 360.0)


def test_an_autopilot_outside_turns_the_ship_through_the_ports(tmp_path):
    with Hil(tmp_path, scene="[ship]\nmodel = 'yacht'\n") as hil:
        end, heading, last = End(hil.ports["heading"]), 0.0, 0.0
        until = time.monotonic() + 9.0
        while time.monotonic() < until:
            for line in end.lines(0.15):
                if line.startswith(b"$HEHDT"):
                    last, heading = heading, NMEAReader.parse(line + b"\r\n").headingT
            # PD on a heading of 15 degrees; the rate is over a tenth of a second.
            off, rate = math.remainder(15.0 - heading, 360.0), math.remainder(heading - last, 360.0) / 0.1
            end.write(order_sentence(rudder_deg=max(-20.0, min(20.0, 1.5 * off - 1.5 * rate))))
        code, _, numbers = hil.end()
    assert code == 0 and numbers["host"]["orders"] > 20 and numbers["host"]["sentences_bad"] == 0
    with (hil.out / "track.csv").open() as file:
        headings = [math.remainder(float(row["heading_deg"]), 360.0) for row in csv.DictReader(file)]
    # Without orders its own autopilot keeps 0.
    assert headings[-1] == pytest.approx(15.0, abs=6.0)


def test_a_reader_that_dies_and_comes_back_reads_on_and_every_frame_is_counted(tmp_path):
    with Hil(tmp_path, "--baud", "500000", "--stream") as hil:
        read = 0
        for _ in range(3):
            host = LmsHost(hil.ports["scanner"])
            read += len(host.scans(1.0))
            os.close(host.fd)  # as the kernel does for a killed process
            time.sleep(0.4)
        code, _, numbers = hil.end()
    scanner = numbers["channels"]["scanner"]
    assert code == 0 and balanced(numbers) and scanner["reconnects"] == 2
    assert read > 60 and scanner["no_peer"] > 20
    # A peer that dies leaves what it has not read in the terminal's buffers: up to 17.5 kB, or 47 scans, each time.
    assert read <= scanner["sent"] <= read + 3 * 48


def test_garbage_and_half_telegrams_are_counted_and_the_loop_lives(tmp_path):
    rng = np.random.default_rng(3)
    with Hil(tmp_path) as hil:
        host = LmsHost(hil.ports["scanner"])
        time.sleep(0.2)
        for _ in range(20):
            host.write(rng.integers(0, 256, 200, dtype=np.uint8).tobytes())
        damaged = bytearray(command("31"))
        damaged[4] ^= 1
        host.write(bytes(damaged))
        host.write(command("31")[:5])
        time.sleep(0.8)
        assert host.ask("31")[0] == 0xB1
        for name in ("position", "heading", "attitude"):
            end = End(hil.ports[name])
            end.write(rng.integers(0, 256, 2000, dtype=np.uint8).tobytes())
        time.sleep(0.3)
        code, _, numbers = hil.end()
    host = numbers["host"]
    assert code == 0 and host["telegrams_damaged"] >= 2 and host["bytes_skipped"] > 3000
    assert host["sentences_bad"] >= 3 and balanced(numbers)


def test_real_ports_that_vanish_are_opened_again(tmp_path):
    link = tmp_path / "scanner"

    def device():
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(theirs))
        return ours, theirs

    ours, theirs = device()
    with Hil(tmp_path, "--scanner", str(link), "--stream", "--baud", "500000") as hil:
        assert hil.ports["scanner"] == str(link)
        time.sleep(0.5)
        assert b"\x02\x80" in os.read(ours, 4096)
        os.close(ours)
        os.close(theirs)
        link.unlink()
        time.sleep(0.8)
        ours, theirs = device()
        time.sleep(2.5)
        assert b"\x02\x80" in os.read(ours, 4096)
        code, _, numbers = hil.end()
    os.close(ours)
    os.close(theirs)
    assert code == 0 and numbers["channels"]["scanner"]["reconnects"] == 1
    assert numbers["channels"]["scanner"]["no_peer"] > 10 and balanced(numbers)


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "ship.toml"
    file.write_text(SCENE)
    return str(file)


def test_a_port_that_is_not_there_is_said_with_code_2(scene, capsys):
    assert invoke(["hil", scene, "--position", "/dev/no_such_port"]) == 2
    said = capsys.readouterr().err
    assert "--position" in said and "/dev/no_such_port is not there" in said and "Traceback" not in said


def test_a_port_that_is_taken_and_a_file_are_said_with_code_2(scene, tmp_path, capsys):
    ours, theirs = os.openpty()
    name = os.ttyname(theirs)
    assert invoke(["hil", scene, "--scanner", name, "--heading", name]) == 2
    assert f"--heading: {name} is taken by another program" in capsys.readouterr().err
    file = tmp_path / "file"
    file.write_text("")
    assert invoke(["hil", scene, "--heading", str(file)]) == 2
    assert f"{file} is no serial port" in capsys.readouterr().err
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    "options, word",
    [
        (["--baud", "4800"], "9600"),
        (["--origin", "north"], "latitude"),
        (["--origin", "91,0"], "latitude"),
        (["--origin", "5"], "two numbers"),
        (["--rate", "0"], "rate"),
        (["--duration", "-1"], "duration"),
        (["--out", "/dev/null/x"], "/dev/null/x"),
        (["--set", "ship.modle='yacht'"], "model"),
    ],
)
def test_wrong_options_are_said_with_code_2(scene, capsys, options, word):
    assert invoke(["hil", scene, *options, *([] if "--duration" in options else ["--duration", "0.1"])]) == 2
    assert word in capsys.readouterr().err


def test_a_fan_that_no_telegram_holds_is_said_before_ports_are_named(tmp_path, capsys):
    wide = ["--set", "scanner.fan_deg=360", "--set", "scanner.step_deg=0.25", "--duration", "0.1"]
    assert invoke(["hil", *wide, "--ports", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert "scanner.fan_deg: a scan of 1,441 beams" in said.err and not said.out
    assert not list(tmp_path.rglob("track.csv"))


def test_a_full_disk_ends_the_track_and_not_the_run(scene, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "track.csv").symlink_to("/dev/full")
    options = ["--rate", "50", "--duration", "2", "--out", str(tmp_path / "out")]
    assert invoke(["hil", scene, *options]) == 0
    said = capsys.readouterr()
    assert "track.csv: not whole: No space left" in said.err and "2.0 s (duration)" in said.out


def test_logged_poses_end_the_run_and_take_no_orders(tmp_path):
    rows = ["t_s,x_m,y_m,heading_deg,roll_deg,pitch_deg"]
    rows += [f"{k * 0.1:.1f},{k * 0.5},0,0,{5.0 * math.sin(k * 0.3):.4f},1.0" for k in range(16)]
    (tmp_path / "poses.csv").write_text("\n".join(rows) + "\n")
    with Hil(tmp_path, scene="[replay]\nfile = 'poses.csv'\n") as hil:
        end = End(hil.ports["position"])
        time.sleep(0.3)
        end.write(order_sentence(rudder_deg=5.0))
        code, _, numbers = hil.end(None)
    assert code == 0 and numbers["ended"] == "end of the logged poses"
    assert numbers["host"]["orders_refused"] == 1
    assert json.loads((hil.out / "summary.json").read_text()) == numbers


def test_where_the_system_forbids_it_it_runs_as_an_ordinary_program(scene, capsys, monkeypatch):
    def refuse(*anything):
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert invoke(["hil", scene, "--duration", "0.3"]) == 0
    assert "ordinary in turn" in capsys.readouterr().out


def test_a_program_that_read_the_ports_and_closed_the_pipe_does_not_end_the_run(tmp_path):
    with Hil(tmp_path, "--duration", "0.5") as hil:
        hil.process.stdout.close()
        trouble = hil.process.stderr.read()
        assert hil.process.wait(60) == 0 and "Traceback" not in trouble
    assert json.loads((hil.out / "summary.json").read_text())["ended"] == "duration"


def test_an_unknown_scene_is_answered_with_ships_only(capsys):
    assert invoke(["hil", "nowhere"]) == 2
    said = capsys.readouterr().err
    assert "ship_turn" in said and "urban" not in said


def test_a_closed_terminal_ends_a_run_in_order(tmp_path):
    with Hil(tmp_path) as hil:
        time.sleep(0.3)
        code, said, numbers = hil.end(signal.SIGHUP)
    assert code == 0 and numbers["ended"] == "stopped" and "nothing sent" in said
