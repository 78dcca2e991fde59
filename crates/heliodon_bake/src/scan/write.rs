//! The scan as a bundle within the bundle.

use super::{BakedScan, Scan};
use crate::chunks::ChunkMaker;
use crate::error::BakeError;
use crate::report::Reporter;
use heliodon_bundle::{BundleMeta, BundleWriter};
use heliodon_sky::lapse::Lapse;
use std::collections::BTreeMap;

impl BakedScan {
    /// Figures that depend on nothing but the input.
    #[must_use]
    pub fn measures(&self) -> BTreeMap<String, f64> {
        let named =
            [("gather_rays", self.gather_rays), ("mask_rays", self.mask_rays), ("solved_points", self.valid.len() as u64)];
        named.map(|(name, value)| (name.to_owned(), value as f64)).into()
    }
}

impl Scan<'_> {
    /// Writes it with its light into the bundle of `writer`, which has all of its sky maps and will end with this lapse; `meta` is that of the bundle.
    ///
    /// # Errors
    /// What keeps it from being written.
    pub fn write(
        &self,
        light: &BakedScan,
        (writer, meta, lapse): (&mut BundleWriter, &BundleMeta, &Lapse),
        reporter: &dyn Reporter,
    ) -> Result<(), BakeError> {
        // nothing of it was simplified
        let meta = BundleMeta { measures: light.measures(), prepared: None, ..meta.clone() };
        let scene = self.scene()?;
        let maker = ChunkMaker::new(&scene, None, light.values(), meta.light);
        let mut within = writer.begin_scan(meta)?;
        reporter.stage("writing the scan", self.counts()[1]);
        reporter.progress(0);
        let mut done = 0;
        for part in 0..self.parts.len() {
            for piece in maker.pieces(part) {
                within.push_chunk(&maker.make(part, &piece, None))?;
                done += piece.triangles.len() as u64;
                reporter.progress(done);
            }
        }
        writer.end_scan(within, lapse)?;
        reporter.finished();
        Ok(())
    }
}
