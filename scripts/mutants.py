#!/usr/bin/env python3
"""Break the library on purpose, in one place at a time, and say which of its tests notice.

    mutants.py               all breaks, each before the one test that was written for it
    mutants.py 9 10 --all    two of them, before all of the library's tests

All breaks are built into one copy of the last commit, each behind a switch that the environment turns on, so that there
is one build and not one for each. Exits with 1 where no test notices a break, or one fails without any.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SWITCH = """
/// Whether this break is on.
pub(crate) fn mutant(number: u32) -> bool {
    static ON: std::sync::LazyLock<u32> = std::sync::LazyLock::new(|| std::env::var("MUTANT").map_or(0, |n| n.parse().unwrap()));
    *ON == number
}
"""
# What breaks, the file in src/, what stands there once, and what then does (ON says whether the break is on); the test
# that is there to notice, by the begin of its name.
MUTANTS = [
    ("link condition: other common neighbours allowed", "mesh/collapse.rs",
     "!self.has_other_common_neighbour(u, v, &apexes) &&", "(ON || !self.has_other_common_neighbour(u, v, &apexes)) &&",
     "collapses_keep_tables_and_topology"),
    ("link condition between disks: the same", "mesh/disk.rs", "!is_common &&", "(ON || !is_common) &&",
     "collapses_keep_tables_and_topology"),
    ("link condition between disks: a tetrahedron collapses", "mesh/disk.rs", "&& !is_tetrahedron", "&& (ON || !is_tetrahedron)",
     "collapses_keep_tables_and_topology"),
    ("link condition: a common edge across allowed", "mesh/collapse.rs",
     "&& !self.has_common_link_edge(u, v, &star)", "&& (ON || !self.has_common_link_edge(u, v, &star))",
     "collapses_keep_tables_and_topology"),
    ("collapse: a mate not linked back", "mesh/collapse.rs",
     "self.set_opposite(a, Opposite::Edge(b));", "if !ON { self.set_opposite(a, Opposite::Edge(b)); }",
     "collapses_keep_tables_and_topology"),
    ("collapse: the wrong mate", "mesh/collapse.rs", "(behind, b, Opposite::Edge(a))",
     "(behind, b, Opposite::Edge(if ON { self.next(a) } else { a }))",
     "collapses_keep_tables_and_topology"),
    ("collapse: a row of the side table keeps a dead edge", "mesh/collapse.rs",
     "self.edge_rows.replace(row, dying, survivor);", "if !ON { self.edge_rows.replace(row, dying, survivor); }",
     "collapses_keep_tables_and_topology"),
    ("collapse: a row of the side table not freed", "mesh/collapse.rs",
     "self.edge_rows.remove(row);", "if !ON { self.edge_rows.remove(row); }",
     "collapses_keep_tables_and_topology"),
    ("collapse: the outgoing edge of an apex not updated", "mesh/collapse.rs",
     "self.replace_fan(apex, before, leaving);", "if !ON { self.replace_fan(apex, before, leaving); }",
     "collapses_keep_tables_and_topology"),
    ("collapse: the outgoing edge of the merged vertex not updated", "mesh/disk.rs",
     "self.set_outgoing(kept, Outgoing::Fan(first));", "if !ON { self.set_outgoing(kept, Outgoing::Fan(first)); }",
     "collapses_keep_tables_and_topology"),
    ("faces may turn over", "decimate/rules.rs", "(!is_turned).then_some(squared)",
     "(ON || !is_turned).then_some(squared)",
     "what_turns_is_refused"),
    ("tensors not rebuilt", "decimate/cost/memoryless.rs", "&mut self.tensors[x.index()], now[i - first])",
     "&mut self.tensors[x.index()], if ON { Tensor { left: 0, ..Tensor::default() } } else { now[i - first] })",
     "a_cost_follows_what_collapses"),
    ("the volume may change", "decimate/cost/memoryless.rs", "T::choose(is_constrained, x[i] + direction[i] * step, x[i])",
     "T::choose(is_constrained, x[i] + direction[i] * (if ON { T::splat(0.0) } else { step }), x[i])",
     "a_heavy_sphere_keeps_its_volume"),
    ("faces twice not found", "clean.rs", ".chunk_by(|a, b| a.0 == b.0)\n                .filter(|same| same.len() > 1)",
     ".chunk_by(|a, b| a.0 == b.0)\n                .filter(|same| same.len() > 1 && !ON)",
     "each_kind_of_face_is_counted"),
    ("opposite faces dropped and not folded", "clean.rs", "if !folded && (", "if !ON && !folded && (",
     "each_kind_of_face_is_counted"),
    ("the last face dropped", "clean.rs", "t[1] != t[2] && t[2] != t[0];",
     "t[1] != t[2] && t[2] != t[0] && !(ON && i + 1 == triangles.len());",
     "each_kind_of_face_is_counted"),
    ("-0 and 0 not welded", "clean.rs", "positions[a as usize] == positions[b as usize]",
     "positions[a as usize] == positions[b as usize] && !(ON && positions[a as usize].x == 0.0)",
     "equal_positions_are_welded"),
    ("heap: nothing is ever out of date", "decimate/queue.rs",
     "self.current[e.index()] |= OUT_OF_DATE;", "if !ON { self.current[e.index()] |= OUT_OF_DATE; }",
     "the_heap_agrees_with_a_list"),
    ("buckets: nothing is ever out of date", "decimate/queue.rs",
     "self.places[e.index()] |= OUT_OF_DATE_MARK;", "if !ON { self.places[e.index()] |= OUT_OF_DATE_MARK; }",
     "the_buckets_agree_with_a_list"),
    ("chunks: own vertices on a seam may collapse", "decimate/chunked.rs",
     "v >= own || cut.is_shared(begin + v)", "v >= own || (!ON && cut.is_shared(begin + v))",
     "chunks_are_the_same_bytes"),
    ("chunks: no care of the target", "decimate/chunked.rs", "triangles: least + MOST_AT_ONCE",
     "triangles: if ON { 0 } else { least + MOST_AT_ONCE }",
     "chunks_stop_at_the_target"),
    ("chunks: boundaries on a seam not weighed", "decimate/chunked.rs", "for (v, line) in &lines {",
     "for (v, line) in lines.iter().filter(|_| !ON) {",
     "chunks_add_up_to_the_whole"),
    ("chunks: the error so far forgotten", "decimate/chunked.rs", "flat.deviation[v] = kept.deviation;",
     "flat.deviation[v] = if ON { 0.0 } else { kept.deviation };",
     "chunks_stop_at_the_largest_error"),
    ("faces that were turned stay so", "decimate/mod.rs",
     "turn_round(&mut triangles, &turned);", "if !ON { turn_round(&mut triangles, &turned); }",
     "turned_faces_do_not_stand_in_the_way"),
    ("one collapse beyond the target", "decimate/greedy.rs", "if self.triangles <= stop.triangles {",
     "if self.triangles < stop.triangles + usize::from(!ON) {",
     "targets_are_reached_exactly"),
    ("a locked vertex loses its lock", "decimate/surface.rs",
     "if self.is_locked(collapse.removed) {", "if !ON && self.is_locked(collapse.removed) {",
     "a_locked_boundary_keeps_its_bits"),
    ("the error so far forgotten", "decimate/surface.rs", "Some(deviation + moved?)",
     "Some(if ON { moved? } else { deviation + moved? })",
     "how_far_an_end_was_is_added"),
    ("two curves may become one", "decimate/greedy.rs", "if keeps_topology && self.surface.curves.stay_apart(mesh, e)",
     "if keeps_topology && (ON || self.surface.curves.stay_apart(mesh, e))",
     "islands_of_materials_stay"),
    ("curves not counted", "decimate/curves.rs", "self.counts[collapse.kept.index()] = merging.count;",
     "if !ON { self.counts[collapse.kept.index()] = merging.count; }",
     "the_count_is_that_of_a_recount"),
    ("vertices may leave the box", "decimate/geometry.rs", "p.cmpge(self.min).all() && p.cmple(self.max).all()",
     "ON || p.cmpge(self.min).all() && p.cmple(self.max).all()",
     "a_room_ends_a_tenth"),
    ("attribute seams may be crossed", "decimate/surface.rs",
     "AttributeUse::Optimize => wedges.is_seam(mesh, e) ||", "AttributeUse::Optimize => !ON && wedges.is_seam(mesh, e) ||",
     "an_edge_in_color_and_texture"),
    ("texture triangles may turn over", "decimate/wedges.rs",
     "before == 0.0 || before * after > 0.0", "ON || before == 0.0 || before * after > 0.0",
     "no_triangle_turns_over_in_the_texture"),
    ("corners keep the wedge that they had", "decimate/wedges.rs",
     "self.at[e.index()] = wedge_of(self.at[e.index()]);", "if !ON { self.at[e.index()] = wedge_of(self.at[e.index()]); }",
     "a_cost_follows_what_collapses"),
    ("attributes around a merged vertex not summed again", "decimate/cost/attributes.rs",
     "for &v in vertices {\n            let begin", "for &v in vertices.iter().filter(|_| !ON) {\n            let begin",
     "a_cost_follows_what_collapses"),
]


def apply(folder):
    for number, (name, file, old, new, _) in enumerate(MUTANTS, 1):
        path = folder / "src" / file
        source = path.read_text()
        if source.count(old) != 1:
            sys.exit(f"{number} ({name}): stands in {file} {source.count(old)} times: {old}")
        path.write_text(source.replace(old, re.sub(r"\bON\b", f"crate::mutant({number})", new)))
    with open(folder / "src/lib.rs", "a") as file:
        file.write(SWITCH)


def build(folder):
    """The program of the library's tests."""
    done = subprocess.run(["cargo", "test", "--no-run", "--locked", "--lib", "--message-format", "json"], cwd=folder,
                          stdout=subprocess.PIPE, text=True, check=True)
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    return next(m["executable"] for m in found if m.get("executable"))


def failures(folder, binary, number, tests, seconds):
    """The tests that fail while the break is on."""
    try:
        done = subprocess.run([binary, *tests], cwd=folder, env=os.environ | {"MUTANT": str(number)}, capture_output=True,
                              text=True, errors="replace", timeout=seconds)
    except subprocess.TimeoutExpired:
        return ["(does not end)"]
    if "running 0 tests" in done.stdout:
        sys.exit(f"no test is called {' or '.join(tests)}")
    failed = re.findall(r"^test (\S+).* FAILED$", done.stdout, re.M)
    return failed or ([f"(exit status {done.returncode})"] if done.returncode else [])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("numbers", nargs="*", type=int, metavar="NUMBER")
    parser.add_argument("--all", action="store_true", help="run all of the library's tests: minutes a break")
    parser.add_argument("--timeout", type=float, default=600, metavar="SECONDS", help="for one break (default 600)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True)
        subprocess.run(["tar", "x", "-C", folder], input=archive.stdout, check=True)
        apply(folder)
        binary = build(folder)
        print("| | broken | noticed by |\n|--:|---|---|", flush=True)
        numbers = options.numbers or range(1, len(MUTANTS) + 1)
        everything = sorted({MUTANTS[number - 1][-1] for number in numbers})
        is_wrong = False
        for number in [0, *numbers]:
            name, tests = (MUTANTS[number - 1][0], [MUTANTS[number - 1][-1]]) if number else ("nothing", everything)
            failed = failures(folder, binary, number, [] if options.all else tests, options.timeout)
            is_wrong |= bool(failed) == (number == 0)
            noticed = sorted({test.split("::")[-1] for test in failed})
            more = [f"{len(noticed) - 3} more"] if len(noticed) > 3 else []
            print(f"| {number} | {name} | {', '.join(noticed[:3] + more) or '–'} |", flush=True)
    return int(is_wrong)


if __name__ == "__main__":
    sys.exit(main())
