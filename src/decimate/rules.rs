//! What a collapse must not do to the faces around it, and how far it may move away from them.

use glam::Vec3;

use super::geometry::Geometry;
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite, VertexId};

/// A face this thin (twice its area against its longest squared edge) has no direction that single
/// precision could vouch for.
const THIN: f32 = 1e-6;

/// Faces that are looked at together, one a lane; the compiler makes vectors of as many as there are.
const LANES: usize = 8;

/// Faces of a fan that are gathered at a time.
const GATHERED: usize = 2 * LANES;

/// The largest distance of `position` from the planes of the faces and the lines of the boundary
/// edges at both ends of `e`, in the unit box; nothing where a face that stays would turn by 90° or
/// more, or lose its area, if the ends moved there.
///
/// Costs one walk around each end that moves.
#[inline]
pub fn distance_from_star<S: EdgeStore>(
    mesh: &Mesh<S>,
    geometry: &Geometry,
    e: EdgeId,
    position: Vec3,
) -> Option<f32> {
    let [v, w] = mesh.edge_vertices(e);
    let mut faces = Faces::new(geometry);
    for (end, other) in [(v, w), (w, v)] {
        let point = geometry.position(end);
        if point == position {
            continue;
        }
        let offset = geometry.scaled(position - point);
        for start in mesh.fans(end) {
            let from_line = |e: EdgeId, neighbour: VertexId| {
                if mesh.opposite(e) == Opposite::Boundary {
                    let along = geometry.scaled(geometry.position(neighbour) - point);
                    distance_squared_from_line(along, offset)
                } else {
                    0.0
                }
            };
            let first = mesh.head(start);
            let at_first = from_line(start, first);
            faces.begin(point, offset, geometry.position(first), first == other);
            let mut last = (start, first);
            for d in mesh.fan(start) {
                let before = mesh.prev(d);
                let apex = mesh.tail(before);
                faces.add(geometry.position(apex), apex == other)?;
                last = (before, apex);
            }
            faces.look()?;
            faces.squared = faces.squared.max(at_first).max(from_line(last.0, last.1));
        }
    }
    Some(faces.squared.sqrt())
}

fn distance_squared_from_line(along: Vec3, offset: Vec3) -> f32 {
    let length_squared = along.length_squared();
    if length_squared > 0.0 {
        along.cross(offset).length_squared() / length_squared
    } else {
        0.0
    }
}

/// The faces of a fan around a vertex that moves, gathered by coordinate: face i lies between the
/// vertices i and i + 1 of the rim.
struct Faces {
    point: Vec3,
    offset: Vec3,
    scale: f32,
    /// From the vertex to those on the rim, in the unit box.
    rim: [[f32; GATHERED + 1]; 3],
    /// All bits where the vertex on the rim is the edge's other end, so that the faces there go.
    is_other: [u32; GATHERED + 1],
    count: usize,
    /// The largest squared distance from their planes so far.
    squared: f32,
}

impl Faces {
    #[inline]
    fn new(geometry: &Geometry) -> Self {
        Self {
            point: Vec3::ZERO,
            offset: Vec3::ZERO,
            scale: geometry.scale() as f32,
            rim: [[0.0; GATHERED + 1]; 3],
            is_other: [0; GATHERED + 1],
            count: 0,
            squared: 0.0,
        }
    }

    #[inline]
    fn put(&mut self, i: usize, position: Vec3, is_other: bool) {
        let to = (position - self.point) * self.scale;
        self.rim[0][i] = to.x;
        self.rim[1][i] = to.y;
        self.rim[2][i] = to.z;
        self.is_other[i] = if is_other { u32::MAX } else { 0 };
    }

    /// A fan around a vertex at `point` that moves by `offset`, and the first vertex on its rim.
    #[inline]
    fn begin(&mut self, point: Vec3, offset: Vec3, position: Vec3, is_other: bool) {
        (self.point, self.offset, self.count) = (point, offset, 0);
        self.put(0, position, is_other);
    }

    /// The next vertex on the rim, and so a face. Nothing where one before it turns.
    #[inline]
    fn add(&mut self, position: Vec3, is_other: bool) -> Option<()> {
        if self.count == GATHERED {
            self.look()?;
            for coordinate in &mut self.rim {
                coordinate[0] = coordinate[GATHERED];
            }
            self.is_other[0] = self.is_other[GATHERED];
            self.count = 0;
        }
        self.count += 1;
        self.put(self.count, position, is_other);
        Some(())
    }

    /// Looks at the faces gathered. Nothing where one turns.
    #[inline]
    fn look(&mut self) -> Option<()> {
        // The lanes behind the last face hold faces without area.
        let padded = self.count.next_multiple_of(LANES);
        for i in self.count + 1..=padded {
            for coordinate in &mut self.rim {
                coordinate[i] = coordinate[self.count];
            }
            self.is_other[i] = u32::MAX;
        }
        for first in (0..padded).step_by(LANES) {
            let lanes = |coordinate: &[f32; GATHERED + 1], from: usize| -> [f32; LANES] {
                coordinate[from..from + LANES].try_into().expect("as many")
            };
            let a = [0, 1, 2].map(|k| lanes(&self.rim[k], first));
            let b = [0, 1, 2].map(|k| lanes(&self.rim[k], first + 1));
            let other = |from: usize| -> [u32; LANES] {
                self.is_other[from..from + LANES].try_into().expect("as many")
            };
            let (turned, squared) = turn(&a, &b, self.offset, &other(first), &other(first + 1));
            if turned {
                return None;
            }
            self.squared = self.squared.max(squared);
        }
        Some(())
    }
}

/// Whether one of the faces between the vertex and a and b turns when the vertex moves by `offset`,
/// and the largest squared distance of the place from their planes.
#[inline]
fn turn(
    a: &[[f32; LANES]; 3],
    b: &[[f32; LANES]; 3],
    offset: Vec3,
    a_is_other: &[u32; LANES],
    b_is_other: &[u32; LANES],
) -> (bool, f32) {
    let mut turned = [0u32; LANES];
    let mut squared = [0.0f32; LANES];
    for i in 0..LANES {
        let (ax, ay, az) = (a[0][i], a[1][i], a[2][i]);
        let (bx, by, bz) = (b[0][i], b[1][i], b[2][i]);
        let (rx, ry, rz) = (bx - ax, by - ay, bz - az);
        let cross = |x: f32, y: f32, z: f32| {
            (y * rz - z * ry, z * rx - x * rz, x * ry - y * rx)
        };
        let length_squared = |x: f32, y: f32, z: f32| x * x + y * y + z * z;
        let (nx, ny, nz) = cross(ax, ay, az);
        let area_squared = length_squared(nx, ny, nz);
        let along = nx * offset.x + ny * offset.y + nz * offset.z;
        let from_plane = along * along / area_squared;
        squared[i] = if area_squared > 0.0 { from_plane } else { 0.0 };
        let (ax2, ay2, az2) = (ax - offset.x, ay - offset.y, az - offset.z);
        let (bx2, by2, bz2) = (bx - offset.x, by - offset.y, bz - offset.z);
        let (mx, my, mz) = cross(ax2, ay2, az2);
        let area_squared_after = length_squared(mx, my, mz);
        let rim = length_squared(rx, ry, rz);
        let longest = length_squared(ax, ay, az).max(length_squared(bx, by, bz)).max(rim);
        let longest_after =
            length_squared(ax2, ay2, az2).max(length_squared(bx2, by2, bz2)).max(rim);
        let is_thin = area_squared <= (THIN * longest) * (THIN * longest);
        let is_thin_after = area_squared_after <= (THIN * longest_after) * (THIN * longest_after);
        let turns = nx * mx + ny * my + nz * mz <= 0.0;
        let bad = (turns | is_thin_after) & !is_thin;
        turned[i] = u32::from(bad) & !(a_is_other[i] | b_is_other[i]);
    }
    let any = turned.iter().fold(0, |any, t| any | t) != 0;
    let largest = squared.iter().fold(0.0f32, |largest, &s| if s > largest { s } else { largest });
    (any, largest)
}
