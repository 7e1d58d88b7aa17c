//! Small meshes by name, for tests.

use glam::Vec3;

/// Positions and triangles.
pub type Shape = (Vec<Vec3>, Vec<[u32; 3]>);

/// The smallest closed mesh: 4 vertices, 4 faces.
pub fn tetrahedron() -> Shape {
    let positions = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
    (
        positions.map(Vec3::from).into(),
        vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    )
}

/// A flat `columns` × `rows` grid of squares in the unit square, two triangles each.
pub fn grid(columns: u32, rows: u32) -> Shape {
    let mut positions = Vec::new();
    for y in 0..=rows {
        for x in 0..=columns {
            positions.push(Vec3::new(
                x as f32 / columns as f32,
                y as f32 / rows as f32,
                0.0,
            ));
        }
    }
    let mut triangles = Vec::new();
    for y in 0..rows {
        for x in 0..columns {
            let a = y * (columns + 1) + x;
            let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (positions, triangles)
}

/// A unit sphere: an icosahedron, each face split in four `levels` times (20·4^levels faces).
pub fn icosphere(levels: u32) -> Shape {
    let t = (1.0 + 5f32.sqrt()) / 2.0;
    #[rustfmt::skip]
    let corners = [
        [-1., t, 0.], [1., t, 0.], [-1., -t, 0.], [1., -t, 0.], [0., -1., t], [0., 1., t],
        [0., -1., -t], [0., 1., -t], [t, 0., -1.], [t, 0., 1.], [-t, 0., -1.], [-t, 0., 1.],
    ];
    #[rustfmt::skip]
    let faces = [
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
        [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9],
        [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
    ];
    let mut shape = (corners.map(Vec3::from).into(), faces.to_vec());
    for _ in 0..levels {
        shape = subdivided(shape);
    }
    for p in &mut shape.0 {
        *p = p.normalize();
    }
    shape
}

/// Every triangle split in four at the middles of its edges.
pub fn subdivided((mut positions, triangles): Shape) -> Shape {
    let mut middles = std::collections::BTreeMap::new();
    let mut split = Vec::with_capacity(4 * triangles.len());
    for [a, b, c] in triangles {
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]) / 2.0);
                positions.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    (positions, split)
}

/// Two tetrahedra that share one vertex: 7 vertices, vertex 0 with two fans.
pub fn bow_tie() -> Shape {
    let (mut positions, mut triangles) = tetrahedron();
    let center = positions[0];
    for i in 1..4 {
        positions.push(2.0 * center - positions[i]);
    }
    let mirrored = |v: u32| if v == 0 { 0 } else { v + 3 };
    let second: Vec<_> = triangles
        .iter()
        .map(|&[a, b, c]| [mirrored(a), mirrored(c), mirrored(b)])
        .collect();
    triangles.extend(second);
    (positions, triangles)
}

/// Three `n` × `n` grids that share one side: n non-manifold edges of three faces each.
pub fn three_fins(n: u32) -> Shape {
    let (flat, faces) = grid(n, n);
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for fin in 0..3 {
        // 0°, 120°, 240° around the y axis, exactly enough.
        let (cos, sin) = [(1.0, 0.0), (-0.5, 0.866_025_4), (-0.5, -0.866_025_4)][fin];
        let ids: Vec<u32> = (0..flat.len())
            .map(|i| {
                let p = flat[i];
                if fin > 0 && p.x == 0.0 {
                    return i as u32;
                }
                positions.push(Vec3::new(p.x * cos, p.y, p.x * sin));
                positions.len() as u32 - 1
            })
            .collect();
        triangles.extend(faces.iter().map(|t| t.map(|v| ids[v as usize])));
    }
    (positions, triangles)
}

/// A strip of `n` squares with half a twist: it has no orientation.
pub fn moebius(n: u32) -> Shape {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..n {
        let angle = i as f32 / n as f32 * std::f32::consts::TAU;
        for side in [-0.3, 0.3] {
            let radius = 1.0 + side * (angle / 2.0).cos();
            let height = side * (angle / 2.0).sin();
            positions.push(Vec3::new(
                radius * angle.cos(),
                radius * angle.sin(),
                height,
            ));
        }
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, b + 2) } else { (1, 0) };
        triangles.extend([[a, c, b], [b, c, d]]);
    }
    (positions, triangles)
}

/// A torus of `n` × `m` squares: closed, genus 1.
pub fn torus(n: u32, m: u32) -> Shape {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let u = i as f32 / n as f32 * std::f32::consts::TAU;
            let v = j as f32 / m as f32 * std::f32::consts::TAU;
            let r = 1.0 + 0.4 * v.cos();
            positions.push(Vec3::new(r * u.cos(), r * u.sin(), 0.4 * v.sin()));
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (positions, triangles)
}
