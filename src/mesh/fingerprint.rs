//! A hash of all that the light on a mesh depends on.

use xxhash_rust::xxh3::Xxh3;

use super::Mesh;
use crate::scene::fingerprint::add;

impl Mesh {
    /// A hash of the [scene](crate::Scene::fingerprint), the elements and the clusters.
    pub(crate) fn fingerprint(&self) -> u64 {
        let mut all = Xxh3::new();
        add(&mut all, &self.scene().fingerprint());
        for e in 0..self.element_count() {
            let node = self.node(self.element(e));
            add(&mut all, &(node.triangle, node.cell));
        }
        self.clusters().tree().for_each(|parts| add(&mut all, &parts));
        all.digest()
    }
}
