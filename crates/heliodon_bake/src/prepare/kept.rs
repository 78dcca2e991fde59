//! Prepared geometry, kept: whoever bakes the same files with the same settings again, or one shard of them, finds it done.

use super::arrays::{Reader, Writer};
use super::pieces::Piece;
use super::{PrepareReport, Prepared};
use crate::cache::CacheError;
use crate::key::{Digest, told_name};
use crate::plan::Plan;
use crate::referenced::referenced_files;
use crate::scene::{Original, PartRange, Scene};
use heliodon_bundle::site::{InputKind, Part, Prepare, SITE_FILE_NAME};

/// What the folders of prepared geometry are called, before their key.
pub(crate) const GEOMETRY: &str = "geometry-";

/// What the blocks of finished geometry are called; when they are all there, pieces are of no more use.
pub(super) const FINISHED: &str = "scene";

/// Hash of all that decides what preparation makes of a site: program, files, how they are placed, settings, rooms and display.
pub(super) fn geometry_key(plan: &Plan, settings: &Prepare) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut run = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    let site = &plan.site;
    let probes: Vec<String> = plan.files.iter().filter(|f| f.kind == InputKind::Probe).map(|f| plan.told_name(f)).collect();
    let inputs: Vec<_> = plan.inputs.iter().filter(|i| i.path != SITE_FILE_NAME && !probes.contains(&i.path)).collect();
    run(crate::TOOL.as_bytes());
    for parameters in [
        serde_json::to_vec(&inputs),
        serde_json::to_vec(&site.parts),
        serde_json::to_vec(&site.site.origin),
        serde_json::to_vec(settings),
        serde_json::to_vec(&site.rooms),
        serde_json::to_vec(&site.display),
    ] {
        // plain structs of numbers and words always have a JSON form; without one the key is only less specific
        run(&parameters.unwrap_or_default());
    }
    format!("{GEOMETRY}{}", &hasher.finalize().to_hex()[..32])
}

/// Hash of all that decides how one part is read, cleaned, split and first simplified: other parts do not matter to it.
pub(super) fn part_digest(plan: &Plan, settings: &Prepare, part: usize) -> Digest {
    let site = &plan.site;
    let own = plan.files.iter().filter(|file| [InputKind::Geometry(part), InputKind::Albedo(part)].contains(&file.kind));
    let names: Vec<String> = own
        .flat_map(|file| {
            let others = referenced_files(&file.path).into_iter().map(|path| told_name(site.folder(), &path));
            others.chain([plan.told_name(file)]).collect::<Vec<_>>()
        })
        .collect();
    let inputs: Vec<_> = plan.inputs.iter().filter(|input| names.contains(&input.path)).collect();
    let mut digest = Digest::default();
    digest.run(crate::TOOL.as_bytes());
    digest.json(&inputs);
    // what the weather leaves on it moves nothing
    digest.json(&Part { weathering: None, ..site.parts[part].clone() });
    digest.json(&(site.site.origin, settings, &site.rooms, &site.display));
    digest
}

impl Piece for Prepared {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        let Scene { mesh, parts, warnings, original, prepared: _ } = &self.scene;
        into.mesh("mesh", mesh)?;
        into.number(u64::from(original.is_some()));
        if let Some(original) = original {
            into.array("original-positions", &original.positions)?;
            into.array("original-triangles", &original.triangles)?;
            into.array("stands-for", &original.stands_for)?;
            into.array("clearance", &original.clearance_m)?;
        }
        let ends = |part: &PartRange| {
            let PartRange { vertices, triangles, drawn, files } = part;
            [vertices.start, vertices.end, triangles.start, triangles.end, *drawn, *files]
        };
        into.told(&parts.iter().map(ends).collect::<Vec<_>>());
        into.told(warnings);
        into.told(&self.report);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        let mesh = from.mesh("mesh")?;
        let original = if from.number()? == 0 {
            None
        } else {
            Some(Original {
                positions: from.array("original-positions")?,
                triangles: from.array("original-triangles")?,
                stands_for: from.array("stands-for")?,
                clearance_m: from.array("clearance")?,
            })
        };
        let range =
            |[v0, v1, t0, t1, drawn, files]: [usize; 6]| PartRange { vertices: v0..v1, triangles: t0..t1, drawn, files };
        let parts = from.told::<Vec<_>>()?.into_iter().map(range).collect();
        let (warnings, report) = (from.told()?, from.told::<PrepareReport>()?);
        let prepared = Some(report.lineage());
        Some(Self { scene: Scene { mesh, parts, warnings, original, prepared }, report })
    }
}
