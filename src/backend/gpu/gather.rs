//! Irradiance gathered with hemicubes: batches drawn, added up and read back.
//!
//! ```text
//! points ─► GatherJob: 5 faces + a tile for each light seen on its own ─► radiance images
//!                      + one for the sun                                       │
//! IrradianceSample ◄─ sample(sums, job), checked ◄─ readback ◄─ hemisphere sum ┘
//! ```
//!
//! What comes straight from a light or the sun is its closed form times the share of its tile that
//! is seen; luminaires are looked for by rays on the CPU, one each where they are points, which
//! takes less than a view of the scene; all other light is the sum of radiosity × form factor over
//! the pixels of the hemicube.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use super::device::Gpu;
use super::draw_list::DrawList;
use super::error::check_hemicubes_see;
use super::hemisphere_sum::HemisphereSum;
use super::layout::{Corner, RadianceTriangle, RadianceView, Sums, TILE, Tile};
use super::limits::GpuLimits;
use super::memory::Memory;
use super::radiance::{DrawnScene, Radiance, TargetSize, View};
use super::readback::{Readback, Results, Timer};
use super::sources::SourceBuffers;
use super::split_float::SplitFloat;
use crate::error::{Error, ErrorKind};
use crate::gather::light_projection::LightProjection;
use crate::gather::lights::{Lights, MAX_EXPLICIT_LIGHTS, NO_LIGHT};
use crate::gather::luminaire_light::LuminaireLight;
use crate::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::hemicube::{self, Face, Frame, RESOLUTIONS};
use crate::mesh::Mesh;
use crate::progress::Timings;
use crate::sampling::rotation::CellRotation;
use crate::scene::{Rgb, Scene, Sky, Sun};
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// Gathers with hemicubes (Cohen and Greenberg 1985) on a graphics device, one a point.
///
/// A pixel sees a point of the scene and takes the radiosity there times its exact form factor.
/// Lights get an image of their own, that they fill: what comes straight from one is its closed
/// form times the share of that image in which nothing hides it.
#[derive(Debug)]
pub struct HemicubeGather {
    gpu: Gpu,
    draw_list: DrawList,
    lights: Lights,
    /// What there is memory for; none while it makes room for the light.
    batches: Option<Batches>,
    coordinates: SplitFloat,
    rotations: CellRotation,
    /// What rays to luminaires meet and pass; none without luminaires.
    sight: Option<(Arc<RayScene>, Panes)>,
    /// Unit of light on the device, W/m²: a power of two, so that dividing by it rounds nothing.
    radiance_unit: f64,
    triangles: usize,
    /// Images of a batch; fewer where memory is short.
    size: TargetSize,
    timings: Timings,
    drawn: u64,
}

/// What draws and adds up hemicubes, a batch at a time.
#[derive(Debug)]
struct Batches {
    radiance: Radiance,
    sum: HemisphereSum,
    readback: Readback,
    /// Points at once, at most.
    max_points: u32,
    _memory: Memory,
}

/// What one point sees: views to draw, and the lights seen on their own with their form factors as
/// if nothing were in between.
struct GatherJob {
    views: Vec<View>,
    tiles: Vec<Tile>,
    lights: Vec<(u32, f64)>,
    /// Its cosine, if any of it is above the horizon: its tile is the one after those of the
    /// lights.
    sun: Option<f64>,
}

/// Images of a batch take at most this many bytes, if more than one. Chosen by hand; no measurement
/// kept.
const BATCH_BYTES: u64 = 64 << 20;

/// Points in a batch at most. Chosen by hand; no measurement kept.
const MAX_BATCH: u32 = 64;

impl HemicubeGather {
    /// Hemicubes with a top face of `resolution` × `resolution` pixels in the scene of `mesh`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for an unusable resolution ([`hemicube::check_resolution`]) or a
    /// scene that does not fit the device; [`ErrorKind::Memory`] when there is no memory for a
    /// single hemicube; [`ErrorKind::Device`] when the device fails.
    pub fn new(gpu: &Gpu, mesh: &Mesh, resolution: u32) -> Result<HemicubeGather, Error> {
        hemicube::check_resolution(resolution)?;
        let scene = mesh.scene();
        check_hemicubes_see(scene)?;
        let lights = Lights::new(mesh.shared_scene());
        let sky = scene.sky();
        let tiles = lights.lights.len() + usize::from(sky.sun().is_some());
        let tiles = tiles.min(MAX_EXPLICIT_LIGHTS) as u32;
        let size = target_size(gpu.limits(), scene, resolution, tiles)?;
        let lamps = lights.lights.iter().map(|l| l.exitance.max_element());
        let brightest = lamps.chain(sky.map().map(|_| PI * sky.brightest())).fold(0.0, f64::max);
        let mut gather = HemicubeGather {
            gpu: gpu.clone(),
            draw_list: DrawList::new(scene),
            lights,
            batches: None,
            coordinates: SplitFloat::new(scene),
            rotations: CellRotation::new(&scene.bounds()),
            sight: (!scene.luminaires().is_empty())
                .then(|| (RayScene::of_scene(scene), Panes::of_scene(scene))),
            radiance_unit: if brightest > 0.0 { brightest.log2().floor().exp2() } else { 1.0 },
            triangles: scene.triangles().len(),
            size,
            timings: Timings::default(),
            drawn: 0,
        };
        let batches = gather.make_batches(scene)?;
        gather.size.batch = batches.max_points;
        gather.batches = Some(batches);
        Ok(gather)
    }

    /// Time of the passes so far.
    pub fn timings(&self) -> Timings {
        self.timings
    }

    /// Hemicubes drawn so far.
    pub fn drawn(&self) -> u64 {
        self.drawn
    }

    /// Images of `self.size`, or fewer of them where memory is short.
    fn make_batches(&self, scene: &Scene) -> Result<Batches, Error> {
        let drawn = self.drawn_scene(scene);
        self.gpu.retry_with_smaller_batches(self.size.batch, |memory, batch| {
            Batches::new(memory, drawn, TargetSize { batch, ..self.size })
        })
    }

    fn drawn_scene<'a>(&'a self, scene: &'a Scene) -> DrawnScene<'a> {
        DrawnScene {
            scene,
            lights: &self.lights,
            order: &self.draw_list.order,
            coordinates: &self.coordinates,
            radiance_unit: self.radiance_unit,
        }
    }

    /// What is drawn for `point`.
    fn job(&self, scene: &Scene, point: &GatherPoint) -> GatherJob {
        let mut lights = self.lights.importance_ranked(point);
        let sun = scene.sky().sun().map(|sun| (sun, point.normal.dot(sun.direction)));
        let sun = sun.filter(|&(_, cosine)| cosine > -Sun::SINE);
        if sun.is_some() {
            lights.truncate(MAX_EXPLICIT_LIGHTS - 1);
        }
        let mut projections = vec![];
        lights.retain(|&(light, _)| {
            let triangles = self.lights.lights[light as usize].triangles.iter();
            let corners = triangles.map(|&t| scene.corners(t as usize));
            let projection = LightProjection::new(point, corners);
            projections.extend(projection);
            projection.is_some()
        });
        let frame =
            Frame::new(point.normal, self.rotations.at(point.position, point.near) * FRAC_PI_2);
        let mut ids = [NO_LIGHT; MAX_EXPLICIT_LIGHTS];
        for (id, light) in ids.iter_mut().zip(&lights) {
            *id = light.0;
        }
        let [eye, eye_low] = self.coordinates.parts(point.position);
        let view = |face: Face, light: u32| View {
            view: RadianceView {
                eye,
                near: self.coordinates.length(point.near),
                right: face.right.as_vec3().to_array(),
                bottom: face.bottom as f32,
                up: face.up.as_vec3().to_array(),
                light,
                forward: face.forward.as_vec3().to_array(),
                light_count: lights.len() as u32,
                eye_low,
                padding: 0,
                lights: ids,
            },
            runs: self.draw_list.in_view(point.position, &face),
        };
        let faces = Face::all(&frame).into_iter().map(|face| view(face, NO_LIGHT));
        let of_lights = projections.iter().zip(&lights).map(|(p, light)| view(p.face, light.0));
        let to_sun = sun.map(|(sun, _)| LightProjection::of_disc(sun.direction, Sun::tangent()));
        let of_sun = to_sun.iter().map(|p| view(p.face, NO_LIGHT));
        let views = faces.chain(of_lights).chain(of_sun).collect();
        let mut tiles: Vec<Tile> = projections.iter().map(|p| tile(p, &frame)).collect();
        let disc = (Sun::tangent() * Sun::tangent()) as f32;
        tiles.extend(to_sun.map(|p| Tile { disc, ..tile(&p, &frame) }));
        tiles.resize(self.size.tiles as usize, Tile::default());
        GatherJob { views, tiles, lights, sun: sun.map(|(_, cosine)| cosine) }
    }

    /// What the sums over a point's pixels say, under this sky.
    fn sample(&self, sums: &Sums, job: &GatherJob, sky: &Sky) -> IrradianceSample {
        let mut direct = Rgb::ZERO;
        for (&(light, factor), &[seen, alone]) in job.lights.iter().zip(&sums.lights) {
            let (light, seen) = (&self.lights.lights[light as usize], f64::from(seen));
            direct += light.exitance
                * if light.convex {
                    factor * seen / f64::from(alone).max(f64::MIN_POSITIVE)
                } else {
                    seen
                };
        }
        if let (Some(sun), Some(cosine)) = (sky.sun(), job.sun) {
            let [seen, all] = sums.lights[job.lights.len()].map(f64::from);
            direct += match sun.unoccluded(cosine) {
                Some(irradiance) => irradiance * (seen / all.max(f64::MIN_POSITIVE)),
                None => sun.irradiance * (seen / (Sun::SINE * Sun::SINE)),
            };
        }
        let [r, g, b] = sums.radiosity.map(f64::from);
        let escaped = f64::from(sums.open);
        // Other skies are in the pixels.
        let uniform = PI * sky.uniform_radiance().unwrap_or(Rgb::ZERO);
        IrradianceSample {
            irradiance: Rgb::new(r, g, b) * self.radiance_unit + direct + uniform * escaped,
            direct,
            noise: 0.0,
            escaped,
            backface: sums.back.into(),
            inverse_distance: self.coordinates.inverse_length(sums.nearness),
        }
    }

    fn gather_batch(
        &mut self,
        batches: &Batches,
        light: &Upload,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let start = Instant::now();
        let jobs: Vec<GatherJob> = points.par_iter().map(|p| self.job(light.scene, p)).collect();
        let views: Vec<&[View]> = jobs.iter().map(|job| &job.views[..]).collect();
        let tiles: Vec<Tile> = jobs.iter().flat_map(|job| &job.tiles).copied().collect();
        let sky = light.scene.sky();
        let gpu = &self.gpu;
        let Batches { radiance, sum, readback, .. } = batches;
        let mut timings = self.timings;
        let timer = Timer { start, timings: &mut timings };
        let samples: Result<Vec<IrradianceSample>, String> = gpu.with_error_scopes(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let queries = readback.queries();
            radiance.draw(&gpu.queue, &mut encoder, &light.bindings, &views, queries);
            sum.sum(&gpu.queue, &mut encoder, points.len() as u32, &tiles, queries);
            let bytes = size_of::<Sums>() as u64 * points.len() as u64;
            let results = Results { buffer: &sum.sums, bytes };
            readback.finish(gpu, encoder, results, timer, |bytes| {
                let sums: &[Sums] = bytemuck::cast_slice(bytes);
                sums.iter().zip(&jobs).map(|(s, job)| checked(self.sample(s, job, sky))).collect()
            })
        })?;
        self.timings = timings;
        self.drawn += points.len() as u64;
        let mut samples = samples.map_err(|found| gpu.invalid_result(found))?;
        self.add_luminaires(light.scene, points, &mut samples);
        Ok(samples)
    }

    /// Adds what comes straight from luminaires.
    fn add_luminaires(
        &self,
        scene: &Scene,
        points: &[GatherPoint],
        samples: &mut [IrradianceSample],
    ) {
        let Some((rays, panes)) = &self.sight else { return };
        let (luminaires, rotations) = (scene.luminaires(), &self.rotations);
        let light = LuminaireLight { luminaires, rays, panes, rotations };
        points.par_iter().zip(samples).for_each(|(point, sample)| {
            let irradiance = light.irradiance(point);
            sample.irradiance += irradiance;
            sample.direct += irradiance;
        });
    }

    /// Puts the light on the device. Where there is no memory for it, smaller batches make room.
    fn upload<'s>(&mut self, sources: &RadiosityField<'s>) -> Result<(Batches, Upload<'s>), Error> {
        let scene = sources.mesh.scene();
        loop {
            let batches = match self.batches.take() {
                Some(batches) => batches,
                None => self.make_batches(scene)?,
            };
            let gpu = &self.gpu;
            let upload = gpu.with_error_scopes(|| {
                let memory = gpu.memory();
                let (triangles, unit) = (self.triangles, self.radiance_unit);
                let buffers = SourceBuffers::new(&memory, sources, gpu.limits(), triangles, unit)?;
                let bindings = batches.radiance.bindings(&gpu.device, &buffers);
                Ok(Upload { scene, bindings, _memory: memory })
            });
            match upload {
                Ok(upload) => return Ok((batches, upload)),
                Err(e) if e.kind() == ErrorKind::Memory && batches.max_points > 1 => {
                    self.size.batch = batches.max_points / 2;
                }
                Err(e) => {
                    self.batches = Some(batches);
                    return Err(e);
                }
            }
        }
    }
}

/// The light to be gathered, on the device.
struct Upload<'s> {
    scene: &'s Scene,
    bindings: wgpu::BindGroup,
    _memory: Memory,
}

impl Batches {
    fn new(memory: Memory, drawn: DrawnScene, size: TargetSize) -> Result<Batches, Error> {
        let radiance = Radiance::new(&memory, drawn, size)?;
        let sum = HemisphereSum::new(&memory, &radiance.targets, size)?;
        let readback = Readback::new(&memory, sum.sums.size())?;
        Ok(Batches { radiance, sum, readback, max_points: size.batch, _memory: memory })
    }
}

/// A sample that can be, or what is wrong with it.
fn checked(sample: IrradianceSample) -> Result<IrradianceSample, String> {
    // Shares are sums of weights that sum to 1; of 3·4096² pixels in 32 bits to better than this.
    let share = |x: f64| (0.0..=1.01).contains(&x);
    let light = |c: Rgb| c.is_finite() && c.min_element() >= 0.0;
    let shares = share(sample.escaped) && share(sample.backface);
    let good = light(sample.irradiance) && light(sample.direct) && shares;
    if good && sample.inverse_distance.is_finite() {
        return Ok(sample);
    }
    Err(format!("{sample:?} for a place"))
}

impl Gather for HemicubeGather {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let (batches, light) = self.upload(sources)?;
        let mut gathered = Vec::with_capacity(places.len());
        for points in places.chunks(batches.max_points as usize) {
            gathered.extend(self.gather_batch(&batches, &light, points)?);
        }
        self.batches = Some(batches);
        Ok(gathered)
    }
}

/// The images of a batch on a device of these limits, if it can draw any.
fn target_size(
    limits: GpuLimits,
    scene: &Scene,
    resolution: u32,
    tiles: u32,
) -> Result<TargetSize, Error> {
    let of = |resolution: u32| TargetSize { resolution, tiles, batch: 1 };
    let fits = |n: &u32| of(*n).pixels()[1] <= limits.texture;
    let [width, height] = of(resolution).pixels();
    if !fits(&resolution) {
        let most = RESOLUTIONS.rev().find(fits).unwrap_or(0) / 2 * 2;
        let place = format!("hemicube resolution {resolution}");
        let found = format!("an image of {height} lines");
        let remedy = format!("this device allows resolutions up to {most}");
        return Err(Error::new(ErrorKind::Setting, place, found, remedy));
    }
    // Triangles of lights are drawn once more on their own.
    let triangle_bytes = size_of::<RadianceTriangle>().max(3 * size_of::<Corner>()) as u64;
    let triangles = scene.triangles().len() as u64;
    if 2 * triangles * triangle_bytes > limits.buffer {
        let found = format!("{triangles} triangles");
        let remedy = format!("this device holds {}", limits.buffer / triangle_bytes / 2);
        return Err(Error::new(ErrorKind::Setting, "scene".to_string(), found, remedy));
    }
    // Four floats of colour a pixel.
    let image = u64::from(width) * u64::from(height) * 16;
    let batch = MAX_BATCH.min((BATCH_BYTES / image).max(1) as u32).min(limits.layers);
    Ok(TargetSize { batch, ..of(resolution) })
}

/// Where the pixels of a light's or of the sun's tile look, in the frame of the point.
fn tile(fit: &LightProjection, frame: &Frame) -> Tile {
    let Frame { tangent, bitangent, normal } = *frame;
    let local =
        |d: DVec3| DVec3::new(d.dot(tangent), d.dot(bitangent), d.dot(normal)).as_vec3().to_array();
    // All of the image spans twice its half axes each way.
    let area = 4.0 * fit.right.cross(fit.up).dot(fit.face.forward).abs();
    Tile {
        middle: local(fit.middle),
        scale: (area / f64::from(TILE * TILE)) as f32,
        right: local(fit.right),
        disc: 0.0,
        up: local(fit.up),
        padding: 0,
    }
}

#[cfg(test)]
mod twin_tests;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejects_negative_or_infinite_samples() {
        let good = IrradianceSample {
            irradiance: Rgb::ONE,
            escaped: 0.25,
            backface: 0.75,
            ..Default::default()
        };
        assert_eq!(checked(good), Ok(good));
        let bad = [
            IrradianceSample { irradiance: Rgb::new(0.0, f64::NAN, 0.0), ..good },
            IrradianceSample { irradiance: Rgb::new(0.0, 0.0, -1.0), ..good },
            IrradianceSample { direct: Rgb::INFINITY, ..good },
            IrradianceSample { escaped: 1.5, ..good },
            IrradianceSample { backface: -0.5, ..good },
            IrradianceSample { inverse_distance: f64::INFINITY, ..good },
        ];
        for found in bad {
            assert!(checked(found).unwrap_err().contains("IrradianceSample"), "{found:?}");
        }
    }
}
