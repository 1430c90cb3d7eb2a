#!/usr/bin/env python3
"""What an ELF takes of the chip, read from its section headers (no binutils needed).

usage: elf.py sizes ELF      prints: flash bytes, RAM bytes of statics
"""
import struct
import sys

ALLOC, NOBITS = 2, 8


def sections(data):
    """Name, type, flags, address, offset, size of every section of a 32-bit little-endian ELF."""
    if data[:6] != b"\x7fELF\x01\x01":
        sys.exit("elf.py: not a 32-bit little-endian ELF")
    table, = struct.unpack_from("<I", data, 32)
    size, count, names = struct.unpack_from("<HHH", data, 46)
    heads = [struct.unpack_from("<10I", data, table + i * size) for i in range(count)]
    base = heads[names][4]
    for name, kind, flags, address, offset, length, *_ in heads:
        end = data.index(b"\0", base + name)
        yield data[base + name:end].decode(), kind, flags, address, offset, length


def sizes(data):
    flash = ram = 0
    for _, kind, flags, address, _, length in sections(data):
        if flags & ALLOC:
            if address >= 0x20000000:
                ram += length
            if kind != NOBITS:
                flash += length
    return flash, ram


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] != "sizes":
        sys.exit(__doc__)
    with open(sys.argv[2], "rb") as f:
        print(*sizes(f.read()))
