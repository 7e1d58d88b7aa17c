#!/usr/bin/env python3
"""Simplify arrays with one of the peers and measure its call alone: one process for one run, started by regress.py.

    peers.py vtk points.npy triangles.npy 5000 out.ply

Loads the arrays, brings them into the peer's own types, and only then starts the clock. Prints JSON: the seconds of
the call and by how many megabytes (10^6 bytes) it raised the peak of the resident memory. On Linux the peak is set
back before the call; elsewhere a call that stays under the peak of loading counts as 0.

The settings are the peers' defaults, but for the one called tuned:

    fast-simplification     simplify, agg 7
    pymeshlab               meshing_decimation_quadric_edge_collapse
    pymeshlab-tuned         the same with quality threshold 0.3, boundary, normals and topology preserved
    vtk                     vtkQuadricDecimation, through pyvista's decimate
    meshoptimizer-simplify  meshopt_simplify, no limit of the error: it keeps vertices where they are

meshoptimizer's simplifyWithUpdate, which moves vertices and comes closer to the surface, is not in its Python package:
scripts/race calls it and prints the same JSON.
"""
import argparse
import json
import pathlib
import re
import resource
import sys
import time

import numpy as np


def fast_simplification(points, triangles, target):
    import fast_simplification
    points, triangles = np.ascontiguousarray(points, dtype=np.float32), np.ascontiguousarray(triangles, dtype=np.int32)
    reduction = 1 - target / len(triangles)
    return lambda: fast_simplification.simplify(points, triangles, reduction, agg=7)


def pymeshlab(points, triangles, target, **settings):
    import pymeshlab
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points.astype(np.float64), triangles))
    call = meshes.meshing_decimation_quadric_edge_collapse

    def simplify():
        call(targetfacenum=target, **settings)
        return lambda: (meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix())

    return simplify


def pymeshlab_tuned(points, triangles, target):
    return pymeshlab(points, triangles, target, qualitythr=0.3, preserveboundary=True, preservenormal=True,
                     preservetopology=True, optimalplacement=True)


def vtk(points, triangles, target):
    import pyvista
    mesh = pyvista.PolyData.from_regular_faces(points, triangles)
    reduction = 1 - target / len(triangles)

    def simplify():
        out = mesh.decimate(reduction)
        return lambda: (np.asarray(out.points), out.regular_faces)

    return simplify


def meshoptimizer_simplify(points, triangles, target):
    import meshoptimizer
    points = np.ascontiguousarray(points, dtype=np.float32)
    indices = np.ascontiguousarray(triangles, dtype=np.uint32).ravel()

    def simplify():
        kept = np.empty(len(indices), dtype=np.uint32)
        count = meshoptimizer.simplify(kept, indices, points, target_index_count=3 * target, target_error=1e30)
        return lambda: (points, kept[:count].reshape(-1, 3))

    return simplify


PEERS = {"fast-simplification": fast_simplification, "pymeshlab": pymeshlab, "pymeshlab-tuned": pymeshlab_tuned,
         "vtk": vtk, "meshoptimizer-simplify": meshoptimizer_simplify}
PACKAGES = {"pymeshlab-tuned": "pymeshlab", "meshoptimizer-simplify": "meshoptimizer"}  # elsewhere as the peer


def reset_peak():
    """Sets the peak of the resident memory to its present size; whether the system can."""
    try:
        pathlib.Path("/proc/self/clear_refs").write_text("5")
        return True
    except OSError:
        return False


def peak_bytes(is_reset):
    if is_reset:
        # Not getrusage: that one starts with the peak of the process that started this one.
        return 1024 * int(re.search(r"VmHWM:\s*(\d+) kB", pathlib.Path("/proc/self/status").read_text())[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def measure(call):
    is_reset = reset_peak()
    before = peak_bytes(is_reset)
    start = time.perf_counter()
    result = call()
    seconds = time.perf_counter() - start
    return result, seconds, (peak_bytes(is_reset) - before) / 1e6


def write_ply(path, points, triangles, columns=None):
    """Binary, without the vertices that no triangle uses, in the precision of the points; `columns` holds what else the
    vertices have, by name, in single precision."""
    used, corners = np.unique(np.asarray(triangles, dtype=np.int64), return_inverse=True)
    points = np.asarray(points)[used]
    kind, word = ("<f8", "double") if points.dtype == np.float64 else ("<f4", "float")
    fields = [(axis, kind, word, points[:, k]) for k, axis in enumerate("xyz")]
    fields += [(name, "<f4", "float", np.asarray(column)[used]) for name, column in (columns or {}).items()]
    vertices = np.empty(len(points), dtype=[(name, kind) for name, kind, *_ in fields])
    for name, _, _, values in fields:
        vertices[name] = values
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, corners.reshape(-1, 3)
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
              + "".join(f"property {word} {name}\n" for name, _, word, _ in fields)
              + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    pathlib.Path(path).write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("peer", choices=PEERS)
    parser.add_argument("points", metavar="POINTS.npy")
    parser.add_argument("triangles", metavar="TRIANGLES.npy")
    parser.add_argument("target", type=int, metavar="TRIANGLES", help="how many to keep")
    parser.add_argument("output", metavar="OUT.ply")
    options = parser.parse_args()
    simplify = PEERS[options.peer](np.load(options.points), np.load(options.triangles), options.target)
    result, seconds, megabytes = measure(simplify)
    points, triangles = result() if callable(result) else result
    write_ply(options.output, points, triangles)
    print(json.dumps({"seconds": seconds, "megabytes": megabytes}))


if __name__ == "__main__":
    main()
