//! The table that `race against` prints: medians over the turns.

use std::fmt::{self, Display, Formatter};

use crate::against::{Case, Ours, Theirs, Turn};

/// The table's head; `with_fast_simplification` where that one takes part.
pub fn head(with_fast_simplification: bool) -> String {
    let mut columns = vec![
        "mesh",
        "triangles in",
        "ratio",
        "quality",
        "tier",
        "threads",
        "ours: build + decimate s",
        "ours: whole call s",
        "M triangles/s",
        "meshoptimizer s",
        "meshoptimizer / ours [min–max]",
        "meshoptimizer / whole call [min–max]",
    ];
    if with_fast_simplification {
        columns.extend([
            "fast-simplification s",
            "fast-simplification / ours [min–max]",
        ]);
    }
    format!(
        "| {} |\n|{}",
        columns.join(" | "),
        "---|".repeat(columns.len())
    )
}

/// A case's rows: one for each of our settings, each with its line's end.
pub struct Rows<'a>(pub &'a Case);

impl Display for Rows<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let case = self.0;
        for setting in 0..case.turns.first().map_or(0, |turn| turn.ours.len()) {
            write_row(f, case, setting)?;
        }
        Ok(())
    }
}

fn write_row(f: &mut Formatter<'_>, case: &Case, setting: usize) -> fmt::Result {
    let over = |value: &dyn Fn(&Turn, &Ours) -> f64| {
        let mut values: Vec<_> = case
            .turns
            .iter()
            .map(|turn| value(turn, &turn.ours[setting]))
            .collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let Ours {
        quality,
        tier,
        threads,
        ..
    } = &case.turns[0].ours[setting];
    let core = median(&over(&|_, ours| core_seconds(ours)));
    write!(
        f,
        "| {} | {} | {} | {quality} | {tier} | {threads} | {core:.3} | {:.3} | {:.2} | {:.3} | {} | {} |",
        case.mesh,
        case.triangles_in,
        case.ratio,
        median(&over(&|_, ours| ours.call_seconds)),
        case.triangles_in as f64 / core / 1e6,
        median(&over(&|turn, _| turn.meshoptimizer.call_seconds)),
        spread(&over(
            &|turn, ours| turn.meshoptimizer.call_seconds / core_seconds(ours)
        )),
        spread(&over(
            &|turn, ours| turn.meshoptimizer.call_seconds / ours.call_seconds
        )),
    )?;
    let seconds = |theirs: &Option<Theirs>| theirs.as_ref().map_or(f64::NAN, |t| t.call_seconds);
    if case.turns[0].fast_simplification.is_some() {
        write!(
            f,
            " {:.3} | {} |",
            median(&over(&|turn, _| seconds(&turn.fast_simplification))),
            spread(&over(&|turn, ours| {
                seconds(&turn.fast_simplification) / core_seconds(ours)
            })),
        )?;
    }
    writeln!(f)
}

fn core_seconds(ours: &Ours) -> f64 {
    ours.build_seconds + ours.decimate_seconds
}

/// Of sorted numbers, of which there is one at least.
fn median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0
}

/// The median of sorted numbers, the least and the largest.
fn spread(sorted: &[f64]) -> String {
    let (min, max) = (sorted[0], sorted[sorted.len() - 1]);
    format!("{:.2} [{min:.2}–{max:.2}]", median(sorted))
}
