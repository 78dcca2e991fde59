//! What the blocks of each stage are called: a name holds a hash of exactly what decides them.
//!
//! So blocks outlive the bake that made them. A bake with other parameters takes those of its own names and makes the others: other suns leave
//! what rays met between surfaces, another sky model leaves all that is not sky, a name or a room leaves every vertex.

use crate::grid::GridPlan;
use crate::key::{Digest, TOOL};
use crate::plan::Plan;
use crate::scene::Scene;
use glam::Vec3;
use heliodon_light::{LightParams, MAX_FOLLOWED};

/// Hashes of what is in a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneDigests {
    /// All that rays and points depend on.
    pub geometry: [u8; 32],
    /// What the surfaces reflect.
    pub albedo: [u8; 32],
}

impl SceneDigests {
    /// Those of a scene whose original is still there ([`Scene::take_rays`] gives it up).
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mesh = &scene.mesh;
        let mut geometry = Digest::default();
        geometry.run(bytemuck::cast_slice(&mesh.positions));
        geometry.run(bytemuck::cast_slice(&mesh.normals));
        geometry.run(bytemuck::cast_slice(&mesh.triangles));
        if let Some(original) = &scene.original {
            geometry.run(bytemuck::cast_slice(&original.positions));
            geometry.run(bytemuck::cast_slice(&original.triangles));
            geometry.run(bytemuck::cast_slice(&original.stands_for));
            geometry.run(bytemuck::cast_slice(&original.clearance_m));
            let drawn: Vec<u64> =
                scene.parts.iter().flat_map(|part| [part.triangles.start, part.drawn].map(|n| n as u64)).collect();
            geometry.run(bytemuck::cast_slice(&drawn));
        }
        let mut albedo = Digest::default();
        albedo.run(bytemuck::cast_slice(&mesh.uvs));
        albedo.run(bytemuck::cast_slice(&mesh.colors_linear));
        albedo.run(bytemuck::cast_slice(&mesh.triangle_material));
        for material in &mesh.materials {
            albedo.run(bytemuck::bytes_of(&material.base_color_linear));
            if let Some(texture) = &material.texture {
                albedo.run(&[texture.image.width.to_le_bytes(), texture.image.height.to_le_bytes()].concat());
                albedo.run(bytemuck::cast_slice(&texture.image.pixels));
                albedo.run(format!("{:?}", texture.wrap).as_bytes());
            }
        }
        Self { geometry: geometry.bytes(), albedo: albedo.bytes() }
    }
}

/// Names of the sky's blocks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkyNames {
    /// Maps.
    pub map: String,
    /// The lapse.
    pub lapse: String,
    /// What was taken from each sky.
    pub record: String,
}

impl SkyNames {
    /// Those of a plan's sky; `hides` where the site has ground that hides what the sky shows below the horizon: maps do not ask.
    #[must_use]
    pub fn new(plan: &Plan, hides: bool) -> Self {
        let (site, bake) = (&plan.site, &plan.site.bake);
        let info = &site.site;
        let mut digest = Digest::default();
        digest.run(TOOL.as_bytes());
        digest.json(&site.sky);
        digest.json(&(info.latitude_deg, info.longitude_deg, info.utc_offset, info.north_deg));
        digest.json(&(bake.sun_steps, bake.effective_sky_steps(), bake.first, bake.last, bake.order));
        digest.json(&plan.probes());
        let digits = digest.digits();
        let around = if hides { "ground" } else { "open" };
        let name = |what: &str| format!("{what}-{digits}");
        Self { map: name("sky-map"), lapse: name(&format!("fitted-lapse-{around}")), record: name(&format!("sky-{around}")) }
    }

    /// All of them.
    #[must_use]
    pub fn all(&self) -> Vec<String> {
        vec![self.map.clone(), self.lapse.clone(), self.record.clone()]
    }
}

/// Names of what is gathered at some points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointNames {
    /// Which suns reach them.
    pub masks: String,
    /// What they see.
    pub gather: String,
    /// What their rays met; good for any suns and any albedo.
    pub traces: String,
    /// Their light.
    pub light: String,
    /// Where they are.
    pub places: String,
}

/// Names of the blocks of light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightNames {
    /// How much of the points' views each triangle fills.
    pub sight: String,
    /// Which suns reach the patches of the surfaces.
    pub patches: String,
    /// Curves over the day that decide how it is told,
    pub curves: String,
    /// and what the rays to them met.
    pub curve_traces: String,
    /// The surfaces' points.
    pub fronts: PointNames,
    /// The light grid's.
    pub space: PointNames,
    /// Light in texels, where there is any,
    pub texels: Option<TexelNames>,
    /// that of a panorama,
    pub panorama: Option<TexelNames>,
    /// and that of the scan itself.
    pub scan: Option<TexelNames>,
    /// Light between two bounces.
    pub bounces: String,
    /// What followed paths depend on besides the traces' own name.
    pub paths: u64,
    /// What bakes among other geometry need to know of this one.
    pub record: String,
    /// How the surfaces are divided into patches.
    pub plan: String,
    /// The suns, and the directions that rays go in: what blocks have in common that serve bakes among other geometry.
    pub day: String,
    /// See [`LightNames::day`].
    pub sampling: String,
}

/// Names of the blocks of light in texels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TexelNames {
    /// Which suns reach them.
    pub masks: String,
    /// What they see of the sky.
    pub sky: String,
    /// What reaches them of the bounced sun.
    pub bounce: String,
    /// All of it.
    pub light: String,
}

/// What the blocks of a bake's record are called, before their digits.
pub const RECORD: &str = "record";

impl LightNames {
    /// Those of a scene's light under some suns; the last are hashes of an atlas, of a panorama and of a scan.
    #[must_use]
    pub fn new(
        scene: &SceneDigests,
        params: &LightParams,
        (suns, sun_bounce): (&[Vec3], bool),
        grid: &GridPlan,
        [atlas, panorama, scan]: [Option<[u8; 32]>; 3],
    ) -> Self {
        let LightParams {
            samples,
            further_lattices,
            bounces,
            coefficients,
            channels,
            offset_m,
            cell_size_m,
            max_sub_cells,
            // light is the same whatever is kept
            hit_budget_bytes: _,
            back_side_rounds,
            sun_functions,
            sun_error,
            seed,
        } = params;
        let of = |what: &str, parts: &[[u8; 32]]| {
            let mut digest = Digest::default();
            digest.run(TOOL.as_bytes());
            digest.run(what.as_bytes());
            parts.iter().for_each(|part| digest.run(part));
            digest
        };
        let told = |what: String| of("told", &[Digest::of(what.as_bytes())]).bytes();
        // the points: without bounces no triangle is divided
        let division = told(format!("{offset_m:?} {cell_size_m:?} {max_sub_cells} {seed} {}", *bounces > 0));
        let layout = of("layout", &[scene.geometry, division]);
        let layout_bytes = layout.bytes();
        let day = Digest::of(bytemuck::cast_slice(suns));
        let rays = told(format!("{samples} {further_lattices} {back_side_rounds}"));
        let traces = of("traces", &[layout_bytes, rays]);
        let patches = of("patches", &[layout_bytes, rays, day]);
        // paths are followed no more often than light bounces
        let paths = of("paths", &[scene.albedo, told(format!("{}", MAX_FOLLOWED.min(*bounces as usize)))]);
        let seen = told(format!("{coefficients} {channels:?} {sun_functions} {sun_error:?} {sun_bounce}"));
        let suns_of_gather = if sun_bounce { day } else { [0; 32] };
        let gather = of("gather", &[traces.bytes(), paths.bytes(), seen, suns_of_gather]);
        let light = of("light", &[gather.bytes(), day, told(format!("{bounces}"))]);
        // where the sun does not bounce, no sun has a part in it
        let of_sky = of("light of the sky", &[gather.bytes(), told(format!("{bounces}"))]);
        let points = |begin: &str, more: &dyn Fn(&Digest) -> Digest| {
            let name = |what: &str, digest: &Digest| format!("{begin}{what}-{}", more(digest).digits());
            PointNames {
                masks: name("masks", &of("masks", &[layout_bytes, day])),
                gather: name("gather", &gather),
                traces: name("traces", &traces),
                light: name("light", &light),
                places: name("places", &layout),
            }
        };
        let on_texels = |begin: &str, atlas: [u8; 32]| {
            let name = |what: &str, parts: &[[u8; 32]]| format!("{begin}-{what}-{}", of(what, parts).digits());
            TexelNames {
                masks: name("masks", &[atlas, layout_bytes, day]),
                sky: name("sky", &[atlas, of_sky.bytes()]),
                bounce: name("bounce", &[atlas, light.bytes()]),
                light: name("light", &[atlas, light.bytes()]),
            }
        };
        let in_space = Digest::of(grid.digits().as_bytes());
        Self {
            sight: format!("sight-{}", layout.digits()),
            patches: format!("patches-{}", patches.digits()),
            curves: format!("curves-{}", of("curves", &[gather.bytes()]).digits()),
            curve_traces: format!("curve-traces-{}", traces.digits()),
            fronts: points("", &Digest::clone),
            space: points("grid-", &|digest| of("space", &[digest.bytes(), in_space])),
            record: format!("{RECORD}-{}", of("record", &[light.bytes(), in_space]).digits()),
            plan: format!("plan-{}", patches.digits()),
            bounces: format!("bounces-{}", of("bounces", &[light.bytes(), in_space]).digits()),
            day: of("day", &[day]).digits(),
            sampling: of("sampling", &[rays, told(format!("{seed}"))]).digits(),
            texels: atlas.map(|atlas| on_texels("texel", atlas)),
            panorama: panorama.map(|panorama| on_texels("panorama", panorama)),
            scan: scan.map(|scan| on_texels("scan", scan)),
            paths: u64::from_le_bytes(paths.bytes()[..8].try_into().unwrap_or_default()),
        }
    }

    /// All of them that serve bakes to come.
    #[must_use]
    pub fn all(&self) -> Vec<String> {
        let of_points = |names: &PointNames| {
            let PointNames { masks, gather, traces, light, places } = names.clone();
            [masks, gather, traces, light, places]
        };
        let Self { sight, patches, curves, curve_traces, record, plan, texels, panorama, scan, .. } = self.clone();
        let mut all = vec![sight, patches, curves, curve_traces, record, plan];
        let of_texels = |TexelNames { masks, sky, bounce, light }| [masks, sky, bounce, light];
        all.extend(texels.into_iter().chain(panorama).chain(scan).flat_map(of_texels));
        all.extend([&self.fronts, &self.space].into_iter().flat_map(of_points));
        all
    }
}
