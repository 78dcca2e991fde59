//! A part on its way from its files to what rays meet, and from there to what stands for it: kept between the steps of that, and between the stages of
//! cleaning, where these take long.

use super::Work;
use super::arrays::{Reader, Writer};
use super::part::{PartReport, halfway_name};
use super::pieces::{Milestones, Piece};
use super::steps::Step;
use crate::cache::CacheError;
use heliodon_mesh::Mesh;
use heliodon_prepare::clean::{Cleaning, Mark};
use heliodon_prepare::simplify::MeasureReport;

/// A part that is not whole yet.
#[derive(Default)]
pub(super) struct Halfway {
    pub mesh: Mesh,
    /// What was left out or looked odd in its files.
    pub warnings: Vec<String>,
    pub report: PartReport,
    /// How far cleaning is.
    pub cleaning: Cleaning,
}

impl Halfway {
    /// Stages between which a part can be kept: those of cleaning, and uniting.
    const STAGES: u32 = Cleaning::STAGES + 1;

    /// Where its milestones are kept: under a number each, that of the stages that are done.
    pub fn milestones<'a>(work: &'a Work, index: usize) -> Milestones<'a> {
        work.pieces.milestones(halfway_name(index), Self::STAGES)
    }

    /// Keeps it, if that is worth while.
    pub fn reached(&self, milestones: &Milestones) {
        milestones.reached(self.cleaning.done + u32::from(self.report.solids.is_some()), self);
    }
}

impl Piece for Halfway {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.mesh("mesh", &self.mesh)?;
        into.array("places", &self.cleaning.places)?;
        into.array("marks", &self.cleaning.report.marks.iter().map(|&mark| mark as u8).collect::<Vec<_>>())?;
        into.number(u64::from(self.cleaning.done));
        into.told(&self.cleaning.report);
        into.told(&self.warnings);
        into.told(&self.report);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        let mesh = from.unclean_mesh("mesh")?;
        let places = from.array("places")?;
        let marks = from.array::<u8>("marks")?.into_iter().map(|mark| Mark::ALL.get(usize::from(mark)).copied());
        let marks = marks.collect::<Option<_>>()?;
        let done = u32::try_from(from.number()?).ok()?;
        let mut cleaning = Cleaning { done, places, report: from.told()? };
        cleaning.report.marks = marks;
        Some(Self { mesh, cleaning, warnings: from.told()?, report: from.told()? })
    }
}

/// What stands for a part's original, as far as that is known.
#[derive(Default)]
pub(super) struct HalfMapped {
    /// How far the result is off the original.
    pub error: MeasureReport,
    pub clearance_m: Vec<f32>,
    /// Empty before it is known.
    pub stands_for: Vec<u32>,
    pub steps: Vec<Step>,
}

impl HalfMapped {
    /// Measured, and mapped.
    pub const STAGES: u32 = 2;
}

impl Piece for HalfMapped {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.array("clearance", &self.clearance_m)?;
        into.array("stands-for", &self.stands_for)?;
        into.told(&self.error);
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        let (clearance_m, stands_for) = (from.array("clearance")?, from.array("stands-for")?);
        Some(Self { clearance_m, stands_for, error: from.told()?, steps: from.told()? })
    }
}
