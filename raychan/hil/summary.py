"""What a run was, in numbers: frames sent and dropped, drift and jitter, what hosts sent; one line and a dictionary."""

from __future__ import annotations

from typing import Any

from raychan.hil.channel import Channel
from raychan.hil.pacing import Timing
from raychan.hil.session import SCANNER, Session
from raychan.run.ship.places import lost_lines

_KEPT_UP = 10
"""Scans that a loop may owe at the end without a warning; a pause of the machine takes some."""


def summary(session: Session) -> dict[str, Any]:
    """Return the numbers of a run that has ended. Times in ms, angles in degrees."""
    bad_lines = sum(reader.bad for reader in session.orders.values())
    ignored = sum(reader.ignored for reader in session.orders.values())
    instruments, host = session.instruments, session.host
    return {
        "ended": session.ended,
        "failed": session.failed,
        "seconds": round(session.seconds, 3),
        "utc_start": instruments.epoch.isoformat(),
        "origin": {
            "latitude_deg": instruments.origin.latitude_deg,
            "longitude_deg": instruments.origin.longitude_deg,
        },
        "scans": {
            **_timing(session.ticks.timing()),
            "behind_most": max(0, session.most_behind - 1),
            "behind_at_end": max(0, session.behind - 1),
            "longest_step_ms": round(1e3 * session.longest_step, 3),
            "realtime": session.first,
            "lost_in": session.lost.summary,
        },
        "sentences": _timing(session.cycles.timing()),
        "channels": {name: _channel(channel) for name, channel in session.channels.items()},
        "host": {
            "telegrams": host.telegrams,
            "telegrams_damaged": session.commands.damaged,
            "telegrams_refused": session.scanner.refused,
            "bytes_skipped": session.commands.skipped,
            "orders": host.orders,
            "orders_refused": host.orders_refused,
            "sentences_ignored": ignored,
            "sentences_bad": bad_lines,
        },
    }


def one_line(numbers: dict[str, Any]) -> str:
    """Return a summary on one line."""
    channels, scans, host = (numbers[key] for key in ("channels", "scans", "host"))
    first = channels[SCANNER]
    parts = [
        f"{numbers['seconds']:.1f} s ({numbers['ended']})",
        "sent: " + ", ".join(f"{name} {c['sent']} of {c['made']}" for name, c in channels.items()),
        f"scans dropped: {first['busy']} line busy, {first['no_peer']} no peer, {first['not_reading']} not read",
        f"ticks missed {scans['missed']}",
        f"{_kept(channels)}, {'first' if scans['realtime'] else 'ordinary'} in turn",
        f"telegrams {host['telegrams']}, damaged {host['telegrams_damaged']}, refused {host['telegrams_refused']}",
        f"orders {host['orders']}",
        f"reconnects {sum(c['reconnects'] for c in channels.values())}",
    ]
    return "; ".join(parts)


def _kept(channels: dict[str, Any]) -> str:
    """Return how well the lines on which anything was sent kept their times."""
    timed = [c for c in channels.values() if c["sent"]]
    if not timed:
        return "nothing sent, no drift and jitter measured"
    drift, worst = max((c["drift_ms"] for c in timed), key=abs), max(c["jitter_p99_ms"] for c in timed)
    return f"drift {drift:.2f} ms, jitter {worst:.2f} ms (99 %)"


def warnings(numbers: dict[str, Any]) -> list[str]:
    """Return what is wrong with a run as a whole."""
    scans = numbers["scans"]
    said, behind = lost_lines(scans["lost_in"], scans["ticks"]), scans["behind_at_end"]
    if behind >= _KEPT_UP:
        said.append(f"the ship is {behind} scans behind its clock at the end: the scene is too slow for real time here")
    return said


def _channel(channel: Channel) -> dict[str, Any]:
    tally, timing = channel.tally(), _timing(channel.lateness.timing())
    return {
        "port": channel.port.name,
        "baud": channel.line.baud,
        **vars(tally),
        "drift_ms": timing["drift_ms"],
        "jitter_p99_ms": timing["jitter_p99_ms"],
        "reconnects": channel.port.reconnects,
        "bytes_unread": channel.port.unread,
    }


def _timing(timing: Timing) -> dict[str, Any]:
    """Return a timing; drift and jitter are None where there was nothing to measure."""
    some = timing.ticks > 0
    return {
        "ticks": timing.ticks,
        "missed": timing.missed,
        "drift_ms": round(1e3 * timing.drift, 4) if some else None,
        "jitter_p99_ms": round(1e3 * timing.jitter_p99, 4) if some else None,
    }
