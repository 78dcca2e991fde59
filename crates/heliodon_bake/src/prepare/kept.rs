//! Prepared geometry, kept: whoever bakes the same files with the same settings again, or one shard of them, finds it done.

use super::arrays::{Reader, Writer};
use super::pieces::Piece;
use super::{PrepareReport, Prepared, Surfacing};
use crate::cache::CacheError;
use crate::key::{Digest, told_name};
use crate::plan::Plan;
use crate::referenced::referenced_files;
use crate::scene::{Original, PartRange, Scene};
use crate::texels::Choice;
use heliodon_bundle::StoredFile;
use heliodon_bundle::site::{InputKind, LightStorage, Part, Prepare, Role, Room, Site};
use std::collections::HashSet;

/// What the folders of prepared geometry are called, before their key.
pub(crate) const GEOMETRY: &str = "geometry-";

/// What the blocks of finished geometry are called; when they are all there, pieces are of no more use.
pub(super) const FINISHED: &str = "scene";

/// Hash of all that decides what preparation makes of a site: program, files of geometry, how they are placed, settings, rooms and display.
pub(super) fn geometry_key(plan: &Plan, settings: &Prepare) -> String {
    let site = &plan.site;
    let mut digest = Digest::default();
    digest.run(crate::TOOL.as_bytes());
    digest.json(&inputs_of(plan, |kind| kind.mesh_part().is_some()));
    let parts: Vec<(Part, Choice, bool)> = (0..site.parts.len()).map(|part| geometry_of(site, part)).collect();
    // however fine a panorama is, and for a scan too, what the original looks like is to be known
    let settings = Prepare { panorama: settings.shows_original().into(), scan: false, ..settings.clone() };
    digest.json(&(parts, site.site.origin, settings, &site.rooms, &site.display));
    format!("{GEOMETRY}{}", digest.folder_digits())
}

/// Hash of all that decides how one part is read, cleaned, split and first simplified: other parts do not matter to it, nor what is done with all of them
/// together, nor what rooms are called.
pub(super) fn part_digest(plan: &Plan, settings: &Prepare, part: usize) -> Digest {
    let site = &plan.site;
    let mut digest = Digest::default();
    digest.run(crate::TOOL.as_bytes());
    digest.json(&inputs_of(plan, |kind| kind.mesh_part() == Some(part)));
    digest.json(&(geometry_of(site, part), site.site.origin, of_part(settings, site.parts[part].role)));
    let rooms = site.rooms.iter().map(|room| Room { name: String::new(), looks_at: None, ..room.clone() });
    digest.json(&(rooms.collect::<Vec<_>>(), &site.display));
    digest
}

/// The settings without what no step of one part alone reads. What is not named here counts, as keys to come will until somebody knows that they need not.
fn of_part(settings: &Prepare, role: Role) -> Prepare {
    let Prepare { purge, ring, purge_effort, panorama, scan, triangles, .. } = Prepare::default();
    // it limits how finely ground is split
    let triangles = if role == Role::Ground { settings.triangles } else { triangles };
    Prepare { purge, ring, purge_effort, panorama, scan, triangles, ..settings.clone() }
}

/// A part without what moves none of its vertices; of where its light is stored only what decides whether it is split, of its details only whether the names of
/// materials count.
fn geometry_of(site: &Site, part: usize) -> (Part, Choice, bool) {
    let bare = Part {
        weathering: None,
        detail: Vec::new(),
        least_px: None,
        views: None,
        light: LightStorage::default(),
        texels: 1.0,
        ..site.parts[part].clone()
    };
    (bare, Choice::of(site, part), site.parts[part].has_material_details())
}

/// The files of the `wanted` kinds and those that they name, as they were hashed.
fn inputs_of(plan: &Plan, wanted: impl Fn(InputKind) -> bool) -> Vec<&StoredFile> {
    let files = plan.files.iter().filter(|file| wanted(file.kind));
    let names: HashSet<String> = files
        .flat_map(|file| {
            let others = referenced_files(&file.path).into_iter().map(|path| told_name(plan.site.folder(), &path));
            others.chain([plan.told_name(file)]).collect::<Vec<_>>()
        })
        .collect();
    plan.inputs.iter().filter(|input| names.contains(&input.path)).collect()
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
            into.array("looks-colors", &original.looks.colors)?;
            into.array("looks-normals", &original.looks.normals)?;
            into.array("looks-colored", &original.colored)?;
        }
        let ends = |part: &PartRange| {
            let PartRange { vertices, triangles, drawn, files, by_texels } = part;
            [vertices.start, vertices.end, triangles.start, triangles.end, *drawn, *files, usize::from(*by_texels)]
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
                looks: Surfacing { colors: from.array("looks-colors")?, normals: from.array("looks-normals")? },
                colored: from.array("looks-colored")?,
            })
        };
        let range = |[v0, v1, t0, t1, drawn, files, by_texels]: [usize; 7]| {
            let by_texels = by_texels == 1;
            PartRange { vertices: v0..v1, triangles: t0..t1, drawn, files, by_texels }
        };
        let parts = from.told::<Vec<_>>()?.into_iter().map(range).collect();
        let (warnings, report) = (from.told()?, from.told::<PrepareReport>()?);
        let prepared = Some(report.lineage());
        Some(Self { scene: Scene { mesh, parts, warnings, original, prepared }, report })
    }
}
