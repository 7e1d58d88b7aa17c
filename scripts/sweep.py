#!/usr/bin/env python3
"""Run our command in every tier, quality and number of threads on meshes of every size, and plot speed and memory.

    sweep.py MESH… --ratios 0.1 --qualities fast standard --threads 1 2 4 --runs 3 --csv sweep.csv --plots plots
    sweep.py MESH… --ratios 0.5 0.1 0.02 --qualities standard --threads 1 --chunks auto off --plots plots
    sweep.py --read sweep.csv --plots plots                         the plots again

Each run is a process of its own; of one mesh and ratio the settings take turns, so that what else the machine does
strikes all alike. The CSV has one row a run. The table and the plots have the median of the runs, or with --minimum the
fastest one's seconds and the least bytes. M triangles/s are triangles of the input a second of building and decimating,
without reading, cleaning and writing. The plots:

    size.png     M triangles/s against the size of the mesh, a line for each quality and family of meshes
    threads.png  M triangles/s against the number of threads
    tiers.png    M triangles/s in each tier
    bytes.png    bytes a triangle: the mesh's and the loop's own arrays, and the peak of the whole process
    figure7.png  the paper's Figure 7: thousand triangles removed a second against thousand removed, a line a tier, the
                 mesh as a whole and in chunks; below, against the bytes of the tier

Meshes of one family have one name but for the size at its end: terrain_1m.ply, terrain_4m.ply.

Exits with 1 where the bytes of the output are not the same in all tiers, with all numbers of threads and in all runs of
a mesh, ratio and quality; with 2 where the command failed.
"""
import argparse
import csv
import hashlib
import itertools
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

TIERS = ["full", "medium", "small"]
QUALITIES = ["fast", "standard", "best"]
MEASURED = ["clean_seconds", "build_seconds", "decimate_seconds", "read_seconds", "write_seconds", "mesh_bytes",
            "working_bytes", "peak_rss_bytes"]
CASE, SETTING = ["mesh", "triangles_in", "ratio"], ["quality", "chunks", "tier", "threads"]
COLUMNS = [*CASE, *SETTING, "run", *MEASURED, "triangles_out", "sha256"]
BYTES = {"full": 68, "medium": 44, "small": 32}
COLOURS = {"fast": "tab:green", "standard": "tab:blue", "best": "tab:red"}
MARKERS = "os^Dv*PX<>"


class Failed(Exception):
    """A command that did not do its work, with what it said."""


def run(binary, mesh, ratio, quality, chunks, tier, threads, out):
    """One row, without the number of the run."""
    command = [binary, mesh, "-o", out, "--ratio", ratio, "--quality", quality, "--chunks", chunks, "--tier", tier,
               "--threads", threads, "--quiet", "--report", "-"]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise Failed(f"{' '.join(map(str, command))}\n{done.stderr}")
    report = json.loads(done.stdout)
    with open(out, "rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"mesh": mesh.name, "triangles_in": report["triangles_in"], "ratio": ratio, "quality": quality,
            "chunks": chunks, "tier": tier, "threads": threads, **{key: report[key] for key in MEASURED},
            "triangles_out": report["triangles_out"], "sha256": digest}


def sweep(options):
    """All rows; each stands in the CSV as soon as it is there."""
    rows = []
    settings = list(itertools.product(options.qualities, options.chunks, options.tiers, options.threads))
    with tempfile.TemporaryDirectory() as folder, open(options.csv, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for mesh, ratio in itertools.product(options.meshes, options.ratios):
            for turn in range(1, options.runs + 1):
                for setting in settings:
                    row = run(options.decimate, mesh, ratio, *setting, pathlib.Path(folder) / "out.ply")
                    rows.append({**row, "run": turn})
                    writer.writerow(rows[-1])
                    file.flush()
    return rows


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for key in ["ratio", *MEASURED]:
            row[key] = float(row[key] or "nan")
        for key in ["triangles_in", "threads", "run", "triangles_out"]:
            row[key] = int(row[key])
    return rows


def grouped(rows, keys):
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return groups


def different(rows):
    """One line for each mesh, ratio, quality and choice of chunks whose outputs are not all the same bytes."""
    lines = []
    for (mesh, _, ratio, quality, chunks), group in grouped(rows, [*CASE, "quality", "chunks"]).items():
        settings = {}
        for row in group:
            settings.setdefault(row["sha256"], set()).add(f"{row['tier']} {row['threads']}")
        if len(settings) > 1:
            parts = (f"{digest[:12]} ({', '.join(sorted(found))})" for digest, found in settings.items())
            lines.append(f"{mesh} {ratio:g} {quality}, chunks {chunks}: {' ≠ '.join(parts)}")
    return lines


def summary(rows, statistic):
    """One row for each mesh, ratio and setting, with its speed and its bytes a triangle."""
    found = []
    for key, group in grouped(rows, CASE + SETTING).items():
        case = dict(zip(CASE + SETTING, key))
        triangles = case["triangles_in"]
        seconds = statistic(r["build_seconds"] + r["decimate_seconds"] for r in group)
        case |= {name: statistic(r[name] for r in group) for name in MEASURED}
        case |= {f"{name}_per_triangle": case[name] / triangles for name in MEASURED if name.endswith("_bytes")}
        removed = (triangles - group[0]["triangles_out"]) / 1e3
        found.append({**case, "seconds": seconds, "million_triangles_per_second": triangles / seconds / 1e6,
                      "thousand_removed": removed, "thousand_removed_per_second": removed / seconds})
    return found


def print_table(cases):
    print("| mesh | triangles in | ratio | quality | chunks | tier | threads | clean s | build s | decimate s "
          "| M triangles/s | thousand removed/s | mesh bytes a triangle | working | peak of all |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    for case in cases:
        print("|", " | ".join([
            case["mesh"], str(case["triangles_in"]), f"{case['ratio']:g}", case["quality"], case["chunks"],
            case["tier"], str(case["threads"]), *(f"{case[f'{k}_seconds']:.3f}" for k in ("clean", "build", "decimate")),
            f"{case['million_triangles_per_second']:.2f}", f"{case['thousand_removed_per_second']:.0f}",
            *(f"{case[f'{k}_bytes_per_triangle']:.0f}" for k in ("mesh", "working", "peak_rss"))]), "|")


def tier_table(cases):
    """The tiers with their words, bytes and speeds: geometric means over all meshes and ratios with one thread."""
    words = {"full": "tail, head, previous, next, opposite | –",
             "medium": "head, previous, opposite | tail = head(prev), next = prev(prev)",
             "small": "head, opposite | prev, next by e % 3; tail = head(prev)"}
    columns = [("standard", "off"), ("standard", "auto"), ("fast", "off"), ("fast", "auto")]
    names = [f"{quality}, {'whole' if chunks == 'off' else 'chunks'}" for quality, chunks in columns]
    lines = ["| tier | stored per directed edge | computed | bytes per triangle | " + " | ".join(names) + " |",
             "|---|---|---|--:|" + "--:|" * len(columns)]
    for tier in TIERS:
        speeds = []
        for column in columns:
            found = [case["thousand_removed_per_second"] for case in cases
                     if (case["quality"], case["chunks"]) == column and (case["tier"], case["threads"]) == (tier, 1)]
            speeds.append(f"{statistics.geometric_mean(found):.0f}" if found else "–")
        lines.append(f"| {tier} | {words[tier]} | {BYTES[tier]} | " + " | ".join(speeds) + " |")
    return "\n".join(lines)


def write_between(path, mark, text):
    """Puts text between `<!-- mark -->` and `<!-- /mark -->`."""
    old = path.read_text()
    begin, end = f"<!-- {mark} -->\n", f"\n<!-- /{mark} -->"
    if begin not in old or end not in old:
        raise Failed(f"{path}: no <!-- {mark} --> … <!-- /{mark} -->")
    before, rest = old.split(begin, 1)
    path.write_text(before + begin + text + end + rest.split(end, 1)[1])


def family(mesh):
    """The mesh's name without the size at its end."""
    return re.sub(r"[_-]?\d+[km]?$", "", pathlib.Path(mesh).stem, flags=re.IGNORECASE) or mesh


def panels(ratios):
    """A figure with one panel for each ratio, and its panels."""
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, len(ratios), figsize=(3 + 5 * len(ratios), 5), squeeze=False, sharey=True)
    for ratio, axis in zip(ratios, axes[0]):
        axis.set_title(f"ratio {ratio:g}")
        axis.grid(True, which="both", alpha=0.3)
    return figure, axes[0]


def save(figure, axis, title, path):
    axis.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1))
    figure.suptitle(title)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    print(path, file=sys.stderr)


def plot_lines(cases, name_of, x, title, path, ticks=None):
    """Speed against the column `x`: a line for each quality (its colour) and name (its marker), a panel a ratio."""
    ratios = sorted({case["ratio"] for case in cases}, reverse=True)
    names = list(dict.fromkeys(name_of(case) for case in cases))
    figure, axes = panels(ratios)
    for ratio, axis in zip(ratios, axes):
        for name, quality in itertools.product(names, COLOURS):
            line = sorted((ticks.index(case[x]) if ticks else case[x], case["million_triangles_per_second"])
                          for case in cases
                          if (case["ratio"], name_of(case), case["quality"]) == (ratio, name, quality))
            if line:
                axis.plot(*zip(*line), marker=MARKERS[names.index(name) % len(MARKERS)], color=COLOURS[quality],
                          label=f"{name}, {quality}")
        if ticks:
            axis.set_xticks(range(len(ticks)), ticks)
        axis.set_xlabel(x.replace("_", " "))
        axis.set_ylim(bottom=0)
    if x == "triangles_in":
        for axis in axes:
            axis.set_xscale("log")
    axes[0].set_ylabel("M triangles/s (build + decimate)")
    save(figure, axes[-1], title, path)


def plot_bytes(cases, title, path):
    """A panel a quality; each mesh has a bar in each tier, and a point above it for the peak of the process."""
    from matplotlib import pyplot
    qualities = [q for q in COLOURS if any(case["quality"] == q for case in cases)]
    meshes = list(dict.fromkeys(case["mesh"] for case in cases))
    tiers = [tier for tier in TIERS if any(case["tier"] == tier for case in cases)]
    figure, axes = pyplot.subplots(1, len(qualities), figsize=(3 + 5 * len(qualities), 5), squeeze=False, sharey=True)
    width = 0.8 / len(tiers)
    for quality, axis in zip(qualities, axes[0]):
        for k, tier in enumerate(tiers):
            bars = [case for case in cases if (case["quality"], case["tier"]) == (quality, tier)]
            at = [meshes.index(case["mesh"]) + (k - (len(tiers) - 1) / 2) * width for case in bars]
            mesh, working, peak = ([case[f"{name}_bytes_per_triangle"] for case in bars]
                                   for name in ("mesh", "working", "peak_rss"))
            colour = f"C{k}"
            axis.bar(at, mesh, width * 0.92, color=colour, label=f"{tier}: mesh")
            axis.bar(at, working, width * 0.92, bottom=mesh, color=colour, alpha=0.45, label=f"{tier}: working")
            axis.plot(at, peak, "_", color=colour, markersize=14, label=f"{tier}: peak of the process")
        axis.set_title(quality)
        axis.set_xticks(range(len(meshes)), meshes, rotation=30, ha="right", fontsize="small")
        axis.grid(True, axis="y", alpha=0.3)
    axes[0][0].set_ylabel("bytes a triangle of the input")
    save(figure, axes[0][-1], title, path)


def plot_figure7(cases, path):
    """Thousand triangles removed a second, a column for each choice of chunks: above against thousand removed, a line a
    tier (its colour) and mesh (its marker); below against the tier's bytes, a line for each mesh and ratio."""
    from matplotlib import pyplot
    choices = [choice for choice in ["off", "auto"] if any(case["chunks"] == choice for case in cases)]
    meshes = list(dict.fromkeys(case["mesh"] for case in cases))
    ratios = sorted({case["ratio"] for case in cases}, reverse=True)
    figure, axes = pyplot.subplots(2, len(choices), figsize=(4 + 5 * len(choices), 10), squeeze=False, sharey=True)
    for choice, (above, below) in zip(choices, axes.T):
        for name, tier in itertools.product(meshes, TIERS):
            line = sorted((case["thousand_removed"], case["thousand_removed_per_second"]) for case in cases
                          if (case["chunks"], case["mesh"], case["tier"]) == (choice, name, tier))
            if line:
                above.plot(*zip(*line), marker=MARKERS[meshes.index(name) % len(MARKERS)],
                           color=f"C{TIERS.index(tier)}", label=f"{tier}, {pathlib.Path(name).stem}")
        for name, ratio in itertools.product(meshes, ratios):
            line = sorted((BYTES[case["tier"]], case["thousand_removed_per_second"]) for case in cases
                          if (case["chunks"], case["mesh"], case["ratio"]) == (choice, name, ratio))
            if line:
                below.plot(*zip(*line), marker=MARKERS[meshes.index(name) % len(MARKERS)],
                           color=f"C{3 + ratios.index(ratio)}", label=f"to {ratio:.3g}, {pathlib.Path(name).stem}")
        above.set_title("as a whole" if choice == "off" else "in chunks")
        above.set_xscale("log")
        above.set_xlabel("thousand triangles removed")
        below.set_xlabel("bytes a triangle of the tier")
        below.set_xticks(list(BYTES.values()))
        for axis in (above, below):
            axis.grid(True, which="both", alpha=0.3)
    # Once all lines are there: the panels share this axis.
    axes[0][0].set_ylim(bottom=0)
    for row in axes:
        row[0].set_ylabel("thousand triangles removed a second")
    axes[0][-1].legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1))
    quality, threads = cases[0]["quality"], cases[0]["threads"]
    save(figure, axes[1][-1], f"Figure 7 of the paper, measured: {quality}, threads {threads}", path)


def plot(cases, folder):
    import matplotlib
    matplotlib.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    for quality in QUALITIES:
        one = [case for case in cases if case["quality"] == quality]
        one = [case for case in one if case["threads"] == min(case["threads"] for case in one)]
        if one and len({case["tier"] for case in one}) > 1:
            name = "figure7.png" if quality == "standard" else f"figure7_{quality}.png"
            plot_figure7(one, folder / name)
    # The other plots compare what users get.
    cases = [case for case in cases if case["chunks"] == "auto"]
    if not cases:
        return
    cases = sorted(cases, key=lambda case: (family(case["mesh"]), case["triangles_in"]))
    tiers = [tier for tier in TIERS if any(case["tier"] == tier for case in cases)]
    threads = sorted({case["threads"] for case in cases})
    ratio = min(case["ratio"] for case in cases)
    in_tier = [case for case in cases if case["tier"] == tiers[0]]
    alone = [case for case in cases if case["threads"] == threads[0]]
    plot_lines([case for case in in_tier if case in alone], lambda case: family(case["mesh"]), "triangles_in",
               f"Speed by size: tier {tiers[0]}, threads {threads[0]}", folder / "size.png")
    plot_lines(in_tier, lambda case: case["mesh"], "threads", f"Speed by threads: tier {tiers[0]}",
               folder / "threads.png", threads)
    plot_lines(alone, lambda case: case["mesh"], "tier", f"Speed by tier: threads {threads[0]}", folder / "tiers.png",
               tiers)
    plot_bytes([case for case in alone if case["ratio"] == ratio], f"Memory: threads {threads[0]}, ratio {ratio:g}",
               folder / "bytes.png")


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", type=pathlib.Path, metavar="MESH")
    parser.add_argument("--ratios", nargs="+", type=float, default=[0.1], metavar="R",
                        help="fractions of the triangles to keep (default 0.1)")
    parser.add_argument("--qualities", nargs="+", default=QUALITIES, choices=QUALITIES)
    parser.add_argument("--chunks", nargs="+", default=["auto"], metavar="CHUNKS",
                        help="as the command takes them: auto, off or a number of triangles (default auto)")
    parser.add_argument("--tiers", nargs="+", default=TIERS, choices=TIERS)
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2], metavar="N")
    parser.add_argument("--runs", type=int, default=3, metavar="N", help="of every setting (default 3)")
    parser.add_argument("--minimum", action="store_true", help="of the runs, in the place of the median")
    parser.add_argument("--csv", type=pathlib.Path, default="sweep.csv", metavar="FILE",
                        help="where the runs go (default sweep.csv)")
    parser.add_argument("--read", type=pathlib.Path, metavar="FILE", help="a CSV of this script, and run nothing")
    parser.add_argument("--readme", type=pathlib.Path, metavar="FILE",
                        help="puts the table of the tiers between <!-- tiers --> and <!-- /tiers --> there")
    parser.add_argument("--plots", type=pathlib.Path, metavar="FOLDER", help="where the plots go")
    parser.add_argument("--decimate", default="target/release/decimate", metavar="BINARY")
    options = parser.parse_args()
    if bool(options.meshes) == bool(options.read):
        parser.error("either MESH… or --read FILE")
    if len({mesh.name for mesh in options.meshes}) < len(options.meshes):
        parser.error("two meshes have the same name")
    if options.runs < 1:
        parser.error("--runs: at least 1")
    return options


def main():
    options = parse()
    try:
        rows = read(options.read) if options.read else sweep(options)
    except (Failed, OSError) as failure:
        print(f"error: {failure}", file=sys.stderr)
        return 2
    cases = summary(rows, min if options.minimum else statistics.median)
    print_table(cases)
    if options.plots:
        plot(cases, options.plots)
    if options.readme:
        try:
            write_between(options.readme, "tiers", tier_table(cases))
        except Failed as failure:
            print(f"error: {failure}", file=sys.stderr)
            return 2
    wrong = different(rows)
    print()
    for line in wrong:
        print(f"WRONG: {line}")
    print(f"{len(rows)} runs, {len(wrong)} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
