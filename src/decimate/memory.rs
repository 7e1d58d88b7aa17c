//! How much memory there is, how much a tier needs, and so which to take.

use super::chunked::{Sizes, left_by_chunks};
use super::options::{AttributeUse, Options, Quality, TierChoice};
use crate::attributes::Channel;
use crate::error::{Error, Result};
use crate::indexed_mesh::IndexedMesh;
use crate::mesh::Tier;

/// What fitting takes a triangle of the original: 18 for its arrays, 36 to sort it into cells, and as
/// much for what is left of it.
const FITTING_BYTES: usize = 90;

/// What collapsing takes a vertex, for its tensor or quadric, stamps and deviation, and a triangle, for
/// the queue.
const COLLAPSING_VERTEX: usize = 48;
const COLLAPSING_FACE: usize = 36;

/// The most bytes that decimating a manifold mesh as a whole in a tier holds at once: the tier's words and
/// positions; tensors or quadrics, stamps, deviations and the queue, or what fitting takes.
///
/// Building holds less: 60 bytes a triangle and 24 a vertex before the tier's words are made, 24 a
/// triangle beside them.
pub fn needed_bytes(quality: Quality, tier: Tier, vertices: usize, triangles: usize) -> u64 {
    let collapsing = COLLAPSING_VERTEX * vertices + COLLAPSING_FACE * triangles;
    let most = match quality {
        Quality::Fast | Quality::Standard => collapsing,
        Quality::Best => (collapsing + 12 * (vertices + triangles)).max(FITTING_BYTES * triangles),
    };
    (tier.bytes(vertices, triangles) + most) as u64
}

/// The memory that could be taken now without swapping, in bytes: the system's, or less where a
/// container limits it; without bound where the system does not say.
pub fn available_bytes() -> u64 {
    let Ok(mut system) = sysinfo::System::new() else {
        return u64::MAX;
    };
    system.refresh_memory();
    let limit = system
        .cgroup_limits()
        .map_or(u64::MAX, |limits| limits.free_memory);
    system.available_memory().min(limit)
}

/// The most memory that this process has held at once, in bytes.
///
/// From the system's own high-water mark where it is readable without unsafe code (Linux);
/// elsewhere the memory held now, which at the end of a run is a lower bound.
pub fn peak_rss_bytes() -> Option<u64> {
    let high_water_mark = || {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
        let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
        Some(kibibytes * 1024)
    };
    let held_now = || {
        let id = sysinfo::get_current_pid().ok()?;
        let mut system = sysinfo::System::new().ok()?;
        system.refresh_processes(sysinfo::ProcessesToUpdate::Some(&[id]), false);
        Some(system.process(id)?.memory())
    };
    high_water_mark().or_else(held_now)
}

/// The same where the mesh is decimated in chunks.
fn bytes_in_chunks(
    sizes: &Sizes,
    quality: Quality,
    tier: Tier,
    vertices: usize,
    triangles: usize,
) -> u64 {
    let arrays = 12 * (vertices + triangles);
    let per_triangle = tier.bytes(1, 2) / 2 + (COLLAPSING_VERTEX / 2 + COLLAPSING_FACE);
    let chunks = sizes.bytes(vertices, triangles, per_triangle);
    let most = match quality {
        Quality::Fast | Quality::Standard => arrays + chunks,
        Quality::Best => 2 * arrays + chunks.max(FITTING_BYTES * triangles),
    };
    most as u64
}

/// The tiers by speed. Over four meshes of 70 000 to 1 M triangles at four ratios, small is 1.11 times
/// as fast as full on meshes as wholes and 1.06 in chunks with the standard quality, 1.16 and 1.11 with
/// the fast one (medium 1.10, 1.04, 1.11, 1.05): what takes fewer bytes waits less for them
/// (`data/results/figure7.md`).
const BY_SPEED: [Tier; 3] = [Tier::Small, Tier::Medium, Tier::Full];

/// What there is to decimate.
pub(super) struct Load {
    vertices: usize,
    triangles: usize,
    /// The most bytes that attributes take meanwhile, beside all else.
    carried_bytes: u64,
}

impl Load {
    /// The load that a mesh is.
    pub fn of(mesh: &IndexedMesh, options: &Options) -> Self {
        let attributes = mesh.attributes();
        let numbers: usize = attributes.channels.iter().map(Channel::width).sum();
        let words = 3 * attributes.corners.len() + attributes.group_of.len();
        let words = match options.attributes {
            AttributeUse::Ignore => 0,
            AttributeUse::Carry => words + attributes.wedge_count() * numbers,
            AttributeUse::Optimize if attributes.wedge_count() > 0 => {
                let rows = numbers + super::cost::attribute_stride(numbers);
                words + attributes.wedge_count() * rows + mesh.positions().len().div_ceil(4)
            }
            AttributeUse::Optimize => words,
        };
        Self {
            vertices: mesh.positions().len(),
            triangles: mesh.triangles().len(),
            carried_bytes: 4 * words as u64,
        }
    }
}

/// The tier to use, and why.
pub(super) fn choose_tier(options: &Options, load: &Load, target: usize) -> Result<(Tier, String)> {
    let &Load {
        vertices,
        triangles,
        carried_bytes,
    } = load;
    let tier = match options.tier {
        TierChoice::Fixed(tier) => Some(tier),
        TierChoice::Auto => None,
    };
    let left = left_by_chunks(triangles, target);
    let chunks = Sizes::of(options.chunks, triangles, triangles, left);
    let needed = |tier| {
        carried_bytes
            + match &chunks {
                Some(sizes) => bytes_in_chunks(sizes, options.quality, tier, vertices, triangles),
                None => needed_bytes(options.quality, tier, vertices, triangles),
            }
    };
    if let (Some(tier), None) = (tier, options.memory_limit_bytes) {
        return Ok((tier, "asked for".into()));
    }
    let (limit, whose) = match options.memory_limit_bytes {
        Some(limit) => (limit, "the memory limit"),
        None => (available_bytes(), "the memory that is free"),
    };
    let fits = |tier: &Tier| needed(*tier) <= limit;
    let choices = tier.map_or(BY_SPEED.to_vec(), |tier| vec![tier]);
    let explain = |tier| {
        format!(
            "{} needed, {whose} is {}",
            megabytes(needed(tier)),
            megabytes(limit)
        )
    };
    match (choices.into_iter().find(fits), options.memory_limit_bytes) {
        (Some(tier), _) if options.tier == TierChoice::Fixed(tier) => {
            Ok((tier, "asked for".into()))
        }
        (Some(tier), _) => Ok((tier, format!("the fastest that fits: {}", explain(tier)))),
        (None, Some(limit_bytes)) => {
            let least = tier.unwrap_or(Tier::Small);
            Err(Error::Memory {
                tier: least.name(),
                needed_bytes: needed(least),
                limit_bytes,
            })
        }
        (None, None) => Ok((Tier::Small, format!("none fits: {}", explain(Tier::Small)))),
    }
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decimate::options::Chunks;

    fn chosen(tier: TierChoice, limit: u64) -> Result<Tier> {
        let options = Options {
            tier,
            memory_limit_bytes: Some(limit),
            ..Options::default()
        };
        let load = Load {
            vertices: 500_000,
            triangles: 1_000_000,
            carried_bytes: 0,
        };
        choose_tier(&options, &load, 1_000_000).map(|(tier, _)| tier)
    }

    /// A million triangles: the fastest tier takes the least, too, so that it is taken down to its need
    /// and nothing below; one that was asked for is not exchanged.
    #[test]
    fn auto_takes_the_fastest_that_fits() {
        let needed = |tier| needed_bytes(Quality::Standard, tier, 500_000, 1_000_000);
        for limit in Tier::ALL.map(needed) {
            assert_eq!(chosen(TierChoice::Auto, limit).unwrap(), Tier::Small);
        }
        assert!(chosen(TierChoice::Auto, needed(Tier::Small) - 1).is_err());
        for tier in Tier::ALL {
            let fixed = TierChoice::Fixed(tier);
            assert_eq!(chosen(fixed, needed(tier)).unwrap(), tier);
            assert!(chosen(fixed, needed(tier) - 1).is_err());
        }
    }

    /// A tenth of a million triangles in chunks takes less than two thirds of what the whole takes in
    /// the full tier, and in the small one, whose pilot is smaller, less than that.
    #[test]
    fn chunks_need_less() {
        let sizes = Sizes::of(Chunks::Auto, 1_000_000, 1_000_000, 125_000.0).unwrap();
        for quality in [Quality::Fast, Quality::Standard] {
            let [full, small] = [Tier::Full, Tier::Small]
                .map(|tier| bytes_in_chunks(&sizes, quality, tier, 500_000, 1_000_000));
            let whole = needed_bytes(quality, Tier::Full, 500_000, 1_000_000);
            assert!(
                small < full && 3 * full < 2 * whole,
                "{small} {full} {whole}"
            );
        }
    }

    #[test]
    fn a_limit_that_cannot_be_kept_is_refused_with_what_is_needed() {
        let error = chosen(TierChoice::Fixed(Tier::Full), 1_000_000)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("full") && error.contains("1.0 MB"),
            "{error}"
        );
    }

    #[test]
    fn the_peak_is_at_least_what_a_test_holds() {
        let held = vec![1u8; 1 << 20];
        assert!(peak_rss_bytes().unwrap() > held.len() as u64);
        assert!(available_bytes() > 0);
    }
}
