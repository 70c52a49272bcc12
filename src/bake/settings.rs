//! All settings of a bake, and which of them an error asks for.

use crate::accuracy::Measure;
use crate::accuracy::hidden::LitRegion;
use crate::bake::light_survey::LightSurvey;
use crate::bake::model;
use crate::error::Error;
use crate::gather::RefinementSettings;
use crate::mesh::{ElementSizing, Mesh};
use crate::scene::{Aabb, Material, Rgb, Scene};
use crate::solver::{Method, Solver};

/// All settings of a bake. Begin with [`BakeSettings::for_error`], [`BakeSettings::elements_only`]
/// or [`BakeSettings::gathering`], and change what is to be different:
///
/// ```
/// # fn settings(scene: &radiosity::Scene) {
/// let mut settings = radiosity::BakeSettings::for_error(0.02, scene);
/// settings.solve.hemicube_resolution = 128;
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BakeSettings {
    /// How light is spread on the elements of a first mesh.
    pub solve: SolveSettings,
    /// How the vertices of a second mesh gather that light; with none, the vertices of the first
    /// get the mean of the elements around them.
    pub gather: Option<GatherSettings>,
    /// Which errors count. Of a bake to an error it counts at the first call of overrides only.
    pub measure: Measure,
}

/// Settings of the first phase of a bake: mesh, rows of form factors, solver.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SolveSettings {
    /// Longest edge of the elements that light is shot on, scene unit.
    pub element_size: f64,
    /// Where most of the light is, if that is a small part of the scene: elements are as given
    /// there, and grow with the distance from it, 1 + distance/diagonal times. With none, as given
    /// everywhere.
    pub region: Option<Aabb>,
    /// Materials, by their index, whose emission is not shot: each element gathers it. For lights
    /// most of whose light falls on nothing that reflects, such as a sky.
    pub gathered_materials: Vec<u32>,
    /// Pixels along an edge of a hemicube's top face, even, for patches that shoot much light; a
    /// half or a quarter of them for dimmer ones. Where rays are cast, the square root of their
    /// number, down to 16 for the dimmest. A device casts rays too where these take less time: see
    /// [`Backend::row_maker`](crate::Backend::row_maker).
    pub hemicube_resolution: u32,
    /// A patch that shoots at least this share of the emitted light gets the full resolution; 0 for
    /// all patches; with none, the backend's own.
    pub full_resolution_share: Option<f64>,
    /// Receivers within this many patch diameters get closed-form factors
    /// ([`crate::form_factor::ProximityCorrection`]); below 0 none.
    pub near_reach: f64,
    /// How light is spread, how far, and from how large patches.
    pub solver: Solver,
    /// Whether GMRES takes the place of `solver.method` in scenes for which [`Solver::for_mesh`]
    /// chooses it.
    pub gmres_if_bright: bool,
    /// Whether the light not yet shot is added, spread evenly (the ambient term of Cohen et al.
    /// 1988).
    pub ambient: bool,
}

/// Settings of the second phase of a bake: vertices that gather.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GatherSettings {
    /// Longest edge of the elements whose corners gather first, scene unit.
    pub element_size: f64,
    /// Quadtree levels by which those elements are split that other surfaces touch.
    pub contact_levels: u32,
    /// Rays a vertex, or as many pixels of a hemicube as are worth that.
    pub rays: u32,
    /// Rays cast on the CPU are doubled, up to 4 times as many, while the estimated error of the
    /// irradiance is above this share of it; infinity for never.
    pub noise_tolerance: f64,
    /// Where elements are split, and how often all vertices gather.
    pub refinement: RefinementSettings,
}

impl SolveSettings {
    /// The solver for `mesh`.
    pub(super) fn solver_for(&self, mesh: &Mesh) -> Solver {
        match Solver::for_mesh(mesh).method {
            method @ Method::Gmres { .. } if self.gmres_if_bright => {
                Solver { method, ..self.solver }
            }
            _ => self.solver,
        }
    }
}

impl SolveSettings {
    /// Where the light of `scene` is.
    pub(crate) fn lit_region(&self, scene: &Scene) -> LitRegion {
        LitRegion::new(self.region, || scene.reflecting_bounds())
    }

    /// How large elements may be: `size` where the light is. What is black neither receives nor, if
    /// it does not emit or is gathered, shoots.
    pub(super) fn sizing(&self, scene: &Scene, size: f64) -> ElementSizing {
        let is_idle = |(m, material): &(u32, &Material)| {
            let shoots = material.exitance != Rgb::ZERO && !self.gathered_materials.contains(m);
            !material.scatters() && !shoots
        };
        let idle = (0..).zip(scene.materials()).filter(is_idle);
        let unsplit_materials = idle.map(|(m, _)| m).collect();
        ElementSizing { size, region: self.region, unsplit_materials }
    }
}

impl BakeSettings {
    /// Whether a bake would take these settings of gathering: worth asking before a long solve.
    /// What comes before that is checked where it is used.
    pub(super) fn check(&self) -> Result<(), Error> {
        self.measure.check()?;
        self.gather.as_ref().map_or(Ok(()), |gather| gather.refinement.check())
    }

    /// Settings for previews: elements of a 32nd of the scene's diagonal, larger where there would
    /// be more than 65 536, 1e-4 unshot, and no vertex gathers.
    pub fn elements_only(scene: &Scene) -> BakeSettings {
        let survey = LightSurvey::new(scene);
        let mut settings = BakeSettings::by_survey(0.02, &survey, scene);
        let size = settings.solve.element_size.max(survey.diagonal / 32.0);
        let sizing = settings.solve.sizing(scene, size);
        let most = model::MAX_PREVIEW_ELEMENTS;
        let sizing = sizing.within(scene, model::MAX_SHOOTING_DEPTH, most);
        settings.solve.element_size = sizing.size;
        settings.solve.hemicube_resolution = 128;
        settings.solve.solver = Solver { unshot: 1e-4, ..Solver::default() };
        settings.gather = None;
        settings
    }

    /// Settings for vertices that gather where no error is asked for: those of an error of 0.8 %,
    /// with elements half as large where light bends most, so that contact shadows are sharp, and
    /// 1500 rays.
    pub fn gathering(scene: &Scene) -> BakeSettings {
        let mut settings = BakeSettings::for_error(0.008, scene);
        if let Some(gather) = &mut settings.gather {
            gather.refinement.min_edge /= 2.0;
            gather.rays = 1500;
        }
        settings
    }

    /// Initial settings for vertices of `scene` to have the error `error`
    /// ([`ErrorEstimate`](crate::bake::ErrorEstimate), a share, clamped to 1e-4 to 0.3), by power
    /// laws that were chosen so that most bakes need few rounds of refinement.
    ///
    /// The light is surveyed at 512 points first, with rays on the CPU: lengths are shares of the
    /// diagonal of the region that has the light, and lights that mostly miss are gathered.
    pub fn for_error(error: f64, scene: &Scene) -> BakeSettings {
        BakeSettings::by_survey(error, &LightSurvey::new(scene), scene)
    }

    /// Lengths on each group as shares of its own diagonal, where that is smaller than that of
    /// where the light is: for an `error` that every group is to meet.
    pub(super) fn scale_groups(&mut self, error: f64, scene: &Scene) {
        let diagonal = self.solve.lit_region(scene).diagonal;
        let mut bounds = vec![Aabb::EMPTY; scene.groups().len()];
        for (t, triangle) in scene.triangles().iter().enumerate() {
            let bounds = &mut bounds[triangle.group as usize];
            scene.corners(t).into_iter().for_each(|corner| bounds.include(corner));
        }
        let scale = |bounds: Aabb| {
            let share = bounds.diagonal() / diagonal;
            if share > 0.0 && share < 1.0 && bounds.low.x <= bounds.high.x { share } else { 1.0 }
        };
        if let Some(gather) = &mut self.gather {
            gather.refinement.group_scales = bounds.into_iter().map(scale).collect();
            // Groups have to meet the error with a standard error added.
            gather.refinement.mesh_error = gather.refinement.mesh_error.min(0.5 * error);
        }
    }

    fn by_survey(error: f64, survey: &LightSurvey, scene: &Scene) -> BakeSettings {
        let e = error.clamp(1e-4, 0.3);
        let diagonal = survey.diagonal;
        let solver = Solver {
            // A small part of the error, since shooting is not repeated.
            unshot: e / 40.0,
            patch_tolerance: e.min(0.02 + 0.4 * e),
            ..Solver::default()
        };
        let mut solve = SolveSettings {
            // Error ∝ edge^2.5, and edge = 0.6 of the diagonal times the error where that is more.
            element_size: diagonal * (0.105 * libm::pow(e, 0.4)).max(0.6 * e),
            region: survey.region,
            gathered_materials: survey.gathered_materials.clone(),
            hemicube_resolution: model::hemicube_resolution(e),
            full_resolution_share: None,
            near_reach: 1.0,
            solver,
            gmres_if_bright: true,
            ambient: false,
        };
        // As many elements as may gather: where the light is small and triangles are long, there
        // would be millions.
        let most = RefinementSettings::DEFAULT_MAX_ELEMENTS;
        let sizing = solve.sizing(scene, solve.element_size);
        let sizing = sizing.within(scene, model::MAX_SHOOTING_DEPTH, most);
        solve.element_size = sizing.size;
        let refinement = RefinementSettings {
            // By docs/data/mesh_error.tsv: at 10 % thirteen scenes meet the error at their first
            // estimate with 0.08 too, and take 0.7 of the time that 0.05 does; at 5 and 2 % two of
            // four need further rounds with 0.8 times the error, and none with 0.6 and 0.5 times.
            mesh_error: 1.25 * libm::pow(e, 1.25),
            interpolation_tolerance: 0.5 * e,
            // A first gather of all vertices sees what was shot on elements.
            gather_passes: if e > 0.03 { 1 } else { 2 },
            region: survey.region,
            max_elements: model::max_elements(scene.triangles().len()),
            ..RefinementSettings::new(0.1 * diagonal * libm::pow(e, 0.85))
        };
        let gather = GatherSettings {
            // Follows the error slowly: elements are split where light is not linear.
            element_size: 0.3 * diagonal * libm::pow(e, 0.3),
            // With 0 to 3 the Cornell box and two rooms are as exact, at 10, 5, 2 and 1 %.
            contact_levels: 1,
            // Until the pilot chooses.
            rays: (20.0 / e).ceil() as u32,
            noise_tolerance: e,
            refinement,
        };
        BakeSettings { solve, gather: Some(gather), measure: Measure::default() }
    }
}
