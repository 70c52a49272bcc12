//! A louvre of adiabatic slats between two plates, against particles that are followed from the hot
//! plate: with geometry, visibility and temperatures of their own.

use std::ops::ControlFlow;

use fastrand::Rng;
use glam::DVec3;
use radiosity::ViewFactors;
use radiosity::heat::{HeatSettings, STEFAN_BOLTZMANN};

use super::{at, balance, with_flux};
use crate::common::scenes::{facing_down, facing_up, grey, quads};

const SLATS: usize = 5;

/// Of the two sides of a slat.
const EMISSIVITY: [f64; 2] = [0.7, 0.2];

/// A parallelogram: a corner and two sides; its front is along their cross product.
#[derive(Clone, Copy)]
struct Panel {
    corner: DVec3,
    sides: [DVec3; 2],
}

impl Panel {
    fn normal(&self) -> DVec3 {
        self.sides[0].cross(self.sides[1]).normalize()
    }

    /// Distance along a ray, and whether it meets the front.
    fn met(&self, from: DVec3, along: DVec3) -> Option<(f64, bool)> {
        let normal = self.normal();
        let distance = normal.dot(self.corner - from) / normal.dot(along);
        let on = from + distance * along - self.corner;
        let inside = self.sides.iter().all(|side| {
            let share = on.dot(*side) / side.length_squared();
            (0.0..=1.0).contains(&share)
        });
        (distance > 1e-9 && inside).then(|| (distance, normal.dot(along) < 0.0))
    }

    /// A random point, and a direction by the cosine, on one side.
    fn leave(&self, is_front: bool, rng: &mut Rng) -> (DVec3, DVec3) {
        let from = self.corner + rng.f64() * self.sides[0] + rng.f64() * self.sides[1];
        let (turn, square) = (std::f64::consts::TAU * rng.f64(), rng.f64());
        let (x, y) = (square.sqrt() * turn.cos(), square.sqrt() * turn.sin());
        let normal = if is_front { self.normal() } else { -self.normal() };
        let right = self.sides[0].normalize();
        (from, x * right + y * normal.cross(right) + (1.0 - square).sqrt() * normal)
    }
}

/// The hot plate below, the cold one above, and slats that lean between them.
fn panels() -> Vec<Panel> {
    let plate = |z: f64, up: bool| {
        let [x, y] = [DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];
        let corner = DVec3::new(-1.0, -1.0, z);
        Panel { corner, sides: if up { [x, y] } else { [y, x] } }
    };
    let slat = |k: usize| Panel {
        corner: DVec3::new(-0.9 + 0.35 * k as f64, -1.0, 0.3),
        sides: [DVec3::new(0.3, 0.0, 0.4), DVec3::new(0.0, 2.0, 0.0)],
    };
    [plate(0.0, true), plate(1.0, false)].into_iter().chain((0..SLATS).map(slat)).collect()
}

/// Counts of what becomes of particles from the hot plate.
#[derive(Default)]
struct Counts {
    cold: f64,
    hot: f64,
    /// Absorbed by each slat, and emitted again.
    slats: [f64; SLATS],
    /// Sum of the squares of a particle's absorptions in each.
    squares: [f64; SLATS],
}

/// Follows `count` particles. What a slat absorbs it emits from a random point of a side, chosen by
/// emissivity; what it reflects leaves from a random point of the same side: radiosity is the same
/// all over a side, as in the balance.
fn followed(count: usize) -> Counts {
    let (panels, mut rng, mut counts) = (panels(), Rng::with_seed(7), Counts::default());
    for _ in 0..count {
        let (mut from, mut along) = panels[0].leave(true, &mut rng);
        let mut absorbed = [0.0; SLATS];
        loop {
            let hits = panels.iter().enumerate().filter_map(|(k, panel)| {
                panel.met(from, along).map(|(distance, is_front)| (distance, k, is_front))
            });
            let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, k, is_front)) = nearest else { break };
            match k {
                0 => counts.hot += 1.0,
                1 => counts.cold += 1.0,
                _ => {}
            }
            if k < 2 {
                break;
            }
            let mut side = is_front;
            if rng.f64() < EMISSIVITY[usize::from(!is_front)] {
                absorbed[k - 2] += 1.0;
                side = rng.f64() * EMISSIVITY.iter().sum::<f64>() < EMISSIVITY[0];
            }
            (from, along) = panels[k].leave(side, &mut rng);
        }
        for (k, times) in absorbed.into_iter().enumerate() {
            counts.slats[k] += times;
            counts.squares[k] += times * times;
        }
    }
    counts
}

#[test]
fn louvre_as_particles_find_it() {
    let mut all =
        vec![facing_up([-1.0, 1.0], [-1.0, 1.0], 0.0), facing_down([-1.0, 1.0], [-1.0, 1.0], 1.0)];
    for panel in &panels()[2..] {
        let [a, b] = panel.sides;
        let c = panel.corner;
        all.push([c, c + a, c + a + b, c + b].map(|corner| corner.to_array()));
    }
    let scene = quads(&all.into_iter().map(|quad| (quad, grey())).collect::<Vec<_>>());
    let slats: Vec<usize> = (2..2 + SLATS).collect();
    let go = |_, _| ControlFlow::Continue(());
    let factors = ViewFactors::exact(&scene, 1e-4, &slats, go).unwrap().unwrap();
    let mut surfaces = vec![at(1000.0, &[1.0]), at(0.0, &[1.0])];
    for emissivity in EMISSIVITY {
        surfaces.extend(vec![with_flux(0.0, &[emissivity]); SLATS]);
    }
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    let count = 200_000;
    let (counts, m) = (followed(count), STEFAN_BOLTZMANN * 1000f64.powi(4));
    let count = count as f64;
    // Shares of what the hot plate emits, each within four standard errors of the counts, and 1e-4
    // for the factors.
    for (name, share, flux) in [
        ("cold", counts.cold / count, -found.groups[1].net_flux.value),
        ("hot", counts.hot / count, found.groups[0].irradiance),
    ] {
        let error = (share * (1.0 - share) / count).sqrt();
        assert!((flux / m - share).abs() < 4.0 * error + 1e-4, "{name}: {} {share}", flux / m);
    }
    for k in 0..SLATS {
        // A slat of 0.5 × 2 emits from both sides what it absorbs; the plate has an area of 4.
        let mean = counts.slats[k] / count;
        let error = ((counts.squares[k] / count - mean * mean) / count).sqrt();
        let emission = STEFAN_BOLTZMANN * found.groups[2 + k].temperature.unwrap().powi(4);
        let emitted = EMISSIVITY.iter().sum::<f64>() * emission * 1.0 / (4.0 * m);
        assert!((emitted - mean).abs() < 4.0 * error + 1e-4, "slat {k}: {emitted} {mean} {error}");
    }
}
