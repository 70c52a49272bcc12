//! Which way is up in a scene whose file does not say: +y or +z.
//!
//! Each piece of evidence is a log-likelihood ratio, in favour of +z where it is positive, and the
//! axis is the sign of their sum with that of the prior (naive Bayes):
//!
//! | evidence | from | maximum |
//! |---|---|---|
//! | the file's comments say so, as "z up" | [`words`] | 6 |
//! | the program that wrote the file, by its comments | [`words`] | 1.5 |
//! | groups and materials named floor, ceiling, ground are level | [`words`] | 4 |
//! | those named wall are upright | [`words`] | 4 |
//! | luminaires are at one height, below the top, and aimed down | [`luminaires`] | 3 |
//! | area is level or upright, wider below, and faces up; lamps face down | [`geometry`] | 3 |
//! | prior: OBJ files are +y up by default in most programs | – | 0.2 |
//!
//! `docs/data/up_axis.tsv` has the evidence of each kind on scenes whose axis is known.

mod geometry;
mod luminaires;
mod words;

use std::fmt;

use glam::DVec3;

use super::Scene;

/// Which way is up, and why.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct UpAxis {
    /// Unit length.
    pub axis: DVec3,
    /// Reasons, the strongest first; none where it was given.
    pub reasons: Vec<String>,
    /// Whether the evidence for the other axis is about as strong.
    pub is_balanced: bool,
}

/// Evidence of one kind.
#[derive(Clone, Debug, PartialEq)]
struct Evidence {
    /// Logarithm of the odds for +z over +y.
    log_odds: f64,
    reason: String,
}

/// Logarithm of the odds for +z before all evidence.
const PRIOR: f64 = -0.2;

/// Log-odds below which evidence is balanced: 3 to 1.
const BALANCED: f64 = 1.1;

impl UpAxis {
    /// The direction that the file's format has, as glTF; else the more likely of +y and +z in
    /// `scene`, which has luminaires at these positions, with
    /// their aims where those are given.
    pub fn of(scene: &Scene, luminaires: &[(DVec3, Option<DVec3>)]) -> UpAxis {
        if let Some(axis) = scene.up {
            let reasons = vec!["the format of its file".into()];
            return UpAxis { axis, reasons, is_balanced: false };
        }
        let mut evidence = words::evidence(scene);
        evidence.extend(luminaires::evidence(scene, luminaires));
        evidence.push(geometry::evidence(scene));
        let sum = PRIOR + evidence.iter().map(|e| e.log_odds).sum::<f64>();
        evidence.sort_by(|a, b| b.log_odds.abs().total_cmp(&a.log_odds.abs()));
        let is_z = sum > 0.0;
        let supports = |e: &Evidence| (e.log_odds > 0.0) == is_z && e.log_odds.abs() > 0.1;
        let reasons = evidence.into_iter().filter(supports).map(|e| e.reason);
        UpAxis {
            axis: if is_z { DVec3::Z } else { DVec3::Y },
            reasons: reasons.collect(),
            is_balanced: sum.abs() < BALANCED,
        }
    }

    /// Unit `axis`, as it was given.
    pub fn given(axis: DVec3) -> UpAxis {
        UpAxis { axis, reasons: vec![], is_balanced: false }
    }
}

impl UpAxis {
    /// That the axis is uncertain, if it is.
    pub fn warning(&self) -> Option<String> {
        let other = if self.axis == DVec3::Z { "+y: 0,1,0" } else { "+z: 0,0,1" };
        self.is_balanced.then(|| {
            format!("up is taken to be {self}, but may be {other}; give the right one by --up")
        })
    }
}

impl fmt::Display for UpAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.axis {
            DVec3::Y => f.write_str("+y")?,
            DVec3::Z => f.write_str("+z")?,
            DVec3 { x, y, z } => write!(f, "{x},{y},{z}")?,
        }
        match &self.reasons[..] {
            [] if self.is_balanced => f.write_str(", the default of OBJ files"),
            [] => Ok(()),
            reasons => write!(f, ", from {}", reasons.join("; ")),
        }
    }
}

impl Scene {
    /// Which way is up: as given by [`Scene::with_up`], else the more likely of +y and +z.
    pub fn up(&self) -> DVec3 {
        match self.up {
            Some(up) => up,
            None => self.derived(|scene| UpAxis::of(scene, &scene.luminaire_aims())).axis,
        }
    }

    /// The same scene with unit `up` as the direction away from the ground.
    pub fn with_up(mut self, up: DVec3) -> Scene {
        self.up = up.try_normalize();
        self
    }

    fn luminaire_aims(&self) -> Vec<(DVec3, Option<DVec3>)> {
        self.luminaires().iter().map(|lamp| (lamp.position, Some(lamp.aim))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Triangle};

    /// A room of 6 m by 4 m, 3 m high along +z, with these names of floor, ceiling and walls, and
    /// these comments; the surfaces face inwards.
    fn room(names: [&str; 3], comments: &[&str]) -> Scene {
        let at = |k: u32| {
            DVec3::new(6.0, 4.0, 3.0)
                * DVec3::new(k as f64 % 2.0, (k / 2 % 2) as f64, (k / 4) as f64)
        };
        let quads =
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [3, 7, 6, 2], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = quads.iter().zip([0, 1, 2, 2, 2, 2]).flat_map(|(&[a, b, c, d], group)| {
            [[a, b, c], [a, c, d]].map(|corners| Triangle { corners, group, ..Default::default() })
        });
        let groups = names.map(String::from).to_vec();
        let (positions, grey) = ((0..8).map(at).collect(), vec![Material::grey("grey", 0.5)]);
        let scene = Scene::new(positions, triangles.collect(), groups, grey).unwrap();
        scene.with_comments(comments.iter().map(ToString::to_string).collect())
    }

    fn up(scene: &Scene, luminaires: &[(DVec3, Option<DVec3>)]) -> (DVec3, bool) {
        let up = UpAxis::of(scene, luminaires);
        assert_eq!(up.is_balanced, up.warning().is_some());
        (up.axis, up.is_balanced)
    }

    /// A closed room says nothing by its geometry: each other kind of evidence decides.
    #[test]
    fn each_kind_of_evidence_decides_for_a_closed_room() {
        let plain = ["a", "b", "c"];
        assert_eq!(up(&room(plain, &[]), &[]), (DVec3::Y, true));
        for names in [
            ["Floor", "b", "c"],
            ["a", "CEILING_01", "c"],
            ["Boden", "Decke", "Wand"],
            ["a", "b", "walls"],
        ] {
            assert_eq!(up(&room(names, &[]), &[]), (DVec3::Z, false), "{names:?}");
        }
        for (comment, axis) in [
            ("6 x 4 x 3 m, z up, closed", DVec3::Z),
            ("Up axis: Z", DVec3::Z),
            ("+Z is up", DVec3::Z),
            ("z-axis up", DVec3::Z),
            ("y-up", DVec3::Y),
            ("File exported by IfcConvert 0.7", DVec3::Z),
        ] {
            assert_eq!(up(&room(plain, &[comment]), &[]), (axis, false), "{comment}");
        }
        // A light program's default alone says little.
        assert_eq!(up(&room(plain, &["Blender v2.93"]), &[]), (DVec3::Y, true));
        let downlights = [1.5, 4.5].map(|x| (DVec3::new(x, 2.0, 2.95), None));
        assert_eq!(up(&room(plain, &[]), &downlights), (DVec3::Z, false));
        let wall_washer = [(DVec3::new(3.0, 0.2, 1.5), Some(DVec3::NEG_Z))];
        assert_eq!(up(&room(plain, &[]), &wall_washer), (DVec3::Z, false));
    }

    /// Names of surfaces are stronger than the default of the program that wrote them, a statement
    /// is stronger than names.
    #[test]
    fn stronger_evidence_wins() {
        let names = ["floor", "ceiling", "wall"];
        let blender = UpAxis::of(&room(names, &["Blender 5.0.1"]), &[]);
        assert_eq!((blender.axis, blender.is_balanced), (DVec3::Z, false));
        assert_eq!(
            blender.to_string(),
            "+z, from surfaces named 'floor', 'ceiling'; surfaces named 'wall'"
        );
        assert_eq!(up(&room(["floor", "b", "c"], &["y up"]), &[]).0, DVec3::Y);
        assert_eq!(UpAxis::given(DVec3::X).to_string(), "1,0,0");
    }
}
