//! The icosahedron with its faces divided into smaller ones and blown up to the unit sphere.

use glam::DVec3;

use super::Surface;

/// The sphere of about `triangles` triangles: 20 for each square number.
pub fn geodesic(triangles: usize) -> Surface {
    let k = (triangles as f64 / 20.0).sqrt().round().max(1.0) as u32;
    let ids = Ids::new(k);
    let corners = corners();
    let mut positions = vec![DVec3::ZERO; ids.count()];
    let mut triangles = Vec::with_capacity(20 * (k * k) as usize);
    for (f, &[a, b, c]) in FACES.iter().enumerate() {
        let id = |i, j| ids.id(f as u32, i, j);
        for i in 0..=k {
            for j in 0..=k - i {
                let weighed = corners[a] * f64::from(k - i - j)
                    + corners[b] * f64::from(i)
                    + corners[c] * f64::from(j);
                positions[id(i, j) as usize] = weighed.normalize();
                if i + j < k {
                    triangles.push([id(i, j), id(i + 1, j), id(i, j + 1)]);
                }
                if i + j + 1 < k {
                    triangles.push([id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)]);
                }
            }
        }
    }
    Surface {
        positions,
        triangles,
    }
}

/// The icosahedron's faces, counter-clockwise seen from outside.
#[rustfmt::skip]
const FACES: [[usize; 3]; 20] = [
    [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11],
    [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
    [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9],
    [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
];

/// The icosahedron's vertices.
fn corners() -> [DVec3; 12] {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(|p| DVec3::from(p).normalize())
}

/// The vertices' numbers: the corners, then those inside each edge, then those inside each face.
struct Ids {
    /// Into how many parts an edge is divided.
    k: u32,
    /// The first number inside the edge between two corners.
    edges: [[u32; 12]; 12],
    /// The first number inside a face.
    faces: u32,
}

impl Ids {
    fn new(k: u32) -> Self {
        let mut edges = [[0; 12]; 12];
        let mut next = 12;
        for face in FACES {
            for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (face[i], face[j])) {
                // Each edge lies in two faces, once in each direction.
                if a < b {
                    (edges[a][b], edges[b][a]) = (next, next);
                    next += k - 1;
                }
            }
        }
        Self {
            k,
            edges,
            faces: next,
        }
    }

    fn count(&self) -> usize {
        (self.faces + 20 * self.in_face()) as usize
    }

    fn in_face(&self) -> u32 {
        (self.k - 1) * self.k.saturating_sub(2) / 2
    }

    /// The vertex of face `f` that is `i` steps from its first corner to the second, and `j` to the
    /// third.
    fn id(&self, f: u32, i: u32, j: u32) -> u32 {
        let [a, b, c] = FACES[f as usize];
        let k = self.k;
        match (k - i - j, i, j) {
            (_, 0, 0) => a as u32,
            (0, _, 0) => b as u32,
            (0, 0, _) => c as u32,
            (_, _, 0) => self.on_edge(a, b, i),
            (_, 0, _) => self.on_edge(a, c, j),
            (0, _, _) => self.on_edge(b, c, j),
            // Row i has k - 1 - i vertices inside; those before it are as many in a face less.
            _ => self.faces + f * self.in_face() + (i - 1) * (k - 1) - i * (i - 1) / 2 + j - 1,
        }
    }

    fn on_edge(&self, a: usize, b: usize, step: u32) -> u32 {
        let step = if a < b { step } else { self.k - step };
        self.edges[a][b] + step - 1
    }
}
