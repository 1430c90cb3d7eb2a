"""Reads messages of surfacings, version 1 and 2, by docs/backseat.md: a start for a reader of your own.

  python surfacing.py 6956a0c4.srf          one line of JSON a message
"""

import json
import struct
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

LENGTHS = {1: 54, 2: 163}
GLIDE = {"time_s": 1.0, "way_m": 0.1, "pitch_rad": 1e-4, "path_rad": 1e-4, "speed_m_s": 1e-3}
COUNTS = ["start_s", "duration_s", "rows", "climbing", "refused", "blocks", "directions"]
MEANS = {"pitch_rad": 1e-4, "roll_rad": 1e-4, "drive_m3": 1e-7, "deepest_pa": 1e3}


def known(steps: int, unit: float) -> float | None:
    return None if steps == 0xFFFF else steps * unit


def signed_numbers(packed: bytes) -> Iterator[int]:
    """Numbers of 12 bits, two in three bytes."""
    for low, middle, high in zip(packed[::3], packed[1::3], packed[2::3], strict=True):
        for raw in (low | (middle & 0x0F) << 8, middle >> 4 | high << 4):
            yield raw - 4096 if raw & 0x800 else raw


def packet(data: bytes) -> dict[str, Any]:
    """What the glides say: counts, scatter, and eight lines, each a row of R and then y, m/s."""
    vehicle, *head = struct.unpack_from("<IIHHHHBHffHHHH", data)
    said = dict(zip(COUNTS, head, strict=False))
    said["duration_s"] *= 10
    means = {name: steps * unit for (name, unit), steps in zip(MEANS.items(), head[9:], strict=True)}
    numbers = signed_numbers(data[43:])
    lines = [[0.0] * i + [next(numbers) * 2.0 ** (e - 126) / 2047 for _ in range(9 - i)] for i, e in enumerate(data[35:43])]
    return {"vehicle": f"{vehicle:08x}", **said, "scatter": head[7], "variance": head[8], **means, "lines": lines}


def message(data: bytes) -> dict[str, Any]:
    """One message, whole and undamaged."""
    _, phase, abort, switches, seq, time_s, dives, flags, table, *values = struct.unpack_from("<BBBBIIHIIHHHHHHhhHHHhhH", data)
    glides = [dict(zip(GLIDE, (v * unit for v, unit in zip(g, GLIDE.values(), strict=True)), strict=True)) for g in (values[4:9], values[9:])]
    return {
        "phase": phase,
        "abort": abort - 1 if abort else None,
        "leak": switches & 3,
        "weight": switches >> 2 & 3,
        "fix": bool(switches & 16),
        "comms": bool(switches & 32),
        "seq": seq,
        "time_s": time_s,
        "dives": dives,
        "flags": [bit for bit in range(32) if flags >> bit & 1],
        "table": f"{table:08x}",
        "deepest_m": known(values[0], 0.1),
        "battery_v": known(values[1], 1e-3),
        "charge": known(values[2], 1e-4),
        "hull_pa": known(values[3], 2.0),
        "glides": dict(zip(("down", "up"), glides, strict=True)),
        "packet": packet(data[50:159]) if data[0] == 2 else None,
    }


def messages(data: bytes) -> Iterator[dict[str, Any]]:
    """All messages of a file; bytes that belong to none are passed over."""
    at = 0
    while at < len(data):
        one = data[at : at + LENGTHS.get(data[at], 0)]
        if len(one) == LENGTHS.get(data[at]) and zlib.crc32(one[:-4]) == int.from_bytes(one[-4:], "little"):
            yield message(one)
            at += len(one)
        else:
            at += 1


if __name__ == "__main__":
    for said in messages(Path(sys.argv[1]).read_bytes()):
        print(json.dumps(said))
