//! What a caller can ask for.

use crate::attributes::Kind;
use crate::error::{Error, Result};
use crate::mesh::Tier;

/// When to stop. The first that is reached stops; at least one must be given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Targets {
    /// The fraction of the triangles to keep, 0 to 1: the target is floor(ratio × triangles).
    pub ratio: Option<f64>,
    /// The number of triangles to keep.
    pub triangles: Option<usize>,
    /// The largest estimated distance from the original surface, in model units. An estimate, not
    /// a bound: distances to the planes of the faces around a collapse, added up.
    pub max_error: Option<f64>,
}

/// How much time to spend on how near the result is to the original.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quality {
    /// Quadrics of the original's planes, added up (Garland & Heckbert 1997): half the time.
    Fast,
    /// Planes, folds and volume of the surface as it is (after Lindstrom & Turk 1999).
    #[default]
    Standard,
    /// The same, and the result is fitted to the original: twice the time.
    Best,
}

/// What may happen to the boundary. The topology of its loops is kept in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Boundary {
    /// Boundary edges weigh more than surface: the boundary keeps its shape.
    #[default]
    Keep,
    /// Boundary vertices stay where they are, bit for bit.
    Lock,
    /// Boundary edges weigh nothing: the boundary may shrink.
    Free,
}

/// What may happen to the topology.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Topology {
    /// It stays: components, boundary loops, handles, non-manifold curves, enclosed pockets.
    #[default]
    Preserve,
    /// Components may vanish, pockets fall flat, gaps and holes close, handles be pinched off: each for what it costs in area
    /// and distance, the cheapest first. Nothing tears and nothing non-manifold is born.
    Simplify,
}

/// Where the vertex that is left of an edge goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Placement {
    /// Where the cost is least.
    #[default]
    Optimal,
    /// To the better end: output vertices are a subset of the input's, bit for bit.
    Endpoint,
}

/// Whether pieces of the mesh that fit in the cache are decimated on their own, under one common
/// threshold, before the whole is. It changes the result, by a percent or two, since edges between
/// pieces wait; memory, to a fraction; and time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Chunks {
    /// Where the mesh is large enough to be quicker that way, and is not to keep most of its triangles.
    #[default]
    Auto,
    /// Never.
    Off,
    /// Wherever the mesh is several times as large: pieces of at most about so many triangles.
    Triangles(usize),
}

/// What becomes of what a mesh [carries](crate::attributes::Attributes) beside positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum AttributeUse {
    /// It is dropped.
    Ignore,
    /// It is interpolated along each edge that collapses, and costs nothing. Groups of faces stay
    /// apart; seams are not kept.
    Carry,
    /// It has its part in what a collapse costs and where its vertex goes, and takes the values that
    /// are best there (Hoppe 1999). Seams stay seams: collapses go along them, on both sides at once,
    /// and no texture triangle turns over.
    #[default]
    Optimize,
}

/// How much attributes weigh against positions: a change by the unit that is named, over an area, weighs
/// as much as a distance of so much of the mesh's diagonal, about, over the same area. Where no weight is
/// given, one that suits the number of triangles that are left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct AttributeWeights {
    /// A normal's change by a radian, about; else 0.0045 for 5 000 triangles.
    pub normal: Option<f64>,
    /// A colour's change from black to white; else 0.01 for 5 000 triangles.
    pub color: Option<f64>,
    /// A texture's shift on the surface, relative to the shift: 1 for a distance as long; else 0.03.
    pub texture: Option<f64>,
    /// A scalar's change by all that there is between the least and the greatest; else 0.
    pub scalar: Option<f64>,
}

impl AttributeWeights {
    /// The weight of a kind where so many triangles are to be left.
    ///
    /// Those of normals and colours that are not given fall with the fourth root of the number: of
    /// what is smooth the squared error falls with the square of the number, as the geometry's does, so
    /// that one weight would do; of what is rough or has edges it falls with the number itself, so that
    /// the weight's square should, and this lies between. Measured with *standard* at 50, 10 and 2 % on
    /// meshes of 5 to 134 thousand triangles beside meshoptimizer and VTK: with one weight for all,
    /// fine results have better attributes than theirs and pay for it with rms, coarse ones worse. A
    /// texture's error lies at its seams, whatever its weight.
    pub fn of(&self, kind: Kind, triangles: usize) -> f64 {
        /// Of so many triangles that the weights are for.
        const TRIANGLES: f64 = 5000.0;
        let by_number = || (TRIANGLES / triangles.max(1) as f64).sqrt().sqrt();
        match kind {
            Kind::Normal => self.normal.unwrap_or_else(|| 0.0045 * by_number()),
            Kind::Color => self.color.unwrap_or_else(|| 0.01 * by_number()),
            Kind::TextureCoordinate => self.texture.unwrap_or(0.03),
            Kind::Scalar => self.scalar.unwrap_or(0.0),
        }
    }
}

/// Which memory tier to decimate in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TierChoice {
    /// The fastest by measurement of those that fit the memory limit.
    #[default]
    Auto,
    /// This one.
    Fixed(Tier),
}

/// Everything a caller can choose. `Options { targets, ..Options::default() }` reads well.
#[derive(Clone, Debug)]
pub struct Options {
    /// When to stop.
    pub targets: Targets,
    /// How near to come, for how much time.
    pub quality: Quality,
    /// What may happen to the boundary.
    pub boundary: Boundary,
    /// What may happen to the topology.
    pub topology: Topology,
    /// Where merged vertices go.
    pub placement: Placement,
    /// Edges at which the surface turns by more than this are kept as curves; none where not given.
    pub feature_angle_degrees: Option<f64>,
    /// What becomes of normals, colours, texture coordinates, groups and the like.
    pub attributes: AttributeUse,
    /// How much they weigh.
    pub attribute_weights: AttributeWeights,
    /// Whether pieces of the mesh are decimated on their own first.
    pub chunks: Chunks,
    /// The memory tier.
    pub tier: TierChoice,
    /// The bytes that decimation may use, for [`TierChoice::Auto`]; the memory that is free where
    /// it is not given.
    pub memory_limit_bytes: Option<u64>,
    /// Whether vertices at equal positions become one first.
    pub weld: bool,
    /// Whether every invariant of the mesh is verified after every collapse (linear time each).
    pub check: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            targets: Targets::default(),
            quality: Quality::default(),
            boundary: Boundary::default(),
            topology: Topology::default(),
            placement: Placement::default(),
            feature_angle_degrees: None,
            attributes: AttributeUse::default(),
            attribute_weights: AttributeWeights::default(),
            chunks: Chunks::default(),
            tier: TierChoice::default(),
            memory_limit_bytes: None,
            weld: true,
            check: false,
        }
    }
}

impl Options {
    /// Verifies that every number lies in its range.
    ///
    /// # Errors
    /// [`Error::InvalidOptions`] that names the number and what was expected.
    pub fn check(&self) -> Result<()> {
        self.targets.triangles_of(0)?;
        let AttributeWeights {
            normal,
            color,
            texture,
            scalar,
        } = self.attribute_weights;
        for (name, weight) in [
            ("normal", normal),
            ("color", color),
            ("texture", texture),
            ("scalar", scalar),
        ] {
            if let Some(weight) = weight.filter(|w| !(w.is_finite() && *w >= 0.0)) {
                return Err(Error::InvalidOptions(format!(
                    "{name} weight {weight}: a number of 0 or more is expected"
                )));
            }
        }
        match self.feature_angle_degrees {
            Some(degrees) if !(0.0..=180.0).contains(&degrees) => Err(Error::InvalidOptions(
                format!("feature angle {degrees}: an angle of 0 to 180 degrees is expected"),
            )),
            _ => Ok(()),
        }
    }
}

impl Targets {
    /// The number of triangles to stop at, of `triangles`.
    ///
    /// # Errors
    /// [`Error::InvalidOptions`] where no target is given or one lies outside its range.
    pub fn triangles_of(&self, triangles: usize) -> Result<usize> {
        let Self {
            ratio,
            triangles: wanted,
            max_error,
        } = *self;
        if ratio.is_none() && wanted.is_none() && max_error.is_none() {
            return Err(Error::InvalidOptions(
                "no target: give a ratio, a number of triangles or a largest error".into(),
            ));
        }
        if let Some(ratio) = ratio.filter(|r| !(0.0..=1.0).contains(r)) {
            return Err(Error::InvalidOptions(format!(
                "ratio {ratio}: the fraction of triangles to keep lies between 0 and 1"
            )));
        }
        if let Some(error) = max_error.filter(|e| !(e.is_finite() && *e >= 0.0)) {
            return Err(Error::InvalidOptions(format!(
                "largest error {error}: a finite length in model units, 0 or more, is expected"
            )));
        }
        let of_ratio = ratio.map(|r| (r * triangles as f64).floor() as usize);
        // The first target that is reached stops, and that is the larger number.
        Ok(of_ratio.max(wanted).unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_target_is_reached_first() {
        let both = Targets {
            ratio: Some(0.1),
            triangles: Some(300),
            max_error: None,
        };
        assert_eq!(both.triangles_of(1000).unwrap(), 300);
        assert_eq!(both.triangles_of(9999).unwrap(), 999);
    }

    #[test]
    fn targets_outside_their_range_are_refused() {
        for targets in [
            Targets::default(),
            Targets {
                ratio: Some(1.5),
                ..Targets::default()
            },
            Targets {
                ratio: Some(-0.1),
                ..Targets::default()
            },
            Targets {
                ratio: Some(f64::NAN),
                ..Targets::default()
            },
            Targets {
                max_error: Some(-1.0),
                ..Targets::default()
            },
            Targets {
                max_error: Some(f64::INFINITY),
                ..Targets::default()
            },
        ] {
            assert!(targets.triangles_of(10).is_err(), "{targets:?}");
        }
    }
}
