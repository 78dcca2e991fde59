//! From photographs to what stands in for a monument that nobody scanned.
//!
//! Marks and parallel edges in photographs tell where they were taken from; shapes of architecture are fitted to what was marked, and textured with what the photographs saw; where the
//! light of their hours is known, what is left of their colours is the stone's own.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`project`] | `photos.toml`: photographs, marks, edges, what is known of the place |
//! | [`exif`] | size and focal length from a photograph's file |
//! | [`formats`] | cameras from COLMAP, Bundler, OpenMVG, kapture and plain matrices; `cameras.json` |
//! | [`camera`] | where a photograph's pixels look: pinhole, distortion, pose |
//! | [`matching`] | COLMAP, where it is installed, run and read |
//! | [`report`] | a solution in words |
//! | [`solve`] | cameras and points from marks, parallel edges and what is known of a place |
//! | [`model`] | shapes of architecture, fitted to points and edges |
//! | [`texture`] | what photographs saw of a model, in one atlas, with evidence of what none saw |
//! | [`snap`] | marks that go to the corner or edge nearby |
//! | [`epipolar`] | where to look for a point that another photograph shows |
//! | [`albedo`] | the stone's own colour, where the light of each photograph is known |
//!
//! Functions outside `project`, `exif`, `formats` and `matching` take slices and parameter structs and return artefact structs; they open no file and print
//! nothing. They use all of rayon's threads, and the number of threads changes no bit of their results.

#![expect(clippy::neg_cmp_op_on_partial_ord, reason = "`!(x > 0.0)` is meant: it refuses what is not a number too")]
#![expect(clippy::needless_range_loop, reason = "indices of rows and columns are how matrices are written")]

pub mod albedo;
pub mod camera;
pub mod epipolar;
pub mod exif;
pub mod formats;
pub mod matching;
pub mod model;
pub mod project;
pub mod report;
pub mod snap;
pub mod solve;
pub mod texture;
