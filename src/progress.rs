//! How far work has come, told to whoever asked, who may cancel it.
//!
//! Who asks hands down one function. It is called on the thread that it came from, never from
//! another one, about every 65 000 triangles of work and where a stage begins. What it is told
//! depends on the mesh, the options and the number of threads alone, not on time.

use std::ops::ControlFlow;

/// How far work has come.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// What is being done.
    pub stage: Stage,
    /// The share of all the work that is done, about: from 0 to 1, never less than before, and 1
    /// exactly when it is over.
    pub fraction: f64,
}

/// What is being done. Stages are entered in this order, those left out that a mesh does not need.
///
/// Two come again: where neighbouring faces disagree, where the boundary is locked or creases are
/// kept, a mesh that is decimated in chunks is built before it is cut, too; and under a largest
/// error [the best quality](crate::decimate::Quality::Best) collapses and fits in turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Stage {
    /// Welds, drops and folds what is no simplicial complex.
    Clean,
    /// Decimates chunk by chunk, what they have in common found by a pilot first.
    Chunks,
    /// Builds the connectivity of what is decimated as a whole.
    Build,
    /// Collapses edges of the whole.
    Collapse,
    /// Fits the result to the original.
    Fit,
    /// Puts the result together.
    Assemble,
}

impl Stage {
    /// What is being done, as a word or two in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Clean => "cleaning",
            Stage::Chunks => "decimating chunks",
            Stage::Build => "building",
            Stage::Collapse => "collapsing",
            Stage::Fit => "fitting",
            Stage::Assemble => "assembling",
        }
    }
}

impl std::fmt::Display for Stage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// Whoever followed the work does not want it any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cancelled;

/// A result of work that may be cancelled.
pub(crate) type Result<T> = std::result::Result<T, Cancelled>;

/// So much work is done between two calls, about: a unit is what it takes to visit a triangle, 10 to
/// 50 ns, so that a call comes every millisecond or so and costs nothing beside it.
const EVERY: u64 = 1 << 16;

/// Elements that a loop visits between two words about it.
pub(crate) const BLOCK: usize = 1 << 14;

/// What a collapse takes, per triangle that it removes.
pub(crate) const COLLAPSE: usize = 8;

/// Counts work, and says how far it is to whoever follows.
pub(crate) struct Meter<'a> {
    follower: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
    stage: Stage,
    /// The fraction where the stage began, and the one that it leads to.
    span: [f64; 2],
    /// The work of the stage, as it was estimated, and what of it is done.
    expected: u64,
    done: u64,
    /// The work since the last call.
    since: u64,
}

impl<'a> Meter<'a> {
    /// Counts for a follower.
    pub fn new(follower: &'a mut dyn FnMut(Progress) -> ControlFlow<()>) -> Self {
        Self {
            follower: Some(follower),
            ..Self::unheard()
        }
    }

    /// Counts for nobody, who never cancels.
    pub fn unheard() -> Self {
        Self {
            follower: None,
            stage: Stage::Clean,
            span: [0.0; 2],
            expected: 1,
            done: 0,
            since: 0,
        }
    }

    /// Begins a stage that takes this share of the work that is left, and so many units.
    pub fn begin(&mut self, stage: Stage, share: f64, expected: usize) -> Result<()> {
        let now = self.fraction();
        self.stage = stage;
        self.span = [now, now + share * (1.0 - now)];
        self.expected = expected.max(1) as u64;
        self.done = 0;
        self.tell()
    }

    /// So many units of the stage's work are done.
    #[inline(always)]
    pub fn work(&mut self, units: usize) -> Result<()> {
        self.done += units as u64;
        self.detour(units)
    }

    /// So many units are spent on what was not expected.
    #[inline(always)]
    pub fn detour(&mut self, units: usize) -> Result<()> {
        self.since += units as u64;
        if self.since < EVERY {
            return Ok(());
        }
        self.tell()
    }

    /// All is done.
    pub fn end(&mut self) -> Result<()> {
        self.span = [1.0; 2];
        self.tell()
    }

    /// Between the bounds of the stage: where more is done than was expected, the upper one.
    fn fraction(&self) -> f64 {
        let [from, to] = self.span;
        let of_stage = (self.done as f64 / self.expected as f64).min(1.0);
        (from + of_stage * (to - from)).min(to)
    }

    #[cold]
    fn tell(&mut self) -> Result<()> {
        self.since = 0;
        let progress = Progress {
            stage: self.stage,
            fraction: self.fraction(),
        };
        let follower = self.follower.as_mut();
        if follower.is_some_and(|follower| follower(progress).is_break()) {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }
}

/// The result of work that nobody follows.
pub(crate) fn unheard<T>(work: impl FnOnce(&mut Meter) -> Result<T>) -> T {
    let done = work(&mut Meter::unheard());
    done.unwrap_or_else(|Cancelled| unreachable!("nobody is there to cancel"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However wrong the estimates are, a fraction never falls and stays between 0 and 1; the call
    /// that cancels is the last.
    #[test]
    fn a_fraction_never_falls() {
        let script = |meter: &mut Meter| {
            for (stage, expected) in [(Stage::Clean, 0), (Stage::Build, 1), (Stage::Fit, 1 << 20)] {
                meter.begin(stage, 0.7, expected)?;
                for _ in 0..10 {
                    meter.work(EVERY as usize / 3 + 1)?;
                }
                meter.detour(EVERY as usize)?;
            }
            meter.end()
        };
        let mut all = Vec::new();
        for last in 1.. {
            let mut calls: Vec<Progress> = Vec::new();
            let mut follower = |progress| {
                calls.push(progress);
                if calls.len() == last {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            };
            let ended = script(&mut Meter::new(&mut follower));
            let fractions: Vec<f64> = calls.iter().map(|p| p.fraction).collect();
            assert!(fractions.is_sorted(), "{fractions:?}");
            assert!(fractions.iter().all(|f| (0.0..=1.0).contains(f)));
            assert!(calls.starts_with(&all));
            all = calls;
            if ended.is_ok() {
                assert_eq!(all.len(), last - 1);
                break;
            }
            assert_eq!(all.len(), last);
        }
        assert_eq!(all.len(), 3 * (1 + 3 + 1) + 1);
        assert_eq!(all.last().unwrap().fraction, 1.0);
    }
}
