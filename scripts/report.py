#!/usr/bin/env python3
"""Make one self-contained HTML page of what regress.py or attributes.py found: pictures, error as colour, tables, plots.

    report.py results.json -o report.html
    report.py results.json --picture nefertiti 0.02 -o compared.png     one case's pictures alone

For each mesh: the original and each tool's output (flat shaded, one camera; with its colours, or a checkerboard where it
has texture coordinates, if the file has a vertex for each wedge), under each output its distance to the
reference as colour (one scale for all tools at one ratio), the table, and rms and Hausdorff against triangles kept.
Tools that wrote the same bytes share one picture, and one line in the plots where they did so at every ratio. Needs no
display; where VTK finds neither EGL nor an X server, see render.py.
"""
import argparse
import base64
import functools
import hashlib
import html
import io
import json
import math
import pathlib
import sys

import matplotlib
import numpy as np
import pyvista
from PIL import Image, ImageDraw, ImageFont
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDoubleArray
from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

import render

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402  (after the choice of the backend)

# Key, heading, factor, digits, whether less is better (None: no contest), whether more triangles make it easier.
COLUMNS = [
    ("triangles", "triangles", 1, None, None, False),
    ("seconds", "seconds", 1, 3, True, False),
    ("megabytes", "MB", 1, 3, True, False),
    ("rms_of_diagonal", "rms", 1e4, 3, True, True),
    ("mean_of_diagonal", "mean", 1e4, 3, True, True),
    ("hausdorff_of_diagonal", "Hausdorff", 1e4, 3, True, True),
    ("normal_deviation_mean_degrees", "normals, °", 1, 3, True, True),
    ("triangle_quality_mean", "quality", 1, 3, False, False),
    ("new_boundary_edges", "new boundary edges", 1, None, True, False),
    ("new_non_manifold_edges", "new non-manifold edges", 1, None, True, False),
    ("normal_rms_degrees", "normals carried, °", 1, 3, True, True),
    ("texture_coordinate_rms_texture_units", "texture, 10⁻³", 1e3, 3, True, True),
    ("texture_coordinate_mean_texture_units", "its mean, 10⁻³", 1e3, 3, True, True),
    ("color_rms_of_full_range", "colour, 10⁻³ of full range", 1e3, 3, True, True),
    ("triangles_turned_against_reference", "turned in texture", 1, None, True, False),
    ("lost_attributes", "attributes lost", 1, None, True, False),
]
SUMMARY = ["rms_of_diagonal", "mean_of_diagonal", "hausdorff_of_diagonal", "normal_deviation_mean_degrees",
           "normal_rms_degrees", "texture_coordinate_rms_texture_units", "color_rms_of_full_range", "seconds",
           "megabytes"]
EXTRA_TRIANGLES = 1.02  # above this multiple of the target an error is not compared with the others'
EXACT = 1e-9  # of the diagonal; a smaller error is none, and has no logarithm
# Direction to the camera and up: of meshes that stand on z = 0 and face -y, and of the others.
VIEW = ((-0.35, -1.0, 0.3), (0.0, 0.0, 1.0))
Y_UP = ((0.25, 0.2, 1.0), (0.0, 1.0, 0.0))
FROM_ABOVE = ((-0.35, -1.0, 0.9), (0.0, 0.0, 1.0))
VIEWS = {"fandisk": ((0.3, 0.5, -1.0), (0.0, 1.0, 0.0)), "rocker-arm": ((1.0, 0.3, 0.4), (0.0, 1.0, 0.0)),
         "spot": ((0.7, 0.3, -1.0), (0.0, 1.0, 0.0))}
VIEWS |= dict.fromkeys(("Laurana50k", "bunny", "camelhead", "dragon", "face000", "igea", "igea_sub_1m", "office_chair",
                        "ogre", "pirate", "stanford-bunny", "stanford-dragon"), Y_UP)
VIEWS |= dict.fromkeys(("conrod", "gears", "thingi10k_99865"), FROM_ABOVE)
COLORS = matplotlib.colormaps["viridis"]
ABOVE = "#e8202a"
SURFACE = "#dcc8a4"
LINES = ["#c1272d", "#0072b2", "#009e73", "#e69f00", "#7f3c8d", "#56b4e9", "#555555", "#d55e9e", "#8c6d31"]
MARKERS = "os^Dv<>Ph"
SUPERSAMPLES = 2

STYLE = """
:root { color-scheme: light } * { box-sizing: border-box }
body { font: 16px/1.5 system-ui, sans-serif; color: #1c1c1c; background: #fff; max-width: 1320px; margin: 0 auto;
  padding: 16px 24px 48px }
h1 { font-size: 28px; margin: 8px 0 } h2 { font-size: 23px; margin: 48px 0 4px; border-top: 2px solid #ddd;
  padding-top: 20px } h3 { font-size: 18px; margin: 28px 0 6px } p { margin: 6px 0 10px; max-width: 80ch }
.wide { overflow-x: auto } table { border-collapse: collapse; font-size: 14.5px; margin: 8px 0;
  font-variant-numeric: tabular-nums } th, td { padding: 3px 10px; border-bottom: 1px solid #e2e2e2; text-align: right }
th { font-weight: 600; color: #444; border-bottom-color: #999 } th:first-child, td:first-child { text-align: left }
td b { color: #000; font-weight: 750 } tr.ours td:first-child { font-weight: 600 } td.off { color: #a40000 }
.views { display: grid; grid-template-columns: repeat(auto-fill, minmax(196px, 1fr)); gap: 12px }
figure { margin: 0 } figure img { width: 100%; display: block } figcaption { font-size: 14px; line-height: 1.35;
  text-align: center; margin-bottom: 4px } .note, figcaption span { color: #555 } .note { font-size: 14px }
.legend { margin: 24px 8px; font-size: 14px } .bar { display: flex; height: 16px; margin: 8px 0 2px }
.bar i { width: 62% } .bar i + i { width: 38% } .ends { position: relative; height: 1.5em }
.ends span { position: absolute } .ends .mid { left: 31%; transform: translateX(-50%) } .ends .top { left: 62%;
  transform: translateX(-50%) } .ends .more { right: 0 }
.plots { display: flex; flex-wrap: wrap; gap: 16px } .plots img { width: 620px; max-width: 100% } a { color: #0a4f9c }
"""


def data_uri(kind, data):
    return f"data:image/{kind};base64,{base64.b64encode(data).decode()}"


def number(value, digits=3):
    """Three digits that count; thousands apart."""
    if value is None:
        return "–"
    if digits is None or value == 0:
        return f"{value:,.0f}".replace(",", "\u202f")
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{min(places, 6)}f}".replace(",", "\u202f")


def valid(value):
    return value if isinstance(value, (int, float)) and math.isfinite(value) else None


def is_ours(tool):
    return tool.lower().startswith("decimate")


class Camera:
    """Looks along one direction at the reference's bounding box, which fills the picture, as render.py does."""

    def __init__(self, mesh, view, up, width, max_aspect=1.3):
        bounds = np.array(mesh.bounds).reshape(3, 2)
        self.centre, self.diagonal = bounds.mean(axis=1), np.linalg.norm(bounds[:, 1] - bounds[:, 0])
        self.direction = np.array(view) / np.linalg.norm(view)
        self.right = np.cross(up, self.direction)
        self.right /= np.linalg.norm(self.right)
        self.up = np.cross(self.direction, self.right)
        seen = np.asarray(mesh.points) - self.centre
        across, along = seen @ self.right, seen @ self.up
        self.centre = (self.centre + self.right * (across.max() + across.min()) / 2
                       + self.up * (along.max() + along.min()) / 2)
        half_width, half_height = np.ptp(across) / 2, np.ptp(along) / 2
        aspect = min(max(half_height / half_width, 0.45), max_aspect)
        self.size = (width, round(width * aspect))
        self.scale = 1.06 * max(half_height, half_width * aspect)

    def image(self, mesh, scalars=None, top=None):
        plotter = pyvista.Plotter(off_screen=True, border=False, lighting="none",
                                  window_size=[SUPERSAMPLES * side for side in self.size])
        plotter.set_background("white")
        if scalars is None:
            # What the mesh carries, if anything, shows better with less shade.
            shown = render.look(mesh)
            plotter.add_mesh(mesh, **(shown or {"color": SURFACE}), ambient=0.35 if shown else 0.12,
                             diffuse=0.7 if shown else 1.0, specular=0.0)
        else:
            plotter.add_mesh(mesh, scalars=scalars, cmap=COLORS, clim=(0, top), above_color=ABOVE,
                             show_scalar_bar=False, interpolate_before_map=True, ambient=0.55, diffuse=0.5,
                             specular=0.0)
        camera = plotter.camera
        camera.focal_point, camera.position = self.centre, self.centre + self.direction * self.diagonal * 2
        camera.up, camera.parallel_projection, camera.parallel_scale = self.up, True, self.scale
        plotter.renderer.ResetCameraClippingRange()
        key = 1.0 * self.up - 0.9 * self.right + 0.7 * self.direction
        for offset, intensity in ((key, 0.75), (self.direction, 0.5)):
            plotter.renderer.add_light(pyvista.Light(position=self.centre + offset * self.diagonal,
                                                     focal_point=self.centre, light_type="scene light",
                                                     intensity=intensity))
        image = Image.fromarray(plotter.screenshot(return_img=True)).resize(self.size, Image.Resampling.LANCZOS)
        plotter.close()
        return image

    def jpeg(self, *what):
        data = io.BytesIO()
        self.image(*what).save(data, "JPEG", quality=85, optimize=True)
        return data.getvalue()


@functools.lru_cache(maxsize=1)
def ruler(path):
    """The reference mesh, and a search tree over its triangles."""
    mesh = render.read(pathlib.Path(path))
    distance = vtkImplicitPolyDataDistance()
    distance.SetInput(mesh)
    return mesh, distance


def distances(mesh, distance, diagonal, samples):
    """The mesh, cut finer so that the error inside of large faces shows, and the distance at each of its points."""
    fine = mesh.copy()
    fine.clear_data()
    fine = fine.clean(tolerance=0.0).triangulate()
    # Double precision, as rounding would turn the normals of the small triangles, and of size 1 around 0, as VTK's
    # subdivision tears holes where coordinates are in the hundreds.
    centre = np.array(fine.center)
    fine.points = (fine.points.astype(np.float64) - centre) / diagonal
    # A triangle has at most twice its share of the area, and no edge is much longer than the side of such a one.
    longest = max(math.sqrt(4 * fine.area / samples), 1e-4)
    fine = fine.subdivide_adaptive(max_edge_len=longest, max_n_passes=12, max_n_tris=8 * samples)
    fine.points = fine.points * diagonal + centre
    points, found = numpy_to_vtk(np.ascontiguousarray(fine.points, dtype=np.float64)), vtkDoubleArray()
    found.SetNumberOfTuples(fine.n_points)
    distance.FunctionValue(points, found)
    return fine, np.abs(vtk_to_numpy(found)) / diagonal


def load(output):
    """The output's mesh and a hash of its bytes, or nothing where the tool left none."""
    if not output.get("file"):
        return None, None
    path = pathlib.Path(output["file"])
    try:
        data = path.read_bytes()
        return render.read(path), hashlib.sha256(data).hexdigest()
    except (OSError, SystemExit, ValueError, IndexError, StopIteration) as error:
        print(f"no picture of {output['tool']}: {error}", file=sys.stderr)
        return None, None


def best_of(outputs, column, target):
    """The best number of a column as it is printed; nothing where all are the same."""
    key, _, factor, digits, less, easier = column
    if less is None:
        return None
    found = [v for o in outputs if (v := valid(o.get(key))) is not None
             and not (easier and (o.get("triangles") or 0) > target * EXTRA_TRIANGLES)]
    printed = {number(v * factor, digits) for o in outputs if (v := valid(o.get(key))) is not None}
    return number((min if less else max)(found) * factor, digits) if found and len(printed) > 1 else None


def table(outputs, target):
    shown = [c for c in COLUMNS if any(valid(o.get(c[0])) is not None for o in outputs)]
    best = {c[0]: best_of(outputs, c, target) for c in shown}
    rows = ["<tr><th>tool</th>" + "".join(f"<th>{c[1]}</th>" for c in shown) + "</tr>"]
    for output in outputs:
        over = (output.get("triangles") or 0) > target * EXTRA_TRIANGLES
        cells = []
        for key, _, factor, digits, _, easier in shown:
            value = valid(output.get(key))
            text = number(None if value is None else value * factor, digits)
            wins = text == best[key] and not (easier and over)
            off = " class=off" if key == "triangles" and over else ""
            cells.append(f"<td{off}>{f'<b>{text}</b>' if wins else text}</td>")
        ours = " class=ours" if is_ours(output["tool"]) else ""
        rows.append(f"<tr{ours}><td>{html.escape(output['tool'])}</td>{''.join(cells)}</tr>")
    note = ""
    if any((o.get("triangles") or 0) > target * EXTRA_TRIANGLES for o in outputs):
        note = ("<p class=note>Red: more than 2 % over the count asked for; such an output's errors are not in the "
                "contest for the best.</p>")
    return f"<div class=wide><table>{''.join(rows)}</table></div>{note}"


def legend(top):
    stops = ", ".join(matplotlib.colors.to_hex(COLORS(k / 16)) for k in range(17))
    return (f"<div class=legend>Distance to the original, 10⁻⁴ of the diagonal<div class=bar><i style='background:"
            f"linear-gradient(90deg, {stops})'></i><i style='background:{ABOVE}'></i></div><div class=ends>"
            f"<span>0</span><span class=mid>{number(top * 5e3)}</span><span class=top>{number(top * 1e4)}</span>"
            f"<span class=more>more</span></div></div>")


def figure(caption, *pictures, below=""):
    images = "".join(f"<img src='{data_uri('jpeg', data)}' alt='{html.escape(alt, quote=True)}' loading=lazy>"
                     for data, alt in pictures)
    return f"<figure><figcaption>{caption}</figcaption>{images}{below}</figure>"


def measure(case, samples):
    """The reference, and (mesh, the tools' outputs, finer mesh, error at its points) of each file; the colours' top.

    As a by-product each output gets the hash of its file.
    """
    reference, distance = ruler(case["reference"])
    diagonal = np.linalg.norm(np.diff(np.array(reference.bounds).reshape(3, 2)))
    groups = {}
    for output in case["outputs"]:
        mesh, output["hash"] = load(output)
        if mesh is not None:
            groups.setdefault(output["hash"], (mesh, []))[1].append(output)
    measured = [(mesh, outputs, *distances(mesh, distance, diagonal, samples)) for mesh, outputs in groups.values()]
    # The middle one of the tools decides the scale, so that one bad output does not darken the rest.
    top = float(np.median([np.percentile(error, 99) for *_, error in measured])) if measured else 0.0
    return reference, measured, max(top, 1e-7)


def rms_text(output):
    rms = valid(output.get("rms_of_diagonal"))
    return f"rms {number(None if rms is None else rms * 1e4)}"


def pictures(case, camera, options):
    """The figures of a case."""
    reference, measured, top = measure(case, options.samples)
    figures = [figure(f"original<br><span>{number(reference.n_cells, None)} triangles</span>",
                      (camera.jpeg(reference), "original"), below=legend(top))]
    for mesh, outputs, fine, error in measured:
        title = " = ".join(o["tool"] for o in outputs)
        caption = (f"{html.escape(title)}<br><span>{number(mesh.n_cells, None)} triangles, {rms_text(outputs[0])}"
                   "</span>")
        figures.append(figure(caption, (camera.jpeg(mesh), f"output of {title}"),
                              (camera.jpeg(fine, error, top), f"error of {title}")))
    return f"<div class=views>{''.join(figures)}</div>"


def picture(case, view, options):
    """The figures of a case as one image, a column each; legible at half its size."""
    reference, measured, top = measure(case, options.samples)
    camera = Camera(reference, *view, options.width, max_aspect=2.0)
    width, height = camera.size
    size = width // 12
    fonts = [ImageFont.truetype(pathlib.Path(matplotlib.get_data_path()) / f"fonts/ttf/{name}.ttf", size)
             for name in ("DejaVuSans-Bold", "DejaVuSans")]
    line = round(1.3 * size)
    head = 3 * line + size
    image = Image.new("RGB", (width * (1 + len(measured)), head + 2 * height + size), "white")
    draw = ImageDraw.Draw(image)

    def column(k, texts, *images):
        for row, text in enumerate(texts):
            draw.text(((k + 0.5) * width, row * line + size // 3), text, "#1c1c1c", fonts[min(row, 1)], anchor="ma")
        for row, part in enumerate(images):
            image.paste(part, (k * width, head + row * (height + size)))

    def triangles(mesh):
        return f"{number(mesh.n_cells, None)} triangles"

    column(0, ["original", triangles(reference)], camera.image(reference))
    ours = sum(is_ours(outputs[0]["tool"]) for _, outputs, *_ in measured)
    for k, (mesh, outputs, fine, error) in enumerate(measured, 1):
        is_only = ours == 1 and is_ours(outputs[0]["tool"])
        name = "decimate" if is_only else " = ".join(o["tool"] for o in outputs)
        column(k, [name, triangles(mesh), rms_text(outputs[0])], camera.image(mesh), camera.image(fine, error, top))
    # The scale stands under the original, which has no error.
    left, right, above = size, width - size, head + height + size + height // 3
    middle = left + (right - left) * 3 // 5
    for row, text in enumerate(["distance to the", "original, 10⁻⁴", "of the diagonal"]):
        draw.text((width / 2, above + (row - 3) * line - size // 2), text, "#1c1c1c", fonts[1], anchor="ma")
    for x in range(left, right):
        color = matplotlib.colors.to_hex(COLORS((x - left) / (middle - left))) if x < middle else ABOVE
        draw.line((x, above, x, above + size), color)
    for x, text, anchor in ((left, "0", "la"), (middle, number(top * 1e4), "ma"), (right, "more", "ra")):
        draw.text((x, above + size * 5 // 4), text, "#1c1c1c", fonts[1], anchor=anchor)
    return image


def plot(cases, key, name):
    """Log-log lines of one mesh; tools with the same files in all cases are one line."""
    lines = {}
    for case in cases:
        for output in case["outputs"]:
            lines.setdefault(output["tool"], []).append((output.get("triangles"), valid(output.get(key)),
                                                         output.get("hash")))
    merged = {}
    for tool, points in lines.items():
        same = tuple(h for *_, h in points)
        merged.setdefault(same if all(same) else tool, (points, []))[1].append(tool)
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "report", "font.size": 10,
                                "font.family": "sans-serif"}):
        drawing, axes = pyplot.subplots(figsize=(6.2, 4.0), layout="constrained")
        for k, (points, tools) in enumerate(merged.values()):
            points = sorted((t, v * 1e4) for t, v, _ in points if t and v and v > EXACT)
            if points:
                # Ours lies on top, wider.
                ours = is_ours(tools[0])
                axes.loglog(*zip(*points), label=" = ".join(tools), color=LINES[k % len(LINES)],
                            marker=MARKERS[k % len(MARKERS)], markersize=5, linewidth=2.2 if ours else 1.3,
                            zorder=3 if ours else 2)
        if not axes.lines:
            pyplot.close(drawing)
            return ""
        axes.set(xlabel="triangles kept", ylabel=f"{name}, 10⁻⁴ of the diagonal")
        plain = matplotlib.ticker.FuncFormatter(lambda value, _: f"{value:,.7g}".replace(",", " "))
        for axis in (axes.xaxis, axes.yaxis):
            # Ticks at 1, 2 and 5, so that a span of less than a decade has numbers, too.
            axis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5), numticks=12))
            axis.set_major_formatter(plain)
            axis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        axes.grid(True, which="major", color="#dddddd", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=9)
        data = io.BytesIO()
        drawing.savefig(data, format="svg", metadata={"Date": None})
        pyplot.close(drawing)
    return f"<img src='{data_uri('svg+xml', data.getvalue())}' alt='{name} against triangles kept'>"


def summary(cases):
    """Each tool's geometric mean of its numbers over the best in the case, and its rms in each case."""
    tools = list(dict.fromkeys(o["tool"] for case in cases for o in case["outputs"]))
    headings = {c[0]: c[1] for c in COLUMNS}
    easier = {c[0]: c[5] for c in COLUMNS}
    shown = [key for key in SUMMARY if any(valid(o.get(key)) is not None for c in cases for o in c["outputs"])]
    ratios = {(tool, key): [] for tool in tools for key in shown}
    for case in cases:
        for key in shown:
            found = {o["tool"]: max(v, 1e-12) for o in case["outputs"] if (v := valid(o.get(key))) is not None
                     and not (easier[key] and (o.get("triangles") or 0) > case["target"] * EXTRA_TRIANGLES)}
            for tool, value in found.items():
                if min(found.values()) > EXACT:  # an exact output leaves nothing to divide by
                    ratios[tool, key].append(value / min(found.values()))
    means = {k: math.exp(sum(map(math.log, v)) / len(v)) if v else None for k, v in ratios.items()}
    most = {key: max(len(ratios[tool, key]) for tool in tools) for key in shown}

    def cell(tool, key):
        value = means[tool, key]
        text = "–" if value is None else f"{value:.2f}"
        best = min(means[t, key] for t in tools if means[t, key] is not None and len(ratios[t, key]) == most[key])
        if value is not None and len(ratios[tool, key]) < most[key]:
            return f"<td>{text} <span class=note>({len(ratios[tool, key])} of {most[key]})</span></td>"
        return f"<td><b>{text}</b></td>" if value is not None and text == f"{best:.2f}" else f"<td>{text}</td>"

    shown = [key for key in shown if most[key]]
    rows = ["<tr><th>times the best</th>" + "".join(f"<th>{headings[key]}</th>" for key in shown) + "</tr>"]
    for tool in tools:
        ours = " class=ours" if is_ours(tool) else ""
        rows.append(f"<tr{ours}><td>{html.escape(tool)}</td>{''.join(cell(tool, key) for key in shown)}</tr>")
    column = next(c for c in COLUMNS if c[0] == "rms_of_diagonal")
    details = ["<tr><th>rms, 10⁻⁴ of the diagonal</th><th>kept</th>"
               + "".join(f"<th>{html.escape(tool)}</th>" for tool in tools) + "</tr>"]
    for case in cases:
        best, outputs = best_of(case["outputs"], column, case["target"]), {o["tool"]: o for o in case["outputs"]}
        cells = []
        for tool in tools:
            output = outputs.get(tool, {})
            value = valid(output.get(column[0]))
            text = number(None if value is None else value * 1e4)
            over = (output.get("triangles") or 0) > case["target"] * EXTRA_TRIANGLES
            cells.append("<td class=off>" + text + "</td>" if over else
                         f"<td>{f'<b>{text}</b>' if text == best else text}</td>")
        details.append(f"<tr><td><a href='#{case['anchor']}'>{html.escape(case['name'])}</a></td>"
                       f"<td>{case['ratio'] * 100:g} %</td>{''.join(cells)}</tr>")
    return (f"<p>Geometric means over {len(cases)} cases of each number over the best in its case: 1.00 is the best in "
            f"every case.</p><div class=wide><table>{''.join(rows)}</table></div>"
            f"<div class=wide><table>{''.join(details)}</table></div>")


def prepare(cases):
    """Fills in names, anchors and the count of triangles that was asked for; groups the cases by mesh."""
    groups = {}
    for case in cases:
        case["name"] = pathlib.Path(case["mesh"]).stem
        case["reference"] = case.get("reference") or case["mesh"]
        groups.setdefault(case["mesh"], []).append(case)
    for k, group in enumerate(groups.values()):
        group.sort(key=lambda case: -case["ratio"])
        for case in group:
            case["anchor"] = f"mesh-{k + 1}"
            case["target"] = ruler(case["reference"])[0].n_cells * case["ratio"]
    return groups


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=pathlib.Path, metavar="RESULTS.json", help="written by regress.py or attributes.py")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, metavar="OUT")
    parser.add_argument("--picture", nargs=2, metavar=("MESH", "RATIO"),
                        help="instead of the page a PNG of this case, the mesh by its name without suffix")
    parser.add_argument("--title", default="decimate beside other simplifiers")
    parser.add_argument("--width", type=int, default=400, help="of each view, in pixels (default 400)")
    parser.add_argument("--samples", type=int, default=30_000,
                        help="triangles that the error is coloured on, at least (default 30000)")
    parser.add_argument("--view", nargs=7, action="append", default=[],
                        metavar=("MESH", "X", "Y", "Z", "UX", "UY", "UZ"),
                        help="for a mesh, by its name without suffix: direction to the camera, and what is up there; "
                             "may be repeated (default -0.35 -1 0.3 and 0 0 1)")
    options = parser.parse_args()
    views = VIEWS | {name: (tuple(map(float, v[:3])), tuple(map(float, v[3:]))) for name, *v in options.view}

    groups = prepare(json.loads(options.results.read_text())["cases"])
    if options.picture:
        name, ratio = options.picture
        try:
            ratio = float(ratio)
        except ValueError:
            parser.error(f"--picture: {ratio} is no ratio")
        case = next((c for group in groups.values() for c in group if (c["name"], c["ratio"]) == (name, ratio)), None)
        if case is None:
            parser.error(f"--picture: no {name} at {ratio:g} in {options.results}")
        # The method that keeps the scale's rare colours as well as the shades.
        image = picture(case, views.get(name, VIEW), options).quantize(
            method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        image.save(options.output, "PNG", optimize=True)
        print(f"{options.output}: {options.output.stat().st_size} bytes", file=sys.stderr)
        return
    sections = []
    for path, cases in groups.items():
        name = cases[0]["name"]
        print(name, file=sys.stderr)
        reference, _ = ruler(cases[0]["reference"])
        camera = Camera(reference, *views.get(name, VIEW), options.width)
        parts = [f"<h3>{case['ratio'] * 100:g} % kept</h3>{pictures(case, camera, options)}"
                 f"{table(case['outputs'], case['target'])}" for case in cases]
        plots = "".join(plot(cases, key, heading) for key, heading in
                        (("rms_of_diagonal", "rms"), ("hausdorff_of_diagonal", "Hausdorff")))
        plots = plots and f"<h3>Error against triangles kept</h3><div class=plots>{plots}</div>"
        sections.append(f"<h2 id='{cases[0]['anchor']}'>{html.escape(name)}</h2><p class=note>"
                        f"{html.escape(pathlib.Path(path).name)}, {number(reference.n_cells, None)} triangles</p>"
                        f"{''.join(parts)}{plots}")
    title = html.escape(options.title)
    page = f"""<!DOCTYPE html>
<html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width, initial-scale=1">
<title>{title}</title><style>{STYLE}</style>
<h1>{title}</h1>
<p>Rms, mean and Hausdorff are distances between output and original, both ways, measured by
<code>decimate compare</code>, in 10⁻⁴ of the diagonal of the original's bounding box. Normals: mean deviation.
Quality: 4√3 · area over the sum of the squared edges, 1 for equilateral triangles. Seconds and MB: the tool's call
alone, and the growth of its memory. Normals carried, texture and colour: rms of the difference between a sample's value
and that at the nearest point, both ways. Turned in texture: triangles that run the other way round there than the
original's. <b>Bold</b>: the best. The colours show one way only, from the output to the
original: a part that got lost has none.</p>
{summary([case for cases in groups.values() for case in cases])}
{''.join(sections)}
</html>
"""
    options.output.write_text(page, encoding="utf-8")
    print(f"{options.output}: {options.output.stat().st_size / 1e6:.2f} MB", file=sys.stderr)


if __name__ == "__main__":
    main()
