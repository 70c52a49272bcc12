//! The plane of a measuring grid.

use glam::DVec3;

use crate::error::{Error, ErrorKind};

/// A parallelogram in space. It receives light on the side that the cross product of its edges
/// points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPlane {
    /// A corner, scene unit.
    pub origin: DVec3,
    /// The two edges from there, scene unit.
    pub edges: [DVec3; 2],
}

impl GridPlane {
    /// Unit normal.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a plane without area, or one that is not finite.
    pub fn normal(&self) -> Result<DVec3, Error> {
        let [u, v] = self.edges;
        let normal = u.normalize_or_zero().cross(v.normalize_or_zero());
        let normal = normal.try_normalize().filter(|_| self.origin.is_finite());
        normal.ok_or_else(|| {
            let found = format!("from {} along {u} and {v}", self.origin);
            let remedy = "give a finite corner and two edges that are not parallel";
            Error::new(ErrorKind::Setting, "measuring plane", found, remedy)
        })
    }

    /// The point at these fractions of both edges.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> DVec3 {
        self.origin + self.edges[0] * x + self.edges[1] * y
    }

    /// The plane without a strip of this width along its edges, scene unit; none where nothing is
    /// left.
    pub(super) fn without(&self, strip: f64) -> Option<GridPlane> {
        let [u, v] = self.edges;
        // Of a parallelogram, along each edge: the strip is measured across the other one.
        let sine = u.normalize_or_zero().cross(v.normalize_or_zero()).length();
        let shares = [u, v].map(|edge| strip / (sine * edge.length()));
        shares.iter().all(|share| *share < 0.5).then(|| GridPlane {
            origin: self.at(shares),
            edges: [u * (1.0 - 2.0 * shares[0]), v * (1.0 - 2.0 * shares[1])],
        })
    }
}
