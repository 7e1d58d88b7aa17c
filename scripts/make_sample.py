#!/usr/bin/env python3
"""Write data/sample.ply: a carved fish of 99 969 triangles, with one of everything that a simplifier can get wrong.

What is where (x runs from the mouth to the tail, z is up, lengths in millimetres, the fish is about 125 long):

* detail       scales on the flanks, eyes, a fan of rays in low relief behind the gill;
* sharp crease the rear edge of the gill cover (a step one ring wide) and the pleats of dorsal and tail fin;
* thin part    every fin is two sheets, less than 2.4 apart, that meet in a sharp rim;
* hole         the throat: rings 0-14 run into the mouth, and ring 0 stays open (one boundary loop, 176 edges);
* non-manifold one edge under the chin carries a third triangle, the barbel (it adds two boundary edges and a vertex).

All else is one manifold, consistently oriented component of genus 0 without degenerate faces or equal positions.
The mesh is a tube: ring i has one vertex j = 0 on the belly, j = SIDE on the back, the left flank between them and
the right flank on the way down. The last ring is zipped: left and right share the rim of the tail.

Bytes are the same on every platform: only + - * / sqrt are used (sine and cosine are polynomials here), coordinates
are rounded to 1e-4, and `--check` compares the file with SHA256 below.
"""
import argparse
import hashlib
import pathlib
import struct
import sys
from bisect import bisect_right
from math import floor, sqrt

SHA256 = "0b4890ed1f3536e2c1bd47ab5937a58e92bb159ef1c6da0061c4dd0050fb161e"

RINGS = 284  # strips of quads along the body; ring 0 is the open throat, ring RINGS the rim of the tail
SIDE = 88  # quads from belly to back on one flank
GILL = 84  # ring of the gill cover's edge
FINE = 240  # points on a section before it is resampled by arc length
SCALE_PITCH = 0.036  # distance of two scales, in body lengths
MILLIMETRES = 120.0  # one body length

# Profiles over the ring index. x, centre height, half height and half width of the body, how far the dorsal and the
# anal fin rise above it, half thickness of the fins, and how far the middle of a section lies behind its ends.
PROFILE = [
    # ring    x      centre  height  width   dorsal  anal    thick   bulge
    (0,     0.055,  0.000,  0.006,  0.010,  0.000,  0.000,  0.000,  0.000),
    (5,     0.030,  0.000,  0.012,  0.018,  0.000,  0.000,  0.000,  0.000),
    (9,     0.010,  0.000,  0.018,  0.025,  0.000,  0.000,  0.000,  0.000),
    (12,    0.000,  0.000,  0.025,  0.031,  0.000,  0.000,  0.000,  0.000),
    (14,   -0.004,  0.000,  0.030,  0.036,  0.000,  0.000,  0.000,  0.000),
    (17,    0.002,  0.001,  0.040,  0.042,  0.000,  0.000,  0.000,  0.002),
    (21,    0.014,  0.002,  0.054,  0.048,  0.000,  0.000,  0.001,  0.005),
    (26,    0.034,  0.004,  0.072,  0.058,  0.000,  0.000,  0.002,  0.008),
    (45,    0.095,  0.008,  0.112,  0.080,  0.000,  0.000,  0.004,  0.018),
    (GILL,  0.225,  0.014,  0.176,  0.108,  0.010,  0.000,  0.007,  0.035),
    (110,   0.320,  0.016,  0.205,  0.113,  0.085,  0.000,  0.009,  0.025),
    (150,   0.470,  0.012,  0.200,  0.103,  0.100,  0.012,  0.010,  0.008),
    (190,   0.620,  0.006,  0.146,  0.076,  0.078,  0.075,  0.010,  0.000),
    (215,   0.720,  0.002,  0.092,  0.050,  0.036,  0.040,  0.009,  0.000),
    (235,   0.800,  0.000,  0.056,  0.031,  0.002,  0.002,  0.008,  -0.004),
    (246,   0.842,  0.000,  0.048,  0.025,  0.004,  0.004,  0.008,  -0.002),
    (258,   0.892,  0.000,  0.040,  0.017,  0.056,  0.056,  0.008,  -0.012),
    (270,   0.950,  0.000,  0.026,  0.008,  0.142,  0.142,  0.007,  -0.034),
    (RINGS, 1.025,  0.000,  0.014,  0.001,  0.222,  0.222,  0.003,  -0.068),
]
# The swimming bend: sideways offset of the whole section over x.
BEND = [(-0.1, 0.010), (0.10, 0.004), (0.35, -0.012), (0.60, -0.006), (0.85, 0.040), (1.10, 0.115)]


def cosine_of_turns(t):
    """cos(2 pi t) by its Taylor series on an eighth of a turn."""
    t = abs(t - floor(t + 0.5))
    if t > 0.25:
        return -cosine_of_turns(0.5 - t)
    if t > 0.125:
        half = cosine_of_turns(t * 0.5)
        return 2.0 * half * half - 1.0
    square = (6.283185307179586 * t) * (6.283185307179586 * t)
    term, total = 1.0, 1.0
    for k in range(1, 11):
        term *= -square / ((2 * k - 1) * (2 * k))
        total += term
    return total


def triangle_wave(t):
    """A fold with period 1: 1 at whole numbers, -1 halfway."""
    return 4.0 * abs(t - floor(t) - 0.5) - 1.0


def smoothstep(a, b, t):
    t = min(max((t - a) / (b - a), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


def monotone_cubic(xs, ys):
    """A function through the points that overshoots none of them (Fritsch and Butland 1984)."""
    slopes = [(ys[k + 1] - ys[k]) / (xs[k + 1] - xs[k]) for k in range(len(xs) - 1)]
    tangents = [slopes[0]]
    for a, b in zip(slopes, slopes[1:]):
        tangents.append(2.0 * a * b / (a + b) if a * b > 0.0 else 0.0)
    tangents.append(slopes[-1])

    def value(x):
        k = min(max(bisect_right(xs, x) - 1, 0), len(slopes) - 1)
        width = xs[k + 1] - xs[k]
        t = (x - xs[k]) / width
        s = 1.0 - t
        return (ys[k] * s * s * (1.0 + 2.0 * t) + ys[k + 1] * t * t * (1.0 + 2.0 * s)
                + width * t * s * (tangents[k] * s - tangents[k + 1] * t))

    return value


def section(centre, height, width, top, bottom, thick):
    """SIDE + 1 points (z, half width, arc length from the middle) from belly to back, equally far apart."""
    middle, half = (top + bottom) * 0.5, (top - bottom) * 0.5
    fine = []
    for k in range(FINE + 1):
        q = -cosine_of_turns(0.5 * k / FINE)
        z = middle + half * q
        body = max(0.0, 1.0 - ((z - centre) / height) * ((z - centre) / height))
        fin = max(0.0, 1.0 - q * q)
        fine.append((z, sqrt(width * width * body + thick * thick * fin)))
    lengths = [0.0]
    for (z0, y0), (z1, y1) in zip(fine, fine[1:]):
        lengths.append(lengths[-1] + sqrt((z1 - z0) * (z1 - z0) + (y1 - y0) * (y1 - y0)))
    at_middle = 0.0
    for k in range(FINE):
        if fine[k][0] <= centre < fine[k + 1][0]:
            at_middle = lengths[k]
    points, k = [], 0
    for j in range(SIDE + 1):
        wanted = lengths[-1] * j / SIDE
        while k + 2 <= FINE and lengths[k + 1] < wanted:
            k += 1
        t = min((wanted - lengths[k]) / (lengths[k + 1] - lengths[k]), 1.0)
        z = fine[k][0] + t * (fine[k + 1][0] - fine[k][0])
        y = fine[k][1] + t * (fine[k + 1][1] - fine[k][1])
        points.append((z, y if 0 < j < SIDE else 0.0, wanted - at_middle))
    return points


def scales(along, around):
    """Height 0..1 of overlapping scales on a staggered lattice: a slow rise towards the tail, then a steep fall."""
    a, b = along / SCALE_PITCH, around / SCALE_PITCH
    best = 0.0
    for column in (floor(a) - 1, floor(a), floor(a) + 1, floor(a) + 2):
        shift = 0.5 * (column % 2)
        row = floor(b - shift + 0.5) + shift
        for centre in (row - 1.0, row, row + 1.0):
            da, db = a - column, b - centre
            best = max(best, 1.0 - (1.1 if da > 0.0 else 0.42) * da * da - 1.3 * db * db)
    return best


def eye(dx, dz):
    """A dome with a pupil, in a raised socket; heights in body lengths."""
    r = sqrt(dx * dx + dz * dz) / 0.026
    dome = 0.013 * max(0.0, 1.0 - r * r) - 0.0045 * (1.0 - smoothstep(0.15, 0.55, r))
    socket = max(0.0, 1.0 - 4.0 * (r - 1.35) * (r - 1.35))
    return dome + 0.0065 * socket * socket


def pectoral_fin(dx, dz):
    """A fan of folded rays, pointing backwards and down; (cover 0..1, height in body lengths)."""
    along, across = 0.85 * dx - 0.53 * dz, 0.53 * dx + 0.85 * dz
    if along <= 0.012:
        return 0.0, 0.0
    slope, radius = across / along, sqrt(along * along + across * across)
    reach = 0.180 - 0.06 * slope * slope
    cover = (1.0 - smoothstep(0.86, 1.0, radius / reach)) * (1.0 - smoothstep(0.44, 0.58, abs(slope)))
    cover *= smoothstep(0.012, 0.040, along)
    return cover, 0.010 + 0.0035 * cosine_of_turns(slope * 5.0) * smoothstep(0.03, 0.08, radius)


def fish():
    """(positions, triangles)."""
    rings = [row[0] for row in PROFILE]
    profile = [monotone_cubic(rings, [row[k] for row in PROFILE]) for k in range(1, 9)]
    bend = monotone_cubic([p[0] for p in BEND], [p[1] for p in BEND])
    positions, ids = [], []
    for i in range(RINGS + 1):
        x0, centre, height, width, dorsal, anal, thick, bulge = (f(float(i)) for f in profile)
        top, bottom = centre + height + dorsal, centre - height - anal
        gill_cover = 1.0 + 0.13 * smoothstep(GILL - 34, GILL, i) if i <= GILL else 1.0
        on_flank = smoothstep(GILL + 1, GILL + 6, i) * (1.0 - smoothstep(232, 248, i))
        swept = 1.0 - smoothstep(232, 248, i)
        on_tail = smoothstep(250, 268, i)
        left, right, middle = [], [], []
        for j, (z, y, around) in enumerate(section(centre, height, width, top, bottom, thick)):
            q = (2.0 * z - top - bottom) / (top - bottom)
            above, below = max(0.0, z - centre - height), max(0.0, centre - height - z)
            x = x0 + bulge * (1.0 - q * q) + (0.55 * above + 0.45 * below) * swept
            flank = max(0.0, 1.0 - ((z - centre) / height) * ((z - centre) / height))
            relief = 0.0
            if 0 < j < SIDE and i > 17:
                cover, fan = pectoral_fin(x - 0.285, z - centre + 0.035)
                cover *= on_flank
                relief += 0.0075 * scales(x, around) * on_flank * smoothstep(0.03, 0.18, flank) * (1.0 - cover)
                relief += cover * fan + eye(x - 0.118, z - centre - 0.035)
            # Both sheets of a fin follow the same fold.
            in_dorsal = smoothstep(0.0, 0.03, above) * (1.0 - on_tail)
            in_anal = smoothstep(0.0, 0.03, below) * (1.0 - on_tail)
            fold = 0.0045 * triangle_wave(i / 8.0) * max(in_dorsal, in_anal)
            fold += 0.0065 * triangle_wave(j / 8.0) * on_tail * (0.2 + 0.8 * smoothstep(0.05, 0.35, abs(q)))
            offset = bend(x) + fold
            y = y * gill_cover + relief
            left.append((x, offset + y, z))
            right.append((x, offset - y, z))
            middle.append((x, offset, z))
        first = len(positions)
        if i == RINGS:
            positions += middle
            ids.append(list(range(first, first + SIDE + 1)) + list(range(first + SIDE - 1, first, -1)))
        else:
            positions += left + right[SIDE - 1:0:-1]
            ids.append(list(range(first, first + 2 * SIDE)))
    positions = [tuple(round(MILLIMETRES * c, 4) for c in p) for p in positions]

    triangles = []
    for i, (a, b) in enumerate(zip(ids, ids[1:])):
        for j in range(2 * SIDE):
            k = (j + 1) % (2 * SIDE)
            v00, v01, v10, v11 = a[j], a[k], b[j], b[k]
            # Of the two ways to cut the quad take the shorter diagonal; ties take the first. Beside the zip's ends
            # the diagonal must end there, or both flanks would draw the same one.
            falls = squared_distance(positions[v00], positions[v11]) <= squared_distance(positions[v01], positions[v10])
            if i == RINGS - 1 and (j % SIDE == 0 or k % SIDE == 0):
                falls = k % SIDE == 0
            if falls:
                triangles += [(v00, v11, v10), (v00, v01, v11)]
            else:
                triangles += [(v00, v01, v10), (v01, v11, v10)]

    # The barbel: a third triangle on the edge that joins two rings under the chin.
    tail, head = ids[35][0], ids[36][0]
    x, y, z = positions[tail]
    positions.append((round(x + 2.5, 4), y, round(z - 4.0, 4)))
    triangles.append((tail, head, len(positions) - 1))
    return positions, triangles


def squared_distance(p, q):
    return sum((a - b) * (a - b) for a, b in zip(p, q))


def to_ply(positions, triangles):
    header = ("ply\nformat binary_little_endian 1.0\ncomment made by scripts/make_sample.py\n"
              f"element vertex {len(positions)}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    return b"".join([header.encode("ascii"), *(struct.pack("<3f", *p) for p in positions),
                     *(struct.pack("<B3i", 3, *t) for t in triangles)])


def main():
    default = pathlib.Path(__file__).resolve().parent.parent / "data" / "sample.ply"
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default, help="default: data/sample.ply")
    parser.add_argument("--check", action="store_true",
                        help="write nothing; fail unless both the made bytes and the file have the known hash")
    options = parser.parse_args()
    made = to_ply(*fish())
    found = {"made": hashlib.sha256(made).hexdigest()}
    if options.check:
        found[str(options.output)] = hashlib.sha256(options.output.read_bytes()).hexdigest()
    else:
        options.output.write_bytes(made)
        print(f"{options.output}: {len(made)} bytes", file=sys.stderr)
    wrong = [f"{name}: sha256 {digest}, expected {SHA256}" for name, digest in found.items() if digest != SHA256]
    print("\n".join(wrong) or "sha256 as expected", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
