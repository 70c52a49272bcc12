//! The faces at each vertex.

/// The faces at each vertex, vertex by vertex.
pub(crate) struct Incidence {
    /// Those of vertex v are from `first[v]` to `first[v + 1]`.
    first: Vec<u32>,
    faces: Vec<u32>,
}

impl Incidence {
    /// For `vertex_count` vertices and faces, each given by its number and its vertices; `faces`
    /// must give the same at every call. The faces at a vertex stay in that order.
    pub fn new<'a, I>(vertex_count: usize, faces: impl Fn() -> I) -> Incidence
    where
        I: Iterator<Item = (usize, &'a [u32])>,
    {
        let mut first = vec![0u32; vertex_count + 1];
        for &v in faces().flat_map(|(_, vertices)| vertices) {
            first[v as usize + 1] += 1;
        }
        for v in 0..vertex_count {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut at_vertices = vec![0; first[vertex_count] as usize];
        for (face, vertices) in faces() {
            for &v in vertices {
                at_vertices[next[v as usize] as usize] = face as u32;
                next[v as usize] += 1;
            }
        }
        Incidence { first, faces: at_vertices }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.first.len() - 1
    }

    /// The faces at vertex `v`.
    pub fn at(&self, v: u32) -> &[u32] {
        let v = v as usize;
        &self.faces[self.first[v] as usize..self.first[v + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_at_their_vertices_in_order() {
        let faces: [&[u32]; 3] = [&[0, 1, 3], &[3, 1, 4, 0], &[4, 3, 1]];
        let incidence = Incidence::new(5, || faces.iter().copied().enumerate());
        let at: [&[u32]; 5] = [&[0, 1], &[0, 1, 2], &[], &[0, 1, 2], &[1, 2]];
        assert_eq!([0, 1, 2, 3, 4].map(|v| incidence.at(v)), at);
    }
}
