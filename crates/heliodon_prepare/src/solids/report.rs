//! What uniting solids found and did.

use super::groups::Group;
use super::union::Union;
use crate::clean::{Finding, Measure};
use crate::paint::paint_by;
use crate::topology::{Patches, Sense};
use glam::Vec3;
use heliodon_mesh::Mesh;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What became of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Fate {
    /// It is as it was.
    #[default]
    Kept,
    /// Cut: pieces of it are left.
    Cut,
    /// Gone: inside another solid, or a wall between two.
    Swallowed,
    /// Gone: of an open surface, and wholly inside solids.
    Buried,
    /// In a group of solids that was not united.
    Refused,
}

/// What became of a group of solids.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// They are one, or nothing of them met.
    United,
    /// They have too many triangles.
    TooLarge,
    /// It could not be done.
    Refused {
        /// Why.
        reason: String,
    },
}

/// A group of solids whose boxes meet.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct GroupReport {
    /// How many there were.
    pub solids: u64,
    /// Their triangles.
    pub triangles_before: u64,
    /// Triangles of what they became.
    pub triangles_after: u64,
    /// The sum of their volumes, in cubic metres.
    pub volume_before_m3: f64,
    /// The volume of their union, in cubic metres.
    pub volume_after_m3: f64,
    /// The first corner of the first of them, metres.
    pub first: [f32; 3],
    /// What became of them.
    pub outcome: Outcome,
}

/// What uniting solids found and did. Its `Display` is a few lines for people.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct SolidsReport {
    /// Triangles of the mesh as it came.
    pub triangles_before: u64,
    /// Triangles that are left.
    pub triangles_after: u64,
    /// Solids: closed patches that look outwards.
    pub solids: u64,
    /// Hollows within them.
    pub hollows: u64,
    /// Closed patches with an eye in what would be their material, left alone.
    pub rooms: u64,
    /// Closed patches that look inwards with no reason to, left alone: clean the mesh first.
    pub inside_out: u64,
    /// Patches that are not closed, not wound one way, or enclose nothing.
    pub not_solid: u64,
    /// Groups of solids that changed or could not be united.
    pub groups: Vec<GroupReport>,
    /// Triangles of open surfaces that were removed, for they lay in solids whole.
    pub buried: Finding,
    /// What became of each triangle of the mesh as it came, for [`paint`].
    #[serde(skip)]
    pub fates: Vec<Fate>,
}

impl SolidsReport {
    pub(super) fn count(&mut self, senses: &[Sense], patches: &Patches) {
        for (sense, _) in senses.iter().zip(&patches.list).filter(|(_, patch)| patch.triangles > 0) {
            *match sense {
                Sense::Body => &mut self.solids,
                Sense::Hollow => &mut self.hollows,
                Sense::Room => &mut self.rooms,
                Sense::InsideOut => &mut self.inside_out,
                Sense::Open | Sense::OneSided | Sense::Sheet => &mut self.not_solid,
            } += 1;
        }
    }

    pub(super) fn tell(&mut self, mesh: &Mesh, group: &Group, outcome: Outcome, union: Option<&Union>) {
        match union {
            Some(union) if !union.changed => return,
            Some(union) => self.follow(mesh, union),
            // a lone solid may run into itself or not: too large to know
            None if group.patches == 1 => return,
            None => group.triangles.iter().for_each(|&t| self.fates[t as usize] = Fate::Refused),
        }
        self.groups.push(GroupReport {
            solids: group.patches as u64,
            triangles_before: group.triangles.len() as u64,
            triangles_after: union.map_or(group.triangles.len(), |union| union.triangles.len()) as u64,
            volume_before_m3: group.volume_m3,
            volume_after_m3: union.map_or(group.volume_m3, |union| union.volume_m3),
            first: mesh.corners(group.triangles[0] as usize)[0].to_array(),
            outcome,
        });
    }

    fn follow(&mut self, mesh: &Mesh, union: &Union) {
        for &t in &union.replaced {
            self.fates[t as usize] = Fate::Swallowed;
        }
        for &(corners, from) in &union.triangles {
            let was = mesh.corners(from as usize);
            let whole = corners.iter().all(|&v| was.contains(&union.positions[v as usize]));
            self.fates[from as usize] = if whole { Fate::Kept } else { Fate::Cut };
        }
    }
}

/// Groups that the text for people tells of one by one.
const MOST_TOLD: usize = 5;

impl fmt::Display for SolidsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangles_before, triangles_after, solids, hollows, rooms, inside_out, not_solid, .. } = self;
        write!(f, "{solids} solids")?;
        for (count, what) in
            [(hollows, "hollows"), (rooms, "rooms"), (inside_out, "inside out"), (not_solid, "surfaces that are not solid")]
        {
            if *count > 0 {
                write!(f, ", {count} {what}")?;
            }
        }
        write!(f, "; {triangles_before} triangles, now {triangles_after}")?;
        for group in self.groups.iter().take(MOST_TOLD) {
            let GroupReport { solids, triangles_before, triangles_after, volume_before_m3, volume_after_m3, .. } = group;
            let [x, y, z] = group.first;
            match &group.outcome {
                Outcome::United => write!(
                    f,
                    "\n  {solids} solids united at ({x:.3}, {y:.3}, {z:.3}): {triangles_before} triangles, now {triangles_after}; \
                     {} m3, {} of it shared",
                    Measure(*volume_before_m3),
                    Measure((volume_before_m3 - volume_after_m3).max(0.0))
                )?,
                Outcome::TooLarge => {
                    write!(
                        f,
                        "\n  {solids} solids at ({x:.3}, {y:.3}, {z:.3}) with {triangles_before} triangles are too many to unite"
                    )?;
                }
                Outcome::Refused { reason } => {
                    write!(f, "\n  {solids} solids at ({x:.3}, {y:.3}, {z:.3}) were not united: {reason}")?;
                }
            }
        }
        if let Some(more) = self.groups.len().checked_sub(MOST_TOLD).filter(|more| *more > 0) {
            write!(f, "\n  and {more} more such groups, which the JSON report has all")?;
        }
        if let Some([x, y, z]) = self.buried.first {
            let Finding { triangles, area_m2, .. } = self.buried;
            let area = Measure(area_m2);
            write!(f, "\n  {triangles} triangles ({area} m2) buried in solids, removed, first at ({x:.3}, {y:.3}, {z:.3})")?;
        }
        Ok(())
    }
}

/// The colour of a fate, linear Rec. 709.
#[must_use]
pub fn color(fate: Fate) -> Vec3 {
    match fate {
        Fate::Kept => Vec3::splat(0.4),
        Fate::Cut => Vec3::new(0.0, 0.6, 0.1),
        Fate::Swallowed => Vec3::new(1.0, 0.0, 0.0),
        Fate::Buried => Vec3::new(1.0, 0.6, 0.0),
        Fate::Refused => Vec3::new(0.3, 0.0, 0.6),
    }
}

/// The mesh as it came, its triangles coloured by what became of them. A vertex is there once for each colour that its triangles have.
///
/// # Panics
/// If there are not as many fates as triangles.
#[must_use]
pub fn paint(original: &Mesh, fates: &[Fate]) -> Mesh {
    assert_eq!(fates.len(), original.triangles.len(), "one fate for each triangle");
    let all = [Fate::Kept, Fate::Cut, Fate::Swallowed, Fate::Buried, Fate::Refused];
    paint_by(original, &all.map(color), |t| Some(fates[t] as u8))
}
