//! What preparation found and did, in all.

use super::{PartReport, Step};
use crate::scene::Scene;
use heliodon_bundle::lineage::{MeasuredError, Prepared, PreparedPart, PurgeCheck};
use heliodon_bundle::memory::peak_resident_bytes;
use heliodon_prepare::clean::{CleanReport, Finding};
use heliodon_prepare::purge::{PurgeReport, Verified};
use heliodon_prepare::simplify::MeasureReport;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// What preparation found and did.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct PrepareReport {
    /// Part by part.
    pub parts: Vec<PartReport>,
    /// What the purge did; none where there are no rooms, or none is asked for.
    pub purge: Option<PurgeReport>,
    /// Triangles in the files.
    pub triangles_read: u64,
    /// Triangles that rays of light meet.
    pub triangles_original: u64,
    /// Triangles that are drawn.
    pub triangles_drawn: u64,
    /// Triangles that are not drawn and hold the light that they reflect.
    pub triangles_hidden: u64,
    /// Vertices at which light is solved.
    pub vertices: u64,
    /// What the steps over all parts took, in order.
    pub steps: Vec<Step>,
    /// The most memory that the process has needed so far, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

impl PrepareReport {
    /// Counts what has become of the parts.
    pub(super) fn count(&mut self, scene: &Scene) {
        for (part, range) in self.parts.iter_mut().zip(&scene.parts) {
            part.triangles_drawn = range.drawn as u64;
            part.triangles_hidden = (range.triangles.len() - range.drawn) as u64;
        }
        let sum = |of: fn(&PartReport) -> u64| self.parts.iter().map(of).sum();
        self.triangles_read = sum(|part| part.triangles_read);
        self.triangles_original = sum(|part| part.triangles_original);
        self.triangles_drawn = sum(|part| part.triangles_drawn);
        self.triangles_hidden = sum(|part| part.triangles_hidden);
        self.vertices = scene.mesh.positions.len() as u64;
        self.peak_memory_bytes = peak_resident_bytes();
    }
}

impl PrepareReport {
    /// What a bundle's manifest tells of it.
    #[must_use]
    pub fn lineage(&self) -> Prepared {
        let check = |purge: &PurgeReport| {
            let sum = |of: fn(&Verified) -> u64| purge.rooms.iter().map(|room| of(&room.verified)).sum();
            PurgeCheck { pixels: sum(|verified| verified.met), wrong: sum(|verified| verified.wrong) }
        };
        Prepared { parts: self.parts.iter().map(PartReport::lineage).collect(), purge: self.purge.as_ref().map(check) }
    }
}

impl PartReport {
    fn lineage(&self) -> PreparedPart {
        let cleaned = self.clean.as_ref().map_or(self.triangles_read, |clean| clean.triangles_after);
        let off = |error: &MeasureReport| {
            let off = &error.from_original;
            let [mean_px, p95_px, max_px, mean_m, max_m] =
                [off.mean_px, off.p95_px, off.max_px, off.mean_m, off.max_m].map(f64::from);
            MeasuredError { mean_px, p95_px, max_px, mean_m, max_m }
        };
        PreparedPart {
            vertices_read: self.vertices_read,
            triangles_read: self.triangles_read,
            triangles_cleaned: self.solids.as_ref().map_or(cleaned, |solids| solids.triangles_after),
            triangles_original: self.triangles_original,
            triangles_drawn: self.triangles_drawn,
            triangles_hidden: self.triangles_hidden,
            error_px: self.error_px,
            edge_px: self.edge_px,
            error_m: self.error_m,
            edge_m: self.edge_m,
            found: self.clean.as_ref().map_or_else(BTreeMap::new, found),
            error: self.error.as_ref().map(off),
        }
    }
}

/// What cleaning found, by the names of its report; nothing of what it did not find.
fn found(clean: &CleanReport) -> BTreeMap<String, u64> {
    let all = [
        ("mended_attributes", clean.mended_attributes),
        ("moved_vertices", clean.moved_vertices),
        ("non_finite_triangles", clean.non_finite.triangles),
        ("degenerate_triangles", clean.degenerate.triangles),
        ("flat_triangles", clean.flat.triangles),
        ("duplicate_triangles", clean.duplicate.triangles),
        ("double_wall_triangles", clean.double_walls.triangles),
        ("isolated_triangles", clean.isolated.triangles),
        ("isolated_bits", clean.isolated_bits),
        ("inconsistent_triangles", clean.inconsistent.triangles),
        ("inside_out_triangles", clean.inside_out.triangles),
        ("one_sided_triangles", clean.one_sided.triangles),
        ("flipped_triangles", clean.flipped),
        ("non_manifold_edges", clean.non_manifold.edges),
        ("open_edges", clean.open.edges),
        ("rims", clean.rims),
        ("t_junctions", clean.t_junctions.vertices),
        ("t_junctions_mended", clean.t_junctions_mended.vertices),
    ];
    all.into_iter().filter(|(_, count)| *count > 0).map(|(name, count)| (name.to_owned(), count)).collect()
}

impl fmt::Display for PrepareReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for part in &self.parts {
            writeln!(f, "{part}")?;
        }
        if let Some(purge) = &self.purge {
            writeln!(f, "{purge}")?;
        }
        let Self { triangles_read, triangles_original, triangles_drawn, triangles_hidden, vertices, .. } = self;
        writeln!(f, "{triangles_read} triangles read, {triangles_original} that rays of light meet")?;
        writeln!(
            f,
            "{triangles_drawn} triangles drawn, {triangles_hidden} that only reflect light, {vertices} vertices at which it is solved"
        )
    }
}

impl fmt::Display for PartReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, triangles_read, vertices_read, .. } = self;
        writeln!(f, "part {name}: {triangles_read} triangles over {vertices_read} vertices in its files")?;
        if let Some(clean) = &self.clean {
            writeln!(f, "  cleaned: {}", clean.to_string().replace('\n', "\n  "))?;
        }
        if let Some(solids) = self.solids.as_ref().filter(|solids| !solids.groups.is_empty() || solids.buried.triangles > 0) {
            writeln!(f, "  solids: {}", solids.to_string().replace('\n', "\n  "))?;
        }
        if let Some(split) = self.split.as_ref().filter(|split| split.split_triangles > 0) {
            writeln!(f, "  split: {split}")?;
        }
        if let Some(borders) = &self.borders {
            writeln!(f, "  borders: {borders}")?;
        }
        let lineage = self.lineage();
        if let (Some(simplify), Some(error)) = (&self.simplify, &lineage.error) {
            let (limits, [before, after]) = (lineage.limits(), [simplify.triangles_before, simplify.triangles_after]);
            writeln!(f, "  simplified to {limits}: {before} triangles, now {after}")?;
            writeln!(f, "  off the original by {error}")?;
        }
        if let Some([x, y, z]) = self.buried.first {
            let Finding { triangles, area_m2, .. } = self.buried;
            writeln!(
                f,
                "  buried in solids of all parts together: {triangles} triangles ({area_m2:.3} m2), not drawn, first at ({x:.3}, {y:.3}, {z:.3})"
            )?;
        }
        write!(f, "  drawn: {}, not seen: {} that only reflect light", self.triangles_drawn, self.triangles_hidden)
    }
}
