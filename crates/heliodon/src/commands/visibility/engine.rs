//! Who answers: rays on the processor, or a GPU.

use super::found::Found;
use super::scene::Scene;
use super::{Args, Backend, Phases};
use crate::App;
use anyhow::Result;
use glam::Vec3;
use heliodon_bake::report::Reporter;
use heliodon_math::frame::unit_or;
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::{PointLight, VisibilityBackend, VisibilityMatrix};
use heliodon_rays::VisibilityCpu;

/// What is asked.
pub struct Question<'a> {
    pub scene: &'a Scene,
    pub sphere: &'a LightSphere,
    /// Of each direction, where an environment shines.
    pub radiance: Option<Vec<Vec3>>,
    pub bent: bool,
    pub matrix: bool,
}

/// Who answered.
pub struct Engine {
    pub backend: Backend,
    /// `rays` or `maps`.
    pub method: &'static str,
    pub device: String,
    pub offset_m: Option<f32>,
}

/// What a GPU is started for: fewer rays are answered by the processor before it is ready.
#[cfg(feature = "gpu")]
const GPU_RAYS: u64 = 20_000_000;

/// Asks the backend that was chosen.
///
/// # Errors
/// No GPU where one was asked for, or a backend that fails.
pub fn answer(app: &App, args: &Args, question: &Question<'_>, phases: &mut Phases) -> Result<(Found, Engine)> {
    let Scene { mesh, normals, .. } = question.scene;
    #[cfg(feature = "gpu")]
    if let Some((mut backend, device)) = gpu(args, mesh.positions.len() as u64 * question.sphere.directions().len() as u64 / 2)?
    {
        phases.time("hierarchy", || backend.set_mesh(&mesh.positions, normals, &mesh.triangles))?;
        let found = ask(Some(app), &mut backend, question, phases)?;
        return Ok((found, Engine::gpu(&backend, device)));
    }
    let mut backend = VisibilityCpu::new(args.offset);
    phases.time("hierarchy", || backend.set_mesh(&mesh.positions, normals, &mesh.triangles))?;
    let found = ask(Some(app), &mut backend, question, phases)?;
    Ok((found, Engine::rays(&backend)))
}

impl Engine {
    /// Rays have answered.
    pub fn rays(backend: &VisibilityCpu) -> Self {
        let device = crate::output::counted(rayon::current_num_threads() as u64, "thread", "threads");
        Self { backend: Backend::Cpu, method: "rays", device, offset_m: Some(backend.offset_m()) }
    }

    /// A GPU of this name has answered.
    #[cfg(feature = "gpu")]
    pub fn gpu(backend: &heliodon_gpu::VisibilityGpu, device: String) -> Self {
        let rays = backend.answered() == Some(heliodon_gpu::Answered::Rays);
        let method = if rays { "rays" } else { "maps" };
        Self { backend: Backend::Gpu, method, device, offset_m: backend.offset_m() }
    }
}

/// The GPU, if it is to answer about so many rays.
#[cfg(feature = "gpu")]
pub fn gpu(args: &Args, rays: u64) -> Result<Option<(heliodon_gpu::VisibilityGpu, String)>> {
    use super::GpuMethod;
    use heliodon_gpu::{DepthMaps, Method, Rays, VisibilityGpu, headless, wgpu};

    let auto = args.backend == Backend::Auto;
    if args.backend == Backend::Cpu || auto && rays < GPU_RAYS {
        return Ok(None);
    }
    let gpu = match headless() {
        Err(_) if auto => return Ok(None),
        other => other?,
    };
    let info = gpu.adapter.get_info();
    // A processor that plays a GPU is slower than its rays.
    if auto && info.device_type == wgpu::DeviceType::Cpu {
        return Ok(None);
    }
    let method = match (args.gpu_method, args.offset) {
        (Some(GpuMethod::Maps), _) => DepthMaps::default().into(),
        (Some(GpuMethod::Rays), offset_m) | (_, offset_m @ Some(_)) => Rays { offset_m }.into(),
        _ => Method::Auto,
    };
    Ok(Some((VisibilityGpu::new(&gpu.device, &gpu.queue, &gpu.fault, method), info.name)))
}

/// Asks a backend that has the mesh; `app` is told how far it is.
///
/// # Errors
/// A backend that fails.
pub fn ask<B: VisibilityBackend>(
    app: Option<&App>,
    backend: &mut B,
    question: &Question<'_>,
    phases: &mut Phases,
) -> Result<Found> {
    let Question { scene, sphere, .. } = question;
    let (directions, weights) = (sphere.directions(), sphere.weights());
    let dark = vec![Vec3::ZERO; directions.len()];
    let radiance = question.radiance.as_ref().unwrap_or(&dark);
    let mut light: Option<PointLight> = None;
    let mut bent: Option<PointLight> = None;
    let mut matrix: Option<VisibilityMatrix> = None;
    let sum = |sum: &mut Option<PointLight>, more: PointLight| match sum {
        Some(sum) => sum.add(&more),
        None => *sum = Some(more),
    };
    app.inspect(|app| app.progress.stage("visibility", directions.len() as u64));
    let at_once = backend.most_directions(scene.mesh.positions.len()).min(directions.len());
    for first in (0..directions.len()).step_by(at_once) {
        let run = first..(first + at_once).min(directions.len());
        let (l, w) = (&directions[run.clone()], &weights[run.clone()]);
        phases.time("visibility", || backend.compute(l).and_then(|()| backend.wait()))?;
        sum(&mut light, phases.time("light", || backend.light(w, &radiance[run.clone()]))?);
        if question.bent {
            sum(&mut bent, phases.time("light", || backend.light(w, l))?);
        }
        if question.matrix {
            let columns = backend.matrix()?;
            match &mut matrix {
                Some(matrix) => matrix.append(&columns)?,
                None => matrix = Some(columns),
            }
        }
        app.inspect(|app| app.progress.progress(run.end as u64));
    }
    app.inspect(|app| app.progress.finished());
    let bent = bent.unwrap_or_default().light.iter().zip(&scene.mesh.normals).map(|(&bent, &n)| unit_or(bent, n)).collect();
    Ok(Found { light: light.unwrap_or_default(), bent, matrix })
}
