#!/usr/bin/env python3
"""Render meshes side by side with one camera, flat shaded, to a PNG.

    render.py full.ply small.ply -o out.png --titles "100 %" "10 %" --edges

Reads OBJ, OFF, PLY (text or binary, faces or triangle strips) and STL; of PLY also the colours and texture coordinates
that a vertex has, which --attributes shows: the texture as a checkerboard. Draws off screen, without display or GPU: VTK
falls back to EGL after a warning about the X server. On a bare Debian or Ubuntu: `apt-get install libgl1 libegl1`;
where EGL fails too, `apt-get install xvfb` and `xvfb-run -a` before the command.
"""
import argparse
import pathlib
import struct
import sys

import numpy as np
import pyvista
from PIL import Image

MAX_TRIANGLES_WITH_EDGES = 30_000  # in a view 500 pixels wide more are one dark surface
COLOR = ("red", "green", "blue")
TEXTURE = [("s", "t"), ("u", "v"), ("texture_u", "texture_v")]
CHECKERBOARD_SQUARES = 24
TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
         "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
         "float32": "f4", "float64": "f8"}


def fan(polygon):
    return [(polygon[0], polygon[k], polygon[k + 1]) for k in range(1, len(polygon) - 1)]


def strip(ids):
    """Triangles of strips that are separated by -1; every second one turns round."""
    triangles, start = [], 0
    for k, v in enumerate(ids):
        if v < 0:
            start = k + 1
        elif k - start >= 2:
            a, b = (ids[k - 2], ids[k - 1]) if (k - start) % 2 == 0 else (ids[k - 1], ids[k - 2])
            if a != b and b != v and v != a:
                triangles.append((a, b, v))
    return triangles


class TextValues:
    def __init__(self, data):
        self.words = iter(data.split())

    def take(self, kind, count):
        return [float(next(self.words)) if kind[0] == "f" else int(next(self.words)) for _ in range(count)]

    def table(self, fields, rows):
        return None


class BinaryValues:
    def __init__(self, data, order):
        self.data, self.order, self.at = data, order, 0

    def take(self, kind, count):
        values = np.frombuffer(self.data, self.order + kind, count, self.at)
        self.at += values.nbytes
        return values.tolist()

    def table(self, fields, rows):
        """All rows at once, if they have the same size; `fields` holds (name, kind, count)."""
        dtype = np.dtype([(name, self.order + kind, (count,)) for name, kind, count in fields])
        if self.at + rows * dtype.itemsize > len(self.data):
            return None
        return np.frombuffer(self.data, dtype, rows, self.at)


def read_ply(data):
    end = data.index(b"end_header")
    body = data[data.index(b"\n", end) + 1:]
    elements, order = [], None
    for words in (line.split() for line in data[:end].decode("latin-1").splitlines()):
        if words[:1] == ["format"]:
            order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[-1], *(TYPES[w] for w in words[1:-1] if w != "list")))
    values = BinaryValues(body, order) if order else TextValues(body)
    points, triangles, columns = [], [], {}
    for name, rows, properties in elements:
        # The usual file: three ids in every face.
        fields = []
        for p in properties:
            size = 6 if p[0] == "texcoord" else 3
            fields += [("count of " + p[0], p[1], 1), (p[0], p[2], size)] if len(p) == 3 else [(p[0], p[1], 1)]
        table = values.table(fields, rows) if name in ("vertex", "face") else None
        if table is not None and all((table["count of " + p[0]] == table[p[0]].shape[1]).all()
                                     for p in properties if len(p) == 3):
            values.at += table.nbytes
            if name == "vertex":
                points = np.concatenate([table[c] for c in "xyz"], axis=1)
                columns = {p[0]: table[p[0]][:, 0] for p in properties if p[0] not in tuple("xyz")}
            else:
                triangles = next(table[p[0]] for p in properties if p[0] in ("vertex_indices", "vertex_index"))
                if "texcoord" in table.dtype.names:
                    # A vertex a corner: what the corners have becomes the vertices'.
                    corners, texture = triangles.ravel(), table["texcoord"].reshape(-1, 2)
                    points, triangles = points[corners], np.arange(len(corners)).reshape(-1, 3)
                    columns = {name: column[corners] for name, column in columns.items()}
                    columns |= {"s": texture[:, 0], "t": texture[:, 1]}
            continue
        for _ in range(rows):
            row = {}
            for p in properties:
                row[p[0]] = values.take(p[-1], values.take(p[1], 1)[0] if len(p) == 3 else 1)
            if name == "vertex":
                points.append([row[c][0] for c in "xyz"])
            elif name in ("face", "tristrips"):
                ids = row["vertex_indices"] if "vertex_indices" in row else row["vertex_index"]
                triangles += fan(ids) if name == "face" else strip(ids)
    return points, triangles, columns


def read_obj(data):
    points, triangles = [], []
    for words in (line.split() for line in data.decode("latin-1").splitlines()):
        if words[:1] == ["v"]:
            points.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            ids = [int(w.split("/")[0]) for w in words[1:] if w[0] != "#"]
            triangles += fan([v - 1 if v > 0 else len(points) + v for v in ids])
    return points, triangles, {}


def read_off(data):
    words = [w for line in data.decode("latin-1").splitlines() for w in line.split("#")[0].split()]
    vertices, faces, at = int(words[1]), int(words[2]), 4 + 3 * int(words[1])
    points = np.array(words[4:at], dtype=float).reshape(vertices, 3)
    triangles = []
    for _ in range(faces):
        count = int(words[at])
        triangles += fan([int(w) for w in words[at + 1:at + 1 + count]])
        at += 1 + count  # files with colours behind the ids are not read
    return points, triangles, {}


def read_stl(data):
    count = struct.unpack("<I", data[80:84])[0] if len(data) >= 84 else 0
    if len(data) == 84 + 50 * count:
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
        points = np.frombuffer(data, record, count, 84)["corners"].reshape(-1, 3)
    else:
        lines = (line.split() for line in data.decode("latin-1").splitlines())
        points = np.array([w[1:4] for w in lines if w[:1] == ["vertex"]], dtype=float)
    return points, np.arange(len(points)).reshape(-1, 3), {}


READERS = {".ply": read_ply, ".obj": read_obj, ".off": read_off, ".stl": read_stl}


def read(path):
    suffix = path.suffix.lower()
    if suffix not in READERS:
        sys.exit(f"{path}: unknown suffix, expected one of {' '.join(READERS)}")
    points, triangles, columns = READERS[suffix](path.read_bytes())
    if len(triangles) == 0:
        sys.exit(f"{path}: no triangles")
    mesh = pyvista.PolyData.from_regular_faces(np.array(points, dtype=np.float32), np.array(triangles, dtype=np.int64))
    if set(COLOR) <= columns.keys():
        color = np.stack([columns[c] for c in COLOR], axis=1)
        # Whole numbers are of 8 or 16 bits, others from 0 to 1.
        top = np.iinfo(color.dtype).max if color.dtype.kind in "iu" else 1.0
        mesh.point_data["color"] = np.clip(np.rint(color / top * 255.0), 0, 255).astype(np.uint8)
    for pair in TEXTURE:
        if set(pair) <= columns.keys():
            mesh.active_texture_coordinates = np.stack([columns[c] for c in pair], axis=1).astype(np.float32)
            break
    return mesh


def checkerboard(squares=CHECKERBOARD_SQUARES, pixels=64):
    """Grey and a colour that goes round with u, darker with v: a square out of its place is seen."""
    at = (np.arange(squares * pixels) // pixels) / squares
    u, v = np.meshgrid(at, at)
    turn = 2 * np.pi * (u[..., None] + np.array([0, 1, 2]) / 3)
    color = (0.6 + 0.35 * np.cos(turn)) * (1 - 0.45 * v[..., None])
    is_grey = (np.rint(u * squares) + np.rint(v * squares)) % 2 == 0
    # The first row of a texture is its top.
    return np.flipud(np.where(is_grey[..., None], 0.88, color) * 255).astype(np.uint8)


def look(mesh):
    """What shows the attributes of a mesh to pyvista's add_mesh; nothing where there are none."""
    if mesh.active_texture_coordinates is not None:
        texture = pyvista.numpy_to_texture(np.ascontiguousarray(checkerboard()))
        texture.repeat, texture.interpolate = True, True
        return {"texture": texture}
    if "color" in mesh.point_data:
        return {"scalars": "color", "rgb": True, "show_scalar_bar": False}
    return {}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=pathlib.Path, metavar="IN")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, metavar="OUT.png")
    parser.add_argument("--columns", type=int, help="default: all in one row")
    parser.add_argument("--titles", nargs="+", help="one for each mesh; default: its count of triangles")
    parser.add_argument("--edges", action="store_true", help="draw the edges of meshes that are not too fine for it")
    parser.add_argument("--width", type=int, default=1500, help="of the image, in pixels (default 1500)")
    parser.add_argument("--aspect", type=float, default=0.72, help="height of a view over its width (default 0.72)")
    parser.add_argument("--view", nargs=3, type=float, default=(-0.35, -1.0, 0.3), metavar=("X", "Y", "Z"),
                        help="direction from the mesh to the camera (default -0.35 -1 0.3)")
    parser.add_argument("--up", nargs=3, type=float, default=(0.0, 0.0, 1.0), metavar=("X", "Y", "Z"))
    parser.add_argument("--zoom", type=float, default=1.0)
    parser.add_argument("--color", default="#dcc8a4")
    parser.add_argument("--attributes", action="store_true", help="show colours and textures where a PLY has them")
    options = parser.parse_args()
    if options.titles and len(options.titles) != len(options.meshes):
        parser.error("as many titles as meshes, please")

    meshes = [read(path) for path in options.meshes]
    titles = options.titles or [f"{mesh.n_cells:,} triangles".replace(",", " ") for mesh in meshes]
    columns = options.columns or len(meshes)
    rows = -(-len(meshes) // columns)
    height = int(rows * options.width / columns * options.aspect)
    plotter = pyvista.Plotter(off_screen=True, shape=(rows, columns), border=False,
                              window_size=(options.width, height), lighting="none")
    # All views look at the first mesh's bounding box, so that a part which got lost is seen to be missing.
    bounds = np.array(meshes[0].bounds).reshape(3, 2)
    centre, diagonal = bounds.mean(axis=1), np.linalg.norm(bounds[:, 1] - bounds[:, 0])
    direction = np.array(options.view) / np.linalg.norm(options.view)
    for k, (mesh, title) in enumerate(zip(meshes, titles)):
        plotter.subplot(k // columns, k % columns)
        plotter.set_background("white")
        edges = options.edges and mesh.n_cells <= MAX_TRIANGLES_WITH_EDGES
        shown = look(mesh) if options.attributes else {}
        plotter.add_mesh(mesh, **(shown or {"color": options.color}), smooth_shading=False, show_edges=edges,
                         edge_color="#4a4036", edge_opacity=0.6, line_width=0.6, ambient=0.12, diffuse=1.0, specular=0.0)
        plotter.add_text(title, position="lower_edge", font_size=11, color="#333333")
        camera = plotter.camera
        camera.focal_point, camera.position = centre, centre + direction * diagonal * 2.0
        camera.up, camera.parallel_projection = options.up, True
        # The box as the camera sees it decides the size.
        right = np.cross(options.up, direction)
        right /= np.linalg.norm(right)
        up = np.cross(direction, right)
        corners = np.array(np.meshgrid(*bounds)).reshape(3, -1).T - centre
        half_width, half_height = np.abs(corners @ right).max(), np.abs(corners @ up).max()
        camera.parallel_scale = 1.12 * max(half_height, half_width * options.aspect) / options.zoom
        plotter.renderer.ResetCameraClippingRange()
        # A key light from above left models the relief; a weak one at the camera keeps shadows readable.
        for offset, intensity in ((1.0 * up - 0.9 * right + 0.7 * direction, 0.75), (direction, 0.5)):
            plotter.renderer.add_light(pyvista.Light(position=centre + offset * diagonal, focal_point=centre,
                                                     light_type="scene light", intensity=intensity))
    plotter.enable_anti_aliasing("ssaa")
    image = plotter.screenshot(return_img=True)
    save(image, options.output)


def save(image, path):
    """An image of few colours makes a small file: 64 levels a channel are enough for shading."""
    Image.fromarray(image).quantize(128, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {path.stat().st_size} bytes", file=sys.stderr)


if __name__ == "__main__":
    main()
