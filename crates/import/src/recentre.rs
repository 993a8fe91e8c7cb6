//! Moves meshes that lie far from their own origin.

use glam::{DVec3, Vec3};

/// How many times its size a mesh must be away from its origin to be moved. At 64 times, an f32
/// has 6 of its 24 bits for the distance and 18 for the mesh, steps of 1/250,000 of its size.
const FAR: f64 = 64.0;

/// Moves positions to their centre along every axis along which they lie far from the origin, and
/// returns where the centre was: `old = new + centre`, exactly.
///
/// All coordinates along such an axis have one sign and differ by at most a 64th. The difference of
/// two floats within a factor of two is exact: it is a multiple of the smaller one's last bit and
/// not larger than the smaller one.
pub(crate) fn recentre(positions: &mut [Vec3]) -> DVec3 {
    let Some([min, max]) = positions
        .iter()
        .map(|&p| [p, p])
        .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    else {
        return DVec3::ZERO;
    };
    let size = (max.as_dvec3() - min.as_dvec3()).max_element();
    let mut centre = Vec3::ZERO;
    for axis in 0..3 {
        let (low, high) = (f64::from(min[axis]), f64::from(max[axis]));
        if low.max(-high) > FAR * size {
            centre[axis] = (0.5 * (low + high)) as f32;
        }
    }
    if centre != Vec3::ZERO {
        positions.iter_mut().for_each(|p| *p -= centre);
    }
    centre.as_dvec3()
}

/// Where to move positions in f64: their centre along every axis along which they lie far from the
/// origin, 0 along the others.
pub(crate) fn centre_of(positions: impl Iterator<Item = DVec3>) -> DVec3 {
    let bounds = positions.map(|p| [p, p]);
    let Some([min, max]) = bounds.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]) else {
        return DVec3::ZERO;
    };
    let size = (max - min).max_element();
    let far = min.max(-max).cmpgt(DVec3::splat(FAR * size));
    DVec3::select(far, 0.5 * (min + max), DVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// No bit is lost, and no axis is left whose coordinates are far larger than the mesh.
        #[test]
        fn moving_is_exact(
            origin in prop::array::uniform3(-1e7f32..1e7),
            offsets in prop::collection::vec(prop::array::uniform3(-1f32..1.0), 2..20),
            scale in 1e-3f32..1e6,
        ) {
            let old: Vec<Vec3> = offsets.iter().map(|&o| Vec3::from(origin) + Vec3::from(o) * scale).collect();
            let mut new = old.clone();
            let centre = recentre(&mut new);
            for (old, new) in old.iter().zip(&new) {
                // The sum of two floats of similar exponents is exact in f64.
                prop_assert_eq!(old.as_dvec3(), new.as_dvec3() + centre);
            }
            let size = |p: &[Vec3]| p.iter().flat_map(|a| p.iter().map(move |b| (*a - *b).abs().max_element())).fold(0.0, f32::max);
            let size = size(&old);
            for p in new {
                // A coordinate left alone is nearer than 64 sizes to 0 somewhere in the mesh.
                prop_assert!(p.abs().max_element() <= 65.001 * size, "{} of {}", p, size);
            }
        }
    }

    #[test]
    fn what_is_near_stays() {
        let mut positions = [Vec3::new(3.0, 0.0, -60.0), Vec3::new(4.0, 1.0, -59.0)];
        assert_eq!(recentre(&mut positions), DVec3::ZERO);
        assert_eq!(positions[0], Vec3::new(3.0, 0.0, -60.0));
    }
}
