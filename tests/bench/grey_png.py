"""PNG files of one channel of 8 bits, as raw sensor images are: read and written without a library."""
import struct
import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def read(data):
    """Rows of the image as bytearrays."""
    place, packed, width, height = len(SIGNATURE), b"", 0, 0
    while place < len(data):
        size, kind = struct.unpack(">I4s", data[place:place + 8])
        body = data[place + 8:place + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 0), "not an image of one channel of 8 bits"
        elif kind == b"IDAT":
            packed += body
        place += 12 + size
    lines, rows, above = zlib.decompress(packed), [], bytearray(width)
    for y in range(height):
        start = y * (width + 1)
        above = unfiltered(lines[start], bytearray(lines[start + 1:start + 1 + width]), above)
        rows.append(above)
    return rows


def unfiltered(kind, row, above):
    left = corner = 0
    for x, value in enumerate(row):
        up = above[x]
        if kind == 1:
            value += left
        elif kind == 2:
            value += up
        elif kind == 3:
            value += (left + up) // 2
        elif kind == 4:
            to_left, to_up, to_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
            value += left if to_left <= to_up and to_left <= to_corner else up if to_up <= to_corner else corner
        row[x] = left = value & 255
        corner = up
    return row


def write(rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    packed = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 3)
    return SIGNATURE + chunk(b"IHDR", header) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
