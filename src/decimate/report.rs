//! What a run did, in numbers with units.

use serde::Serialize;

use crate::clean::Cleaning;
use crate::mesh::Tier;

/// Why decimation stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum StopReason {
    /// The number of triangles asked for is reached.
    Target,
    /// Every collapse that is left would exceed the largest error (or is blocked otherwise).
    MaxError,
    /// No collapse is left that keeps the topology, turns no face and moves no locked vertex.
    Blocked,
}

/// Why the edges that are left cannot be collapsed, counted when decimation stopped short.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Blocked {
    /// The topology would change.
    pub link: usize,
    /// A face would turn by more than 90° or lose its area.
    pub flip: usize,
    /// Both ends are locked.
    pub lock: usize,
    /// The estimated error would exceed the largest allowed.
    pub error: usize,
}

/// What the loop counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Tally {
    /// Collapses done.
    pub collapses: usize,
    /// Of these, the ones that touched something non-manifold: a vertex at an end of the edge or
    /// across from it in a dying face.
    pub collapses_non_manifold: usize,
    /// Collapses, of these, that changed the topology, where that was allowed.
    pub contractions: usize,
    /// Faces added to close gaps, where that was allowed.
    pub filled_faces: usize,
    /// Handles pinched, where that was allowed.
    pub pinched_handles: usize,
    /// Components removed, where that was allowed.
    pub removed_components: usize,
    /// Refusals because the topology would have changed.
    pub rejected_link: usize,
    /// Refusals because a face would have turned.
    pub rejected_flip: usize,
    /// Edges never considered because both ends are locked.
    pub rejected_lock: usize,
    /// Refusals because of the largest error.
    pub rejected_error: usize,
    /// The most bytes that the loop's own arrays held at once, or the chunks.
    pub working_bytes: usize,
}

impl Tally {
    /// Counts what was counted elsewhere as well.
    pub(super) fn add(&mut self, other: &Self) {
        self.collapses += other.collapses;
        self.collapses_non_manifold += other.collapses_non_manifold;
        self.contractions += other.contractions;
        self.filled_faces += other.filled_faces;
        self.pinched_handles += other.pinched_handles;
        self.removed_components += other.removed_components;
        self.rejected_link += other.rejected_link;
        self.rejected_flip += other.rejected_flip;
        self.rejected_lock += other.rejected_lock;
        self.rejected_error += other.rejected_error;
        self.working_bytes = self.working_bytes.max(other.working_bytes);
    }
}

/// What a run did. Serialised, the keys are the command's report.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// Vertices of the input, before cleaning.
    pub vertices_in: usize,
    /// Triangles of the input, before cleaning; polygons count as their fans.
    pub triangles_in: usize,
    /// What cleaning found and did.
    #[serde(flatten)]
    pub cleaning: Cleaning,
    /// Faces turned round to agree with their neighbours while decimating (undone on writing).
    pub reoriented_faces: usize,
    /// Edges of the input that are kept as curves since attributes or groups differ across them.
    pub attribute_seam_edges: usize,
    /// Non-manifold edges of the cleaned input.
    pub non_manifold_edges_in: usize,
    /// The number of triangles asked for; 0 where only an error was given.
    pub target_triangles: usize,
    /// The largest error asked for, in model units.
    pub max_error: Option<f64>,
    /// Vertices of the output.
    pub vertices_out: usize,
    /// Triangles of the output; folded double-sided ones count as two.
    pub triangles_out: usize,
    /// Why it stopped.
    pub stop_reason: StopReason,
    /// Whether fewer triangles were asked for than could be reached without exceeding the error.
    pub stopped_short: bool,
    /// Why the edges that are left cannot be collapsed, where it stopped before the target.
    pub blocked: Option<Blocked>,
    /// What the loop counted.
    #[serde(flatten)]
    pub tally: Tally,
    /// The largest estimated distance of an output vertex from the original, in model units.
    pub max_error_estimate: f64,
    /// The tier that was used.
    pub tier: Tier,
    /// Why that tier.
    pub tier_reason: String,
    /// The bytes of the whole mesh when it was built, behind the chunks if there were any: the tier's
    /// words, positions and side tables.
    pub mesh_bytes: usize,
    /// Chunks that were decimated on their own before the whole; 0 for a small mesh.
    pub chunks: usize,
    /// How often the mesh was cut into chunks.
    pub chunk_rounds: usize,
    /// Of the collapses, those in chunks.
    pub collapses_in_chunks: usize,
    /// Seconds spent on chunks: part of `decimate_seconds`.
    pub chunk_seconds: f64,
    /// Seconds to read the file; filled in by whoever read it.
    pub read_seconds: f64,
    /// Seconds to weld, drop and fold.
    pub clean_seconds: f64,
    /// Seconds to build connectivity.
    pub build_seconds: f64,
    /// Seconds to evaluate all candidates, collapse, and compact.
    pub decimate_seconds: f64,
    /// Seconds to write the file; filled in by whoever wrote it.
    pub write_seconds: f64,
    /// The most bytes that were allocated at once; filled in by whoever counts allocations.
    pub peak_heap_bytes: Option<u64>,
    /// The most memory that the process held at once; filled in by whoever can ask the system.
    pub peak_rss_bytes: Option<u64>,
}
