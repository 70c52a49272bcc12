//! RefinementSettings with hemicubes: batches drawn, added up and read back.

use std::f64::consts::FRAC_PI_2;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use super::device::Gpu;
use super::draw_list::DrawList;
use super::hemisphere_sum::HemisphereSum;
use super::layout::{Corner, RadianceTriangle, RadianceView, Sums, TILE, Tile};
use super::memory::Memory;
use super::radiance::{Radiance, View, image_size};
use super::readback::{Readback, StageSeconds};
use super::sources::SourceBuffers;
use super::split_float::SplitFloat;
use crate::error::{Error, ErrorKind};
use crate::gather::light_projection::LightProjection;
use crate::gather::lights::{APART, Lights, NO_LIGHT};
use crate::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::hemicube::{self, Face, Frame, RESOLUTIONS};
use crate::mesh::Mesh;
use crate::sampling::rotation::CellRotation;
use crate::scene::{Rgb, Scene};

/// Gathers with hemicubes (Cohen and Greenberg 1985) on a graphics device, one a place.
///
/// A pixel sees a point of the scene and takes the radiosity there times its exact form factor.
/// Lights get an image of their own, that they fill: what comes straight from one is its closed
/// form times the share of that image in which nothing hides it.
#[derive(Debug)]
pub struct HemicubeGather {
    gpu: Gpu,
    chunks: DrawList,
    lights: Lights,
    /// What there is memory for; none while it makes room for the light.
    batches: Option<Batches>,
    local: SplitFloat,
    turns: CellRotation,
    /// Unit of light on the device, W/m²: a power of two, so that dividing by it rounds nothing.
    bright: f64,
    triangles: usize,
    resolution: u32,
    slots: u32,
    /// Places in a batch at most.
    most: u32,
    seconds: StageSeconds,
    drawn: u64,
}

/// What draws and adds up hemicubes, a batch at a time.
#[derive(Debug)]
struct Batches {
    radiance: Radiance,
    sum: HemisphereSum,
    readback: Readback,
    /// Places at once, at most.
    most: u32,
    _memory: Memory,
}

/// What one place looks at: views to draw, and the lights apart with their form factors as if
/// nothing were in between.
struct Look {
    views: Vec<View>,
    tiles: Vec<Tile>,
    apart: Vec<(u32, f64)>,
}

/// Images of a batch take at most this many bytes, if more than one.
const BATCH_BYTES: u64 = 64 << 20;

/// Places in a batch at most.
const MAX_BATCH: u32 = 64;

impl HemicubeGather {
    /// HemicubeRows with a top face of `resolution` × `resolution` pixels in the scene of `mesh`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for an unusable resolution ([`hemicube::check_resolution`]) or a
    /// scene that does not fit the device; [`ErrorKind::Memory`] when there is no memory for a single
    /// hemicube; [`ErrorKind::Device`] when the device fails.
    pub fn new(gpu: &Gpu, mesh: &Mesh, resolution: u32) -> Result<HemicubeGather, Error> {
        hemicube::check_resolution(resolution)?;
        let scene = mesh.scene();
        let lights = Lights::new(mesh.shared_scene());
        let slots = lights.lights.len().min(APART) as u32;
        let batch = batch(gpu, scene, resolution, slots)?;
        let (local, turns) = (SplitFloat::new(scene), CellRotation::new(&scene.bounds()));
        let bright = lights.lights.iter().map(|l| l.exitance.max_element()).fold(0.0, f64::max);
        let bright = if bright > 0.0 { bright.log2().floor().exp2() } else { 1.0 };
        let chunks = DrawList::new(scene);
        let order = (&chunks.order[..], &local, bright);
        let size = (resolution, slots);
        let batches =
            gpu.fit(batch, |m, most| Batches::new(m, scene, &lights, order, size, most))?;
        Ok(HemicubeGather {
            gpu: gpu.clone(),
            chunks,
            lights,
            most: batches.most,
            batches: Some(batches),
            local,
            turns,
            bright,
            triangles: scene.triangles().len(),
            resolution,
            slots,
            seconds: StageSeconds::default(),
            drawn: 0,
        })
    }

    /// Time spent so far.
    pub fn seconds(&self) -> StageSeconds {
        self.seconds
    }

    /// HemicubeRows drawn so far.
    pub fn drawn(&self) -> u64 {
        self.drawn
    }

    fn look(&self, scene: &Scene, place: &GatherPoint) -> Look {
        let mut apart = self.lights.importance_ranked(place);
        let mut fits = vec![];
        apart.retain(|&(light, _)| {
            let triangles = self.lights.lights[light as usize].triangles.iter();
            let view = LightProjection::new(place, triangles.map(|&t| scene.corners(t as usize)));
            fits.extend(view);
            view.is_some()
        });
        let frame = Frame::new(place.normal, self.turns.at(place.position, place.near) * FRAC_PI_2);
        let mut lights = [NO_LIGHT; APART];
        lights.iter_mut().zip(&apart).for_each(|(l, a)| *l = a.0);
        let [eye, eye_low] = self.local.parts(place.position);
        let view = |face: Face, light: u32| View {
            view: RadianceView {
                eye,
                near: self.local.length(place.near),
                right: face.right.as_vec3().to_array(),
                bottom: face.bottom as f32,
                up: face.up.as_vec3().to_array(),
                light,
                forward: face.forward.as_vec3().to_array(),
                apart: apart.len() as u32,
                eye_low,
                padding: 0,
                lights,
            },
            places: self.chunks.in_view(place.position, &face),
        };
        let faces = Face::all(&frame).into_iter().map(|face| view(face, NO_LIGHT));
        let of_lights = fits.iter().zip(&apart).map(|(fit, a)| view(fit.face, a.0));
        let views = faces.chain(of_lights).collect();
        let mut tiles: Vec<Tile> = fits.iter().map(|fit| tile(fit, &frame)).collect();
        tiles.resize(self.slots as usize, Tile::default());
        Look { views, tiles, apart }
    }

    fn gathered(&self, sums: &Sums, look: &Look) -> IrradianceSample {
        let mut direct = Rgb::ZERO;
        for (&(light, factor), &[seen, whole]) in look.apart.iter().zip(&sums.lights) {
            let (light, seen) = (&self.lights.lights[light as usize], f64::from(seen));
            direct += light.exitance
                * match light.convex {
                    true => factor * seen / f64::from(whole).max(f64::MIN_POSITIVE),
                    false => seen,
                };
        }
        let [r, g, b] = sums.radiosity.map(f64::from);
        IrradianceSample {
            irradiance: Rgb::new(r, g, b) * self.bright + direct,
            direct,
            escaped: sums.open.into(),
            backface: sums.back.into(),
            inverse_distance: self.local.inverse_length(sums.nearness),
        }
    }

    fn gather_batch(
        &mut self,
        batches: &Batches,
        (scene, bindings): (&Scene, &wgpu::BindGroup),
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let start = Instant::now();
        let looks: Vec<Look> = places.par_iter().map(|p| self.look(scene, p)).collect();
        let views: Vec<&[View]> = looks.iter().map(|l| &l.views[..]).collect();
        let tiles: Vec<Tile> = looks.iter().flat_map(|l| &l.tiles).copied().collect();
        let gpu = &self.gpu;
        let Batches { radiance, sum, readback, .. } = batches;
        let mut seconds = self.seconds;
        let gathered: Result<Vec<IrradianceSample>, String> = gpu.attempt(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let queries = readback.queries();
            radiance.draw(gpu, &mut encoder, bindings, &views, queries);
            sum.sum(gpu, &mut encoder, places.len() as u32, &tiles, queries);
            let source = (&sum.sums, size_of::<Sums>() as u64 * places.len() as u64);
            readback.finish(gpu, encoder, source, (start, &mut seconds), |bytes| {
                let sums: &[Sums] = bytemuck::cast_slice(bytes);
                sums.iter().zip(&looks).map(|(s, look)| checked(self.gathered(s, look))).collect()
            })
        })?;
        self.seconds = seconds;
        self.drawn += places.len() as u64;
        gathered.map_err(|found| gpu.wrong(found))
    }

    /// Puts the light on the device. Where there is no memory for it, smaller batches make room.
    fn ready(&mut self, sources: &RadiosityField) -> Result<(Batches, Upload), Error> {
        let (gpu, scene) = (&self.gpu, sources.mesh.scene());
        let order = (&self.chunks.order[..], &self.local, self.bright);
        let size = (self.resolution, self.slots);
        loop {
            let batches = match self.batches.take() {
                Some(batches) => batches,
                None => gpu.fit(self.most, |memory, most| {
                    Batches::new(memory, scene, &self.lights, order, size, most)
                })?,
            };
            let upload = gpu.attempt(|| {
                let memory = Memory::new(gpu);
                let buffers = SourceBuffers::new(&memory, sources, self.triangles, self.bright)?;
                let bindings = batches.radiance.bindings(gpu, &buffers);
                Ok(Upload { bindings, _memory: memory })
            });
            match upload {
                Ok(upload) => return Ok((batches, upload)),
                Err(e) if e.kind() == ErrorKind::Memory && batches.most > 1 => {
                    self.most = batches.most / 2;
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
struct Upload {
    bindings: wgpu::BindGroup,
    _memory: Memory,
}

impl Batches {
    fn new(
        memory: Memory,
        scene: &Scene,
        lights: &Lights,
        order: (&[u32], &SplitFloat, f64),
        (resolution, slots): (u32, u32),
        most: u32,
    ) -> Result<Batches, Error> {
        let size = (resolution, slots, most);
        let radiance = Radiance::new(&memory, scene, lights, order, size)?;
        let sum = HemisphereSum::new(&memory, &radiance.layers, resolution, slots)?;
        let readback = Readback::new(&memory, sum.sums.size())?;
        Ok(Batches { radiance, sum, readback, most, _memory: memory })
    }
}

/// What was gathered, if it can be; or what is wrong with it.
fn checked(found: IrradianceSample) -> Result<IrradianceSample, String> {
    // Shares are sums of weights that sum to 1; of 3·4096² pixels in 32 bits to better than this.
    let share = |x: f64| (0.0..=1.01).contains(&x);
    let light = |c: Rgb| c.is_finite() && c.min_element() >= 0.0;
    let good = light(found.irradiance) && light(found.direct) && share(found.escaped);
    match good && share(found.backface) && found.inverse_distance.is_finite() {
        true => Ok(found),
        false => Err(format!("{found:?} for a place")),
    }
}

impl Gather for HemicubeGather {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let (batches, upload) = self.ready(sources)?;
        let mut gathered = Vec::with_capacity(places.len());
        let light = (sources.mesh.scene(), &upload.bindings);
        for places in places.chunks(batches.most as usize) {
            gathered.extend(self.gather_batch(&batches, light, places)?);
        }
        self.batches = Some(batches);
        Ok(gathered)
    }
}

/// How many places fit a batch on this device, if it can do any.
fn batch(gpu: &Gpu, scene: &Scene, resolution: u32, slots: u32) -> Result<u32, Error> {
    let limits = gpu.device.limits();
    let setting = |place: String, found: String, remedy: String| {
        Err(Error::new(ErrorKind::Setting, place, found, remedy))
    };
    let texture = limits.max_texture_dimension_2d;
    let buffer = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let fits = |n: &u32| image_size(*n, slots)[1] <= texture;
    if !fits(&resolution) {
        let most = RESOLUTIONS.rev().find(fits).unwrap_or(0) / 2 * 2;
        return setting(
            format!("hemicube resolution {resolution}"),
            format!("an image of {} lines", image_size(resolution, slots)[1]),
            format!("this device allows resolutions up to {most}"),
        );
    }
    // Lights are there twice.
    let each = size_of::<RadianceTriangle>().max(3 * size_of::<Corner>()) as u64;
    let triangles = scene.triangles().len() as u64;
    if 2 * triangles * each > buffer {
        let (found, most) = (format!("{triangles} triangles"), buffer / each / 2);
        return setting("scene".into(), found, format!("this device holds {most}"));
    }
    // Four floats of colour a pixel.
    let [width, height] = image_size(resolution, slots);
    let image = u64::from(width) * u64::from(height) * 16;
    Ok(MAX_BATCH.min((BATCH_BYTES / image).max(1) as u32).min(limits.max_texture_array_layers))
}

/// Where the pixels of a light's tile look, in the place's frame.
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
        padding: 0,
        up: local(fit.up),
        padding_2: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_light_is_an_error() {
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
            assert!(checked(found).unwrap_err().contains("Gathered"), "{found:?}");
        }
    }
}
