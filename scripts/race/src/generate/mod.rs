//! Meshes to race on, of any size, the same for the same seed.

mod density;
mod geodesic;
mod gyroid;
mod noise;
mod plinth;
mod terrain;

use clap::ValueEnum;
use decimate::error::Result;
use decimate::indexed_mesh::IndexedMesh;
use glam::DVec3;

/// What to make.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Kind {
    /// A height field with noise of many sizes: one boundary loop
    Terrain,
    /// A gyroid's inside, cut by a box: closed, many handles, flat walls, slivers
    Gyroid,
    /// A bumpy statue with 98 % of the triangles on a box a hundredth as dense
    Plinth,
    /// A smooth closed surface, a hundred times as dense at one end as at the other
    Density,
}

impl Kind {
    /// A mesh of about `triangles` triangles.
    ///
    /// # Errors
    /// As [`IndexedMesh::new`].
    pub fn generate(self, triangles: usize, seed: u64) -> Result<IndexedMesh> {
        let surface = match self {
            Self::Terrain => terrain::terrain(triangles, seed),
            Self::Gyroid => gyroid::gyroid(triangles, seed),
            Self::Plinth => plinth::plinth(triangles, seed),
            Self::Density => density::density(triangles, seed),
        };
        let positions = surface.positions.iter().map(|p| p.as_vec3()).collect();
        IndexedMesh::new(positions, surface.triangles)
    }
}

/// Positions and triangles, in the making.
#[derive(Default)]
struct Surface {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    fn area(&self) -> f64 {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            (b - a).cross(c - a).length() / 2.0
        };
        self.triangles.iter().map(area).sum()
    }
}
