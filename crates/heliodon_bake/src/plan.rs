//! What a bake will do: everything resolved before anything long begins.

use crate::CACHE_FOLDER;
use crate::actors::{Figure, read_figures};
use crate::error::BakeError;
use crate::estimate::expected_light_need;
use crate::grid::GridPlan;
use crate::ground::{as_given, on_the_ground};
use crate::inputs::Inputs;
use crate::key::{Digest, TOOL, bake_key, told_name};
use crate::light::channels;
use crate::names::SceneDigests;
use crate::prepare::{PrepareEstimate, prepare_where};
use crate::report::Reporter;
use crate::scene::{self, Scene};
use glam::Vec3;
use heliodon_bundle::site::{Actor, InputFile, InputKind, Site};
use heliodon_bundle::{BundleMeta, BundleReader, BundleWriter, LightLayout, StoredFile};
use heliodon_light::{LightParams, default_offset_m};
use heliodon_rays::TriangleScene;
use std::path::{Path, PathBuf};

/// Where a bake writes, and what it may skip.
#[derive(Clone, Debug)]
pub struct BakeOptions {
    /// The bundle's folder.
    pub bundle: PathBuf,
    /// Where finished work is kept; default: `.heliodon/cache` beside the bundle.
    pub cache: Option<PathBuf>,
    /// Take nothing from finished bakes, and keep nothing for those to come.
    pub no_cache: bool,
    /// Bake even where the bundle is up to date.
    pub again: bool,
}

impl BakeOptions {
    /// A bake into `bundle`, everything else as it comes.
    #[must_use]
    pub fn new(bundle: impl Into<PathBuf>) -> Self {
        Self { bundle: bundle.into(), cache: None, no_cache: false, again: false }
    }
}

/// Cells that large triangles may be divided into, each as dear as a vertex: at most one for so many vertices. Without a limit
/// a temple of 300,000 triangles, fine near the eye and coarse far off, had 416,000 cells beside 235,000 vertices.
const VERTICES_PER_SUB_CELL: usize = 4;
/// But always so many, for rooms of a dozen triangles.
const LEAST_SUB_CELLS: usize = 50_000;

/// A bake whose inputs are found, hashed and checked.
#[derive(Debug)]
pub struct Plan {
    /// The site.
    pub site: Site,
    /// The files that it names.
    pub files: Vec<InputFile>,
    /// Their hashes, after that of `site.toml`.
    pub inputs: Vec<StoredFile>,
    /// What there is to know of each actor's model.
    pub figures: Vec<Figure>,
    /// Where it writes, and what it may skip.
    pub options: BakeOptions,
    /// What was hashed, to be looked at again once it was read.
    hashed: Inputs,
}

impl Plan {
    /// Finds and hashes everything that a site names, and looks whether the bundle can stand where it should.
    ///
    /// # Errors
    /// What is missing, cannot be read, cannot be written to, or is asked for and not done yet.
    pub fn new(site: Site, options: BakeOptions) -> Result<Self, BakeError> {
        let files = site.input_files()?;
        // hashed before anything is read: what changes between the two is found
        let hashed = Inputs::hash(&site, &files)?;
        let figures = read_figures(&site, &files)?;
        let plan = Self { site, files, inputs: hashed.stored(), figures, options, hashed };
        // a grid that is too large is told now, not after hours
        plan.grid(None)?;
        Ok(plan)
    }

    /// Whether the bundle that is there was made by the same code from the same files, and is whole.
    #[must_use]
    pub fn is_up_to_date(&self) -> bool {
        let Ok(bundle) = BundleReader::open(&self.options.bundle) else { return false };
        let manifest = bundle.manifest();
        manifest.tool == TOOL && manifest.inputs == self.inputs && bundle.verify().is_ok()
    }

    /// Looks whether the bundle can be written where it should stand, before hours are spent on it.
    ///
    /// # Errors
    /// What stands in the way.
    pub fn check_target(&self) -> Result<(), BakeError> {
        // a writer that is dropped leaves everything as it was
        drop(BundleWriter::create(&self.options.bundle, self.meta(self.layout(1, 0), 0.0))?);
        Ok(())
    }

    /// Reads the geometry, and prepares it where the site wants that.
    ///
    /// # Errors
    /// As [`scene::read`] and [`crate::prepare::prepare`].
    pub fn read_scene(&self, reporter: &dyn Reporter) -> Result<Scene, BakeError> {
        match &self.site.prepare {
            None => {
                let scene = scene::read(&self.site, &self.files, reporter)?;
                self.check_unchanged(|kind| kind.mesh_part().is_some())?;
                Ok(scene)
            }
            Some(settings) => {
                let (budget, threads) = (self.site.budget.bake_bytes(), rayon::current_num_threads());
                // what cannot be lit need not be prepared
                let light = |expected: &PrepareEstimate| {
                    expected_light_need(self, expected).within("the light", budget, threads).map(|_| ())
                };
                Ok(prepare_where(self, settings, None, reporter, light)?.scene)
            }
        }
    }

    /// Looks whether files that were read since the plan was made are still what was hashed for it.
    ///
    /// # Errors
    /// [`BakeError::Changed`], and a file that cannot be read any more.
    pub(crate) fn check_unchanged(&self, wanted: impl Fn(InputKind) -> bool) -> Result<(), BakeError> {
        self.hashed.check_unchanged(wanted)
    }

    /// What manifests call one of the files.
    pub(crate) fn told_name(&self, file: &InputFile) -> String {
        told_name(self.site.folder(), &file.path)
    }

    /// The hash under which this bake's finished work is kept.
    #[must_use]
    pub fn key(&self, scene: &SceneDigests) -> String {
        bake_key(&self.site, scene, &self.probes())
    }

    /// The probes' hashes.
    pub(crate) fn probes(&self) -> Vec<&StoredFile> {
        let probes = self.files.iter().filter(|file| file.kind == InputKind::Probe);
        let names: Vec<String> = probes.map(|file| self.told_name(file)).collect();
        self.inputs.iter().filter(|input| names.contains(&input.path)).collect()
    }

    /// The folder that holds the finished work of all bakes into this bundle.
    #[must_use]
    pub fn cache_root(&self) -> PathBuf {
        self.options.cache.clone().unwrap_or_else(|| {
            let parent = self.options.bundle.parent().filter(|parent| !parent.as_os_str().is_empty());
            parent.unwrap_or(Path::new(".")).join(CACHE_FOLDER).join("cache")
        })
    }

    /// Whose work it is in a cache that several bundles share: the bundle's place, however it was typed.
    #[must_use]
    pub fn owner(&self) -> PathBuf {
        let absolute = std::path::absolute(&self.options.bundle).unwrap_or_else(|_| self.options.bundle.clone());
        match (absolute.parent().and_then(|parent| parent.canonicalize().ok()), absolute.file_name()) {
            (Some(parent), Some(name)) => parent.join(name),
            _ => absolute,
        }
    }

    /// What tells the jobs of a bake with this key from those of the same site into another bundle, or with another cache.
    #[must_use]
    pub fn mark(&self, key: &str) -> String {
        let root = self.cache_root();
        let root = std::path::absolute(&root).unwrap_or(root);
        let mut digest = Digest::default();
        digest.run(key.as_bytes());
        [self.owner(), root].iter().for_each(|path| digest.run(path.as_os_str().as_encoded_bytes()));
        digest.digits()
    }

    /// How light is solved for some geometry.
    #[must_use]
    pub fn light_params(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> LightParams {
        let bake = &self.site.bake;
        let offset_m = bake.offset_m.map_or_else(|| default_offset_m(positions, triangles), |offset| offset as f32);
        LightParams {
            samples: bake.samples,
            bounces: bake.bounces,
            coefficients: bake.coefficients() as usize,
            channels: channels(bake.transfer),
            offset_m,
            max_sub_cells: (positions.len() / VERTICES_PER_SUB_CELL).max(LEAST_SUB_CELLS),
            // the solver's seed turns its directions: both halves of the site's count
            seed: (bake.seed ^ (bake.seed >> 32)) as u32,
            ..LightParams::default()
        }
    }

    /// The actors in the bundle's space; with `rays` those that follow the ground are on it.
    #[must_use]
    pub fn actors(&self, rays: Option<&TriangleScene>) -> Vec<Actor> {
        rays.map_or_else(|| as_given(&self.site), |rays| on_the_ground(&self.site, &self.figures, rays))
    }

    /// The points of the light grid; `rays` finds the ground beneath rooms and actors.
    ///
    /// # Errors
    /// As [`GridPlan::new`].
    pub fn grid(&self, rays: Option<&TriangleScene>) -> Result<GridPlan, BakeError> {
        GridPlan::new(&self.site, &self.actors(rays), self.layout(self.site.bake.sun_steps, 0), rays)
    }

    /// Shape of the stored light with so many sun steps and `functions` functions of bounced sunlight.
    #[must_use]
    pub fn layout(&self, sun_steps: u32, functions: u32) -> LightLayout {
        let bake = &self.site.bake;
        LightLayout { sun_steps, coefficients: bake.coefficients(), channels: bake.channels(), sun_bounce_functions: functions }
    }

    /// What the bundle's manifest will say.
    #[must_use]
    pub fn meta(&self, layout: LightLayout, offset_m: f32) -> BundleMeta {
        let offset_m = self.site.bake.offset_m.unwrap_or(f64::from(offset_m));
        BundleMeta { tool: TOOL.to_owned(), inputs: self.inputs.clone(), ..BundleMeta::from_site(&self.site, layout, offset_m) }
    }
}
