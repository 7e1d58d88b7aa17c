//! Triangle lists and options out of a fuzzer's bytes.

use arbitrary::{Result, Unstructured};
use decimate::attributes::{Attributes, Channel, Group, Kind};
use decimate::decimate::{
    AttributeUse, AttributeWeights, Boundary, Chunks, Options, Placement, Quality, Targets,
    TierChoice, Topology,
};
use decimate::indexed_mesh::IndexedMesh;
use glam::{DVec3, Vec3};

/// The checks take linear time after each collapse, three times over.
const MOST_VERTICES: usize = 40;
const MOST_TRIANGLES: usize = 70;

/// Numbers at the edges of what a coordinate can be.
const EXTREMES: [f32; 16] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    f32::EPSILON,
    1e30,
    -1e30,
    1e-30,
    -1e-30,
    1e-45,
    -0.0,
    16_777_216.0,
    0.1,
    1e20,
];

/// A mesh of up to 40 vertices and 70 triangles: each coordinate of two bytes, most often on a
/// coarse grid, so that positions coincide and faces lie in one plane. `None` where the list was
/// one that is refused, and was.
///
/// # Errors
/// Where the bytes end too early.
///
/// # Panics
/// Where a list is refused that should not be, or the other way round.
pub fn mesh(bytes: &mut Unstructured) -> Result<Option<IndexedMesh>> {
    let shape: u8 = bytes.arbitrary()?;
    let vertices = bytes.int_in_range(0..=MOST_VERTICES)?;
    let scale = *bytes.choose(&[1.0, 1.0, 1.0, 1e-30, 1e30, 1e-42, 1e37, 0.1])?;
    let origin = *bytes.choose(&[0.0, 0.0, 0.0, 500_000.25, -1e15, 1e300])?;
    let mut positions = Vec::new();
    for _ in 0..vertices {
        let mut position = [0.0; 3];
        for x in &mut position {
            *x = scale * coordinate(bytes)?;
        }
        positions.push(Vec3::from(position));
    }
    let mut triangles = if shape & 1 == 1 {
        grid(vertices)
    } else {
        Vec::new()
    };
    let may_miss = shape & 0b1110 == 0b1110;
    while triangles.len() < MOST_TRIANGLES && !bytes.is_empty() {
        let mut triangle = [0; 3];
        for v in &mut triangle {
            let number = u32::from(bytes.arbitrary::<u8>()?);
            *v = if may_miss || vertices == 0 {
                number
            } else {
                number % vertices as u32
            };
        }
        triangles.push(triangle);
    }
    let is_valid = triangles.iter().flatten().all(|&v| (v as usize) < vertices);
    let mesh = IndexedMesh::with_origin(DVec3::splat(origin), positions, triangles);
    assert_eq!(mesh.is_ok(), is_valid, "{mesh:?}");
    let Ok(mesh) = mesh else { return Ok(None) };
    let mesh = match shape >> 6 {
        0 => mesh,
        kind => attributed(mesh, kind),
    };
    if shape & 0b11_0000 != 0b11_0000 || vertices == 0 {
        return Ok(Some(mesh));
    }
    let weight = |v: usize| [1.0, 0.0, 7.5, f32::INFINITY, 1e38, 1e-38][(v ^ shape as usize) % 6];
    let weights = (0..vertices).map(weight).collect();
    let mesh = mesh.with_weights(weights).expect("none is negative");
    Ok(Some(mesh))
}

/// The mesh with a normal and a place in a texture at each corner, the same all around a vertex (1), or
/// not at every third face (2), or nowhere (3), and with two groups but for the first kind.
fn attributed(mesh: IndexedMesh, kind: u8) -> IndexedMesh {
    let triangles = mesh.triangles();
    let mut attributes = Attributes {
        channels: vec![
            Channel::of_singles(Kind::Normal, &["nx", "ny", "nz"]),
            Channel::of_singles(Kind::TextureCoordinate, &["s", "t"]),
        ],
        ..Attributes::default()
    };
    for (i, triangle) in triangles.iter().enumerate() {
        let first = 3 * i as u32;
        attributes.corners.push([first, first + 1, first + 2]);
        for (k, &v) in triangle.iter().enumerate() {
            let of = match kind {
                1 => v as usize,
                2 => v as usize + 50 * usize::from(i % 3 == 0),
                _ => 3 * i + k,
            };
            let number = |j: usize| match (of * 7 + j * 13) % 31 {
                extreme @ 0..2 => f64::from(EXTREMES[extreme]),
                other => f64::from(other as u8) / 16.0 - 1.0,
            };
            let mut numbers = (0..5).map(number);
            for channel in &mut attributes.channels {
                let row = numbers.by_ref().take(channel.width());
                row.for_each(|x| channel.values.push(x));
            }
        }
    }
    attributes.merge_equal_wedges(triangles);
    if kind > 1 {
        attributes.groups = vec![Group::default(); 2];
        attributes.group_of = (0..triangles.len() as u32).map(|i| i / 4 % 2).collect();
    }
    mesh.with_attributes(attributes)
        .expect("they fit the triangles")
}

fn coordinate(bytes: &mut Unstructured) -> Result<f32> {
    Ok(match bytes.arbitrary::<u8>()? {
        extreme @ 0..16 => EXTREMES[usize::from(extreme)],
        16..24 => f32::from_bits(bytes.arbitrary()?),
        24..32 => f32::from(bytes.arbitrary::<i16>()?) / 256.0,
        grid => f32::from(grid % 8),
    })
}

/// The triangles of a grid of squares as wide as it is high, over some of so many vertices.
fn grid(vertices: usize) -> Vec<[u32; 3]> {
    let side = vertices.isqrt() as u32;
    let square = |i: u32, j: u32| {
        let v = i * side + j;
        [[v, v + 1, v + side], [v + 1, v + side + 1, v + side]]
    };
    let rows = 0..side.saturating_sub(1);
    rows.clone()
        .flat_map(|i| rows.clone().flat_map(move |j| square(i, j)))
        .collect()
}

/// Options of every kind, most of them valid; every invariant is verified after every collapse.
///
/// # Errors
/// Where the bytes end too early.
pub fn options(bytes: &mut Unstructured) -> Result<Options> {
    let targets = Targets {
        ratio: *bytes.choose(&[
            Some(0.0),
            Some(0.0),
            Some(0.5),
            Some(0.1),
            Some(1.0),
            Some(f64::NAN),
            Some(-1.0),
            None,
        ])?,
        triangles: *bytes.choose(&[None, None, None, Some(0), Some(4), Some(usize::MAX)])?,
        max_error: *bytes.choose(&[
            None,
            None,
            None,
            Some(0.0),
            Some(0.5),
            Some(1e-40),
            Some(1e300),
            Some(f64::NAN),
        ])?,
    };
    Ok(Options {
        targets,
        quality: *bytes.choose(&[Quality::Fast, Quality::Standard, Quality::Best])?,
        boundary: *bytes.choose(&[Boundary::Keep, Boundary::Lock, Boundary::Free])?,
        topology: *bytes.choose(&[Topology::Preserve, Topology::Preserve, Topology::Simplify])?,
        placement: *bytes.choose(&[Placement::Optimal, Placement::Endpoint])?,
        attributes: *bytes.choose(&[
            AttributeUse::Optimize,
            AttributeUse::Optimize,
            AttributeUse::Carry,
            AttributeUse::Ignore,
        ])?,
        attribute_weights: AttributeWeights::default(),
        feature_angle_degrees: *bytes.choose(&[
            None,
            None,
            Some(0.0),
            Some(30.0),
            Some(90.0),
            Some(180.0),
            Some(-1.0),
        ])?,
        chunks: *bytes.choose(&[
            Chunks::Auto,
            Chunks::Off,
            Chunks::Triangles(0),
            Chunks::Triangles(1),
            Chunks::Triangles(8),
            Chunks::Triangles(30),
            Chunks::Triangles(usize::MAX),
        ])?,
        tier: TierChoice::Auto,
        memory_limit_bytes: *bytes.choose(&[None, None, Some(u64::MAX), Some(4000)])?,
        weld: *bytes.choose(&[true, true, false])?,
        check: true,
    })
}
