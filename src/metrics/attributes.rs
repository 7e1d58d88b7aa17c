//! How far what a mesh carries is from what a reference carries.

use serde::Serialize;
use smallvec::SmallVec;

use super::charts::{self, Charts};
use super::compare::Distances;
use super::surface::{Sample, Surface};
use crate::attributes::{Attributes, Channel, Kind, MAX_COMPONENTS};
use crate::mesh::{Mesh, Small};
use crate::nearest::Nearest;

/// The attributes of a mesh held against those of a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AttributeComparison {
    /// One a channel that both have, in the reference's order.
    pub channels: Vec<ChannelComparison>,
    /// The channels that only the reference has, by [name](ChannelComparison::name).
    pub only_in_reference: Vec<String>,
    /// The channels that only the mesh has.
    pub only_in_mesh: Vec<String>,
}

/// One attribute of a mesh held against that of a reference.
///
/// Samples spread by area over one surface, those of the distances, are held against the point of the
/// other that is nearest: how far is the value there, interpolated between the wedges of its triangle,
/// from the sample's own? Triangles that are nearest up to 10⁻⁶ of the diagonal all count as nearest,
/// and the one whose value is nearest to the sample's is taken, channel by channel: an attribute seam
/// that is where the reference has it is no error.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ChannelComparison {
    /// `normal`, `texture_coordinate` or `color`, with `_1`, `_2`, … for further ones of a kind, which
    /// are matched by their order; a scalar's name in the file, by which it is matched.
    pub name: String,
    /// The unit of the differences.
    pub unit: Unit,
    /// Both directions together, as distances are.
    pub two_sided: Distances,
    /// From the reference to the mesh.
    pub from_reference: Distances,
    /// From the mesh to the reference.
    pub from_mesh: Distances,
    /// The samples that count, of both directions: those with finite values at both points.
    pub samples: usize,
    /// What is known of texture coordinates beside.
    #[serde(flatten)]
    pub texture: Option<TextureComparison>,
}

/// The unit of an attribute's differences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Unit {
    /// The angle between normals, normalised after they were interpolated.
    Degrees,
    /// The distance in the texture, whose sides are 1 long.
    TextureUnits,
    /// The root of the mean square over a colour's components, each as a share of its full range:
    /// black and white are 1 apart, as floats or as bytes.
    OfFullRange,
    /// A scalar's own.
    ScalarUnits,
}

impl Unit {
    fn of(kind: Kind) -> Self {
        match kind {
            Kind::Normal => Self::Degrees,
            Kind::TextureCoordinate => Self::TextureUnits,
            Kind::Color => Self::OfFullRange,
            Kind::Scalar => Self::ScalarUnits,
        }
    }
}

/// The charts of a texture: faces whose texture coordinates go on across their edges.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TextureComparison {
    /// The length on the reference, in model units, that a texture unit has on the whole: the root of
    /// its area over the area in the texture. What differences are to be multiplied by to be lengths.
    pub model_length_per_texture_unit: f64,
    /// The charts of the reference.
    pub reference_charts: usize,
    /// The charts of the mesh.
    pub mesh_charts: usize,
    /// Triangles of the reference that are turned over in the texture against most of their chart.
    /// Not only mistakes: a chart that is folded along an axis of symmetry has half of them.
    pub reference_flipped_chart_triangles: usize,
    /// Triangles of the mesh that are turned over against most of their chart.
    pub mesh_flipped_chart_triangles: usize,
    /// Triangles of the mesh that are turned over in the texture against the reference's triangles
    /// nearest to their centre: this tells flips from folds that are meant.
    pub triangles_turned_against_reference: usize,
}

/// Triangles whose distances differ by less than this share of the diagonal are equally near.
const EQUALLY_NEAR_OF_DIAGONAL: f64 = 1e-6;

/// What a surface carries.
pub(super) struct Carried {
    attributes: Attributes,
    /// One for each channel, in their order; none for those of other kinds than texture coordinates.
    charts: Vec<Option<Charts>>,
}

impl Carried {
    /// What triangles carry whose vertices are so many.
    pub(super) fn of(mut attributes: Attributes, vertices: usize, triangles: &[[u32; 3]]) -> Self {
        // Whichever way a file counts, textures are compared with v upwards.
        if attributes.v_is_down {
            attributes.turn_v();
        }
        let is_texture = |channel: &Channel| channel.kind == Kind::TextureCoordinate;
        let mut charts = Vec::new();
        if attributes.channels.iter().any(is_texture) {
            let mesh = Mesh::<Small>::from_triangles(vertices, triangles);
            let of = |channel| Charts::of(&mesh, &attributes.corners, channel);
            let channels = attributes.channels.iter();
            charts = channels.map(|c| is_texture(c).then(|| of(c))).collect();
        }
        Self { attributes, charts }
    }

    /// Whether there is no channel.
    pub(super) fn is_empty(&self) -> bool {
        self.channels().is_empty()
    }

    fn channels(&self) -> &[Channel] {
        &self.attributes.channels
    }

    fn names(&self) -> Vec<Name> {
        let mut names: Vec<Name> = Vec::new();
        for channel in self.channels() {
            let kind = channel.kind;
            let base = match kind {
                Kind::Normal => "normal",
                Kind::TextureCoordinate => "texture_coordinate",
                Kind::Color => "color",
                Kind::Scalar => {
                    let properties = channel.components.iter().map(|p| p.name.as_str());
                    let text = properties.collect::<Vec<_>>().join("_");
                    names.push(Name { kind, text });
                    continue;
                }
            };
            let text = match names.iter().filter(|name| name.kind == kind).count() {
                0 => base.to_string(),
                n => format!("{base}_{n}"),
            };
            names.push(Name { kind, text });
        }
        names
    }
}

/// What channels are matched by.
#[derive(PartialEq)]
struct Name {
    kind: Kind,
    text: String,
}

/// A surface and what it carries.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub(super) surface: &'a Surface,
    pub(super) carried: &'a Carried,
}

/// Compares attributes, from so many samples on each surface drawn with `seed` and the next.
pub(super) fn compare(
    reference: Side,
    mesh: Side,
    diagonal: f64,
    samples: usize,
    seed: u64,
) -> AttributeComparison {
    let tolerance = EQUALLY_NEAR_OF_DIAGONAL * diagonal;
    let (names, others) = (reference.carried.names(), mesh.carried.names());
    let of_mesh = names
        .iter()
        .map(|name| others.iter().position(|n| n == name));
    let pairs: Vec<[usize; 2]> = of_mesh
        .enumerate()
        .filter_map(|(i, j)| Some([i, j?]))
        .collect();
    let back: Vec<[usize; 2]> = pairs.iter().map(|&[i, j]| [j, i]).collect();
    let from_reference = differences(reference, mesh, &pairs, tolerance, samples, seed);
    let from_mesh = differences(mesh, reference, &back, tolerance, samples, seed + 1);
    let channels = pairs.iter().zip(from_reference.iter().zip(&from_mesh));
    let channels = channels.map(|(&[i, j], (there, back))| {
        let (from_reference, from_mesh) = (there.distances(), back.distances());
        ChannelComparison {
            name: names[i].text.clone(),
            unit: Unit::of(names[i].kind),
            two_sided: Distances::both(from_reference, from_mesh),
            from_reference,
            from_mesh,
            samples: there.samples + back.samples,
            texture: texture(reference, mesh, [i, j], tolerance),
        }
    });
    let only = |names: &[Name], others: &[Name]| {
        let alone = names.iter().filter(|name| !others.contains(name));
        alone.map(|name| name.text.clone()).collect()
    };
    AttributeComparison {
        channels: channels.collect(),
        only_in_reference: only(&names, &others),
        only_in_mesh: only(&others, &names),
    }
}

/// What is known of a pair of channels, one on each side, if they are texture coordinates.
fn texture(
    reference: Side,
    mesh: Side,
    [i, j]: [usize; 2],
    tolerance: f64,
) -> Option<TextureComparison> {
    let of_reference = reference.carried.charts.get(i)?.as_ref()?;
    let of_mesh = mesh.carried.charts.get(j)?.as_ref()?;
    let Attributes {
        corners, channels, ..
    } = &reference.carried.attributes;
    let area = reference.surface.area() / charts::area(corners, &channels[i]);
    Some(TextureComparison {
        model_length_per_texture_unit: area.sqrt(),
        reference_charts: of_reference.count,
        mesh_charts: of_mesh.count,
        reference_flipped_chart_triangles: of_reference.flipped_triangles,
        mesh_flipped_chart_triangles: of_mesh.flipped_triangles,
        triangles_turned_against_reference: of_mesh.turned_against(
            mesh.surface,
            of_reference,
            reference.surface,
            tolerance,
        ),
    })
}

/// A sum over samples.
#[derive(Clone, Copy, Default)]
struct Sums {
    samples: usize,
    squares: f64,
    differences: f64,
    max: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.squares += other.squares;
        self.differences += other.differences;
        self.max = self.max.max(other.max);
    }

    fn distances(&self) -> Distances {
        let n = self.samples.max(1) as f64;
        Distances {
            rms: (self.squares / n).sqrt(),
            mean: self.differences / n,
            max: self.max,
        }
    }
}

/// The differences of channels, given in pairs of this one's and that one's, from samples on one
/// surface to the points of the other nearest to them.
fn differences(
    from: Side,
    to: Side,
    pairs: &[[usize; 2]],
    tolerance: f64,
    samples: usize,
    seed: u64,
) -> Vec<Sums> {
    let value = |side: Side, i: usize, triangle: u32, weights: &[f64; 3]| {
        let corners = side.carried.attributes.corners[triangle as usize];
        value(&side.carried.channels()[i], corners, weights)
    };
    let add = |sums: &mut Vec<Sums>, sample: &Sample, nearest: &Nearest| {
        sums.resize(pairs.len(), Sums::default());
        let mut feet: SmallVec<[(u32, [f64; 3]); 8]> = SmallVec::new();
        let within = nearest.distance_squared.sqrt() + tolerance;
        let triangles = to.surface.triangles();
        triangles.for_each_within(sample.foot.point, within, |triangle, foot| {
            feet.push((triangle, foot.weights));
        });
        for (&[i, j], sums) in pairs.iter().zip(sums) {
            let (one, other) = (&from.carried.channels()[i], &to.carried.channels()[j]);
            let width = one.width().min(other.width());
            let here = value(from, i, sample.triangle, &sample.foot.weights);
            let differences = feet.iter().map(|(triangle, weights)| {
                let there = value(to, j, *triangle, weights);
                difference(one.kind, &here[..width], &there[..width])
            });
            let least = differences.fold(f64::INFINITY, f64::min);
            if least.is_finite() {
                sums.add(&Sums {
                    samples: 1,
                    squares: least * least,
                    differences: least,
                    max: least,
                });
            }
        }
    };
    let mut total = vec![Sums::default(); pairs.len()];
    for block in from.surface.sample(to.surface, samples, seed, &add) {
        total.iter_mut().zip(&block).for_each(|(sum, s)| sum.add(s));
    }
    total
}

/// The value of a channel in a triangle, by the wedges of its corners and barycentric coordinates:
/// a colour as shares of its range, a normal of length 1 or zero.
fn value(channel: &Channel, corners: [u32; 3], weights: &[f64; 3]) -> [f64; MAX_COMPONENTS] {
    let mut value = [0.0; MAX_COMPONENTS];
    for (wedge, &weight) in corners.into_iter().zip(weights) {
        // Zero times what is not finite at a corner across from the point would be no number.
        if weight != 0.0 {
            let row = channel.row(wedge as usize);
            value
                .iter_mut()
                .zip(row)
                .for_each(|(sum, x)| *sum += x * weight);
        }
    }
    match channel.kind {
        Kind::Normal => {
            let length = value.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 {
                value.iter_mut().for_each(|x| *x /= length);
            }
        }
        Kind::Color => {
            for (x, property) in value.iter_mut().zip(&channel.components) {
                *x /= property.number.range().map_or(1.0, |(_, max)| max);
            }
        }
        Kind::TextureCoordinate | Kind::Scalar => {}
    }
    value
}

/// How far two values are apart, in the [`Unit`] of their kind.
fn difference(kind: Kind, a: &[f64], b: &[f64]) -> f64 {
    let squares = |sign: f64| {
        let pairs = a.iter().zip(b);
        pairs
            .map(|(a, b)| (a + sign * b) * (a + sign * b))
            .sum::<f64>()
    };
    match kind {
        // Of unit vectors (Kahan 2006); exact where they are next to the same, and a right angle
        // between one and none.
        Kind::Normal => (2.0 * squares(-1.0).sqrt().atan2(squares(1.0).sqrt())).to_degrees(),
        Kind::Color => (squares(-1.0) / a.len() as f64).sqrt(),
        Kind::TextureCoordinate | Kind::Scalar => squares(-1.0).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::super::{CompareOptions, Comparison, compare};
    use super::*;
    use crate::attributes::{NumberType, Property};
    use crate::indexed_mesh::IndexedMesh;
    use crate::shapes::{Shape, grid};

    const FEW: CompareOptions = CompareOptions {
        samples: 20_000,
        intersections: false,
    };

    /// A channel of single-precision numbers with a row for each position.
    fn channel(
        kind: Kind,
        names: &[&str],
        positions: &[Vec3],
        row: impl Fn(Vec3) -> Vec<f64>,
    ) -> Channel {
        let mut channel = Channel::of_singles(kind, names);
        let values = positions.iter().flat_map(|&p| row(p));
        values.for_each(|x| channel.values.push(x));
        channel
    }

    /// A mesh whose corners have a wedge a vertex.
    fn with((positions, triangles): Shape, channels: Vec<Channel>) -> IndexedMesh {
        let attributes = Attributes {
            corners: triangles.clone(),
            channels,
            ..Attributes::default()
        };
        let mesh = IndexedMesh::new(positions, triangles).unwrap();
        mesh.with_attributes(attributes).unwrap()
    }

    fn compared(reference: IndexedMesh, mesh: IndexedMesh) -> AttributeComparison {
        let comparison: Comparison = compare(reference, mesh, &FEW).unwrap();
        comparison.attributes.unwrap()
    }

    fn numbers(channel: &ChannelComparison) -> Vec<f64> {
        let all = [channel.two_sided, channel.from_reference, channel.from_mesh];
        all.iter().flat_map(|d| [d.rms, d.mean, d.max]).collect()
    }

    /// The unit square with what is linear in x and y, plus something.
    fn linear(columns: u32, rows: u32, plus: f64) -> IndexedMesh {
        let shape = grid(columns, rows);
        let of = |kind, names: &[&str]| {
            let count = names.len();
            channel(kind, names, &shape.0, |p| {
                let sum = f64::from(p.x) * 0.25 + f64::from(p.y) * 0.5 + plus;
                vec![sum; count]
            })
        };
        let channels = vec![
            of(Kind::Color, &["red", "green", "blue"]),
            of(Kind::TextureCoordinate, &["s", "t"]),
            of(Kind::Scalar, &["quality"]),
        ];
        with(shape, channels)
    }

    /// Interpolation is exact for what is linear, however the square is cut.
    #[test]
    fn a_linear_attribute_is_the_same_on_every_mesh_of_a_plane() {
        let found = compared(linear(7, 5, 0.0), linear(3, 4, 0.0));
        let units: Vec<Unit> = found.channels.iter().map(|c| c.unit).collect();
        assert_eq!(
            units,
            [Unit::OfFullRange, Unit::TextureUnits, Unit::ScalarUnits]
        );
        for channel in &found.channels {
            assert!(numbers(channel).iter().all(|&x| x < 1e-6), "{channel:?}");
            assert_eq!(channel.samples, 2 * FEW.samples);
        }
    }

    /// All components an eighth more: an eighth for a colour and a scalar, √2 eighths in a texture.
    #[test]
    fn a_constant_shift_is_the_difference() {
        let found = compared(linear(4, 6, 0.0), linear(5, 3, 0.125));
        for (channel, expected) in found.channels.iter().zip([1.0, 2f64.sqrt(), 1.0]) {
            for x in numbers(channel) {
                assert!((x - expected / 8.0).abs() < 1e-6, "{channel:?}");
            }
        }
    }

    /// Four sides of a square tower, unrolled into a texture, cut open at one edge: the last side
    /// ends at u = 1 where the first begins at 0.
    fn tower(half_width: f32, rows: u32) -> IndexedMesh {
        let corner = |side: u32| {
            let (x, y) = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)][side as usize % 4];
            (half_width * x, half_width * y)
        };
        let mut positions = Vec::new();
        let mut texture = Channel::of_singles(Kind::TextureCoordinate, &["u", "v"]);
        let (mut triangles, mut corners) = (Vec::new(), Vec::new());
        for row in 0..=rows {
            let height = row as f32 / rows as f32;
            positions.extend((0..4).map(|side| {
                let (x, y) = corner(side);
                Vec3::new(x, y, height)
            }));
            for side in 0..=4 {
                texture.values.push(f64::from(side) / 4.0);
                texture.values.push(height.into());
            }
        }
        for (row, side) in (0..rows).flat_map(|row| (0..4).map(move |side| (row, side))) {
            let quad = |length: u32| {
                let next = (side + 1) % length;
                let (low, high) = (row * length, (row + 1) * length);
                [low + side, low + next, high + next, high + side]
            };
            let split = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
            triangles.extend(split(quad(4)));
            corners.extend(split(quad(5)));
        }
        let attributes = Attributes {
            corners,
            channels: vec![texture],
            ..Attributes::default()
        };
        let mesh = IndexedMesh::new(positions, triangles).unwrap();
        mesh.with_attributes(attributes).unwrap()
    }

    /// Every point of the wider tower beside a side of the narrower one is nearest to its edge, also to
    /// the one that is cut open, where both ends of the texture are equally near. There u is off by
    /// no more than anywhere: a sixth of a side, a side being a quarter.
    #[test]
    fn a_seam_is_no_error() {
        let found = compared(tower(1.5, 1), tower(1.0, 3));
        let texture = &found.channels[0];
        let max = texture.from_reference.max;
        assert!((1.0 / 24.1..1.0 / 23.9).contains(&max), "{texture:?}");
        assert!(texture.from_mesh.max < 1.0 / 23.9, "{texture:?}");
        let texture = texture.texture.as_ref().unwrap();
        assert_eq!((texture.reference_charts, texture.mesh_charts), (1, 1));
        // Twelve by one, in a square of one.
        assert!((texture.model_length_per_texture_unit - 12f64.sqrt()).abs() < 1e-6);
        let turned = [
            texture.reference_flipped_chart_triangles,
            texture.mesh_flipped_chart_triangles,
            texture.triangles_turned_against_reference,
        ];
        assert_eq!(turned, [0; 3]);
    }

    /// Bytes and floats say the same, each of its own range; alpha, that one side lacks, is left out.
    #[test]
    fn colors_are_shares_of_their_range() {
        let shape = grid(2, 2);
        let white = |number, x: f64, names: &[&str]| {
            let property = |name: &&str| Property {
                name: name.to_string(),
                number,
            };
            let mut channel = Channel::new(Kind::Color, names.iter().map(property).collect());
            (0..names.len() * shape.0.len()).for_each(|_| channel.values.push(x));
            with(shape.clone(), vec![channel])
        };
        let bytes = white(NumberType::U8, 255.0, &["red", "green", "blue", "alpha"]);
        let rgb = ["r", "g", "b"];
        for (float, expected) in [(1.0, 0.0), (0.0, 1.0), (0.75, 0.25)] {
            let found = compared(bytes.clone(), white(NumberType::F32, float, &rgb));
            let numbers = numbers(&found.channels[0]);
            assert!(
                numbers.iter().all(|x| (x - expected).abs() < 1e-12),
                "{numbers:?}"
            );
        }
    }

    /// The length of a normal counts nothing; where one is zero there is a right angle.
    #[test]
    fn normals_differ_by_their_angle() {
        let square = |normal: [f64; 3]| {
            let shape = grid(3, 3);
            let names = ["nx", "ny", "nz"];
            let normals = channel(Kind::Normal, &names, &shape.0, |_| normal.to_vec());
            with(shape, vec![normals])
        };
        let up = || square([0.0, 0.0, 1.0]);
        for (normal, degrees) in [
            ([0.0, 0.0, 0.5], 0.0),
            ([0.0, 2.0, 2.0], 45.0),
            ([3.0, 0.0, 0.0], 90.0),
            ([0.0, 0.0, -1.0], 180.0),
            ([0.0; 3], 90.0),
        ] {
            let found = compared(up(), square(normal));
            assert_eq!(found.channels[0].unit, Unit::Degrees);
            let numbers = numbers(&found.channels[0]);
            assert!(
                numbers.iter().all(|x| (x - degrees).abs() < 1e-9),
                "{numbers:?}"
            );
        }
    }

    /// Of a kind by order, scalars by name; what has no partner is named.
    #[test]
    fn channels_find_their_partners() {
        let of = |channels: &[(Kind, &str, f64)]| {
            let shape = grid(1, 1);
            let of = |&(kind, name, x): &(Kind, &str, f64)| {
                channel(kind, &[name], &shape.0, |_| vec![x])
            };
            let channels = channels.iter().map(of).collect();
            with(shape, channels)
        };
        use Kind::{Color, Scalar, TextureCoordinate};
        let reference = of(&[
            (TextureCoordinate, "u", 1.0),
            (TextureCoordinate, "u2", 2.0),
            (Scalar, "quality", 3.0),
            (Scalar, "curvature", 4.0),
            (Color, "red", 0.0),
        ]);
        let mesh = of(&[
            (Scalar, "curvature", 4.5),
            (Scalar, "radius", 9.0),
            (TextureCoordinate, "s", 1.25),
            (Scalar, "quality", 3.0),
            (TextureCoordinate, "s2", 2.0),
        ]);
        let found = compared(reference, mesh);
        let round = |x: f64| (x * 1e9).round() / 1e9;
        let named = found
            .channels
            .iter()
            .map(|c| (c.name.as_str(), round(c.two_sided.max)));
        let expected = [
            ("texture_coordinate", 0.25),
            ("texture_coordinate_1", 0.0),
            ("quality", 0.0),
            ("curvature", 0.5),
        ];
        assert_eq!(named.collect::<Vec<_>>(), expected);
        assert_eq!(found.only_in_reference, ["color"]);
        assert_eq!(found.only_in_mesh, ["radius"]);
    }

    /// Samples at which there is no number count nowhere; a mesh that carries nothing is not compared.
    #[test]
    fn what_is_no_number_is_left_out() {
        let shape = grid(4, 1);
        let sparse = channel(Kind::Scalar, &["quality"], &shape.0, |p| {
            vec![if p.x == 0.0 { f64::NAN } else { 1.0 }]
        });
        let full = channel(Kind::Scalar, &["quality"], &shape.0, |_| vec![3.0]);
        let found = compared(
            with(shape.clone(), vec![full]),
            with(shape.clone(), vec![sparse]),
        );
        let quality = &found.channels[0];
        assert!(
            numbers(quality).iter().all(|x| (x - 2.0).abs() < 1e-12),
            "{quality:?}"
        );
        let share = quality.samples as f64 / (2 * FEW.samples) as f64;
        assert!((share - 0.75).abs() < 0.01, "{share}");
        let bare = || IndexedMesh::new(shape.0.clone(), shape.1.clone()).unwrap();
        assert_eq!(compare(bare(), bare(), &FEW).unwrap().attributes, None);
    }

    /// A square in a texture: as it is, mirrored as a whole, folded in half, and with one triangle
    /// turned over by a vertex that was drawn too far.
    #[test]
    fn a_fold_that_is_meant_is_told_from_a_flip() {
        let square = |place: fn(Vec2) -> Vec2| {
            let shape = grid(4, 4);
            let names = ["u", "v"];
            let texture = channel(Kind::TextureCoordinate, &names, &shape.0, |p| {
                let uv = place(Vec2::new(p.x, p.y));
                vec![uv.x.into(), uv.y.into()]
            });
            with(shape, vec![texture])
        };
        let plain = || square(|p| p);
        let mirrored = || square(|p| Vec2::new(1.0 - p.x, p.y));
        let folded = || square(|p| Vec2::new((p.x - 0.5).abs(), p.y));
        // The corner at the origin beyond the diagonal of its square.
        let flipped = || {
            square(|p| {
                if p == Vec2::ZERO {
                    Vec2::new(0.375, 0.125)
                } else {
                    p
                }
            })
        };
        let count = |reference: IndexedMesh, mesh: IndexedMesh| {
            let found = compared(reference, mesh);
            let texture = found.channels[0].texture.clone().unwrap();
            [
                texture.reference_flipped_chart_triangles,
                texture.mesh_flipped_chart_triangles,
                texture.triangles_turned_against_reference,
            ]
        };
        assert_eq!(count(plain(), plain()), [0, 0, 0]);
        assert_eq!(count(mirrored(), mirrored()), [0, 0, 0]);
        assert_eq!(count(folded(), folded()), [16, 16, 0]);
        assert_eq!(count(plain(), mirrored()), [0, 0, 32]);
        assert_eq!(count(plain(), flipped()), [0, 1, 1]);
    }

    #[test]
    fn threads_give_the_same_bytes() {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let compare = || compared(tower(1.5, 1), tower(1.0, 3));
            pool.build().unwrap().install(compare)
        };
        assert_eq!(on(1), on(3));
    }
}
