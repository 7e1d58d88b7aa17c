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

#[cfg(test)]
mod tests {
    use decimate::metrics::{Info, info};

    use super::*;

    /// About as many triangles as asked for, none without area, all joined up the same way round;
    /// each kind with the parts and the boundary that it has by its making.
    #[test]
    fn each_kind_is_what_it_says() {
        for (kind, components, boundary_loops, genus) in [
            (Kind::Terrain, 1, 1, Some(0)),
            (Kind::Gyroid, 1, 0, None),
            (Kind::Plinth, 2, 0, Some(0)),
            (Kind::Density, 1, 0, Some(0)),
        ] {
            let asked = 50_000;
            let mesh = kind.generate(asked, 7).unwrap();
            assert_eq!(mesh, kind.generate(asked, 7).unwrap(), "{kind:?}");
            assert_ne!(mesh, kind.generate(asked, 8).unwrap(), "{kind:?}");
            let found = info(mesh, true).unwrap();
            assert!(found.triangles.abs_diff(asked) < asked / 5, "{found:?}");
            assert_eq!(faults(&found), 0, "{kind:?}: {found:?}");
            assert_eq!(found.components, components, "{kind:?}");
            assert_eq!(found.boundary_loops, boundary_loops, "{kind:?}");
            match genus {
                Some(genus) => assert_eq!(found.genus, Some(genus), "{kind:?}"),
                None => assert!(found.genus > Some(100), "{kind:?}: {:?}", found.genus),
            }
        }
    }

    fn faults(found: &Info) -> usize {
        found.cleaning.welded_vertices
            + found.cleaning.dropped_isolated_vertices
            + found.non_manifold_edges
            + found.non_manifold_vertices
            + found.inconsistent_edges
            + found.zero_area_faces
    }

    /// Seen from outside, the triangles of a closed surface turn counter-clockwise: the volume is
    /// positive.
    #[test]
    fn closed_kinds_have_their_inside_within() {
        for kind in [Kind::Gyroid, Kind::Plinth, Kind::Density] {
            let mesh = kind.generate(20_000, 1).unwrap();
            let volume: f32 = mesh
                .triangles()
                .iter()
                .map(|t| t.map(|v| mesh.positions()[v as usize]))
                .map(|[a, b, c]| a.cross(b).dot(c) / 6.0)
                .sum();
            assert!(volume > 0.1, "{kind:?}: {volume}");
        }
    }
}
