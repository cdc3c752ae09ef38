"""Joins libraries or programs of macOS for several processors in one universal file:
universal.py OUTPUT INPUT…

The format is a header in big-endian order, and then each file as it is, at a multiple of a page of
16 KiB. Signatures stay valid, because each covers its own file.
"""

import struct
import sys
from pathlib import Path

UNIVERSAL, SINGLE = 0xCAFEBABE, 0xFEEDFACF
ALIGNMENT = 14


def aligned(offset: int) -> int:
    page = 1 << ALIGNMENT
    return -(-offset // page) * page


def universal(files: list[bytes]) -> bytes:
    header = struct.pack(">II", UNIVERSAL, len(files))
    offset = aligned(len(header) + 20 * len(files))
    content = b""
    for file in files:
        magic, cpu, subtype = struct.unpack_from("<III", file)
        if magic != SINGLE:
            raise ValueError(f"no 64-bit Mach-O file: magic number {magic:#x}")
        header += struct.pack(">IIIII", cpu, subtype, offset, len(file), ALIGNMENT)
        content += file.ljust(aligned(len(file)), b"\0")
        offset += aligned(len(file))
    return header.ljust(aligned(len(header)), b"\0") + content


if __name__ == "__main__":
    output, *inputs = map(Path, sys.argv[1:])
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_bytes(universal([path.read_bytes() for path in inputs]))
    output.chmod(0o755)
