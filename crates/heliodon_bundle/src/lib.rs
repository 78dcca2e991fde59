//! What Heliodon keeps on disk: `site.toml`, the bundle's glTF profile, its manifest, the day lapse.
//!
//! - [`site`]: the types of `site.toml`, read with the line and column of whatever is wrong in it.
//! - [`display`]: the types of `display.toml`: screens, trackers, keys.
//! - [`BundleWriter`] streams a bundle to disk beside its final place and renames it in; [`BundleReader`] reads it back chunk
//!   by chunk and trusts nothing in it.
//! - [`moment`] and [`shade`]: the light of a vertex at an hour of the day; the reference that every viewer mirrors.
//! - [`grid`]: the light of space, for what moves in it; [`texels`]: that of surfaces whose triangles are large;
//!   [`panorama`]: that of what was scanned, as a room's middle sees it.
//! - [`impostor`]: image-based characters; their files, which views are shown, and the reference of how they are looked at.
//! - [`detail`]: fine patterns that are multiplied onto albedo near the eye; the reference that viewers mirror.
//! - [`arrays`], [`export`], [`inspect`]: bundles for numpy, for stock viewers, for people.
//!
//! The layout of the glTF profile is described in [`layout`].

mod actors;
mod albedo;
pub mod arrays;
pub mod chunk;
mod config;
pub mod detail;
pub mod display;
pub mod export;
pub mod file_lock;
mod glb;
mod gltf;
pub mod grid;
pub mod impostor;
pub mod inspect;
mod lapse_check;
pub mod layout;
pub mod lineage;
pub mod manifest;
pub mod memory;
pub mod moment;
pub mod npy;
pub mod panorama;
mod reader;
pub mod shade;
pub mod site;
mod staging;
mod storage;
pub mod texels;
mod writer;

pub use actors::{ACTORS_FOLDER, ActorFile, ActorMeta, LIVING_FOLDER};
pub use albedo::VertexAlbedo;
pub use chunk::{LightLayout, LitChunk, VertexLight};
pub use config::{ConfigError, line_and_column};
pub use detail::DetailInfo;
pub use grid::{AmbientCube, Grid, GridInfo, GridPoints, GridSample};
pub use lapse_check::check_lapse;
pub use manifest::{BundleMeta, EvidenceInfo, Manifest, Parameters, PartMeta, ViewsInfo};
pub use panorama::{Panorama, PanoramaInfo};
pub use reader::{BundleReader, ChunkInfo, ReadError};
pub use storage::{StoredFile, WriteFault};
pub use texels::{TexelInfo, TexelLight};
pub use writer::{BundleWriter, WriteError, WriterOptions};
