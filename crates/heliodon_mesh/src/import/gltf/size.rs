//! How large a scene will be, before any of it is built: nodes that share a mesh, and primitives that share its data, let a small file
//! ask for more memory than there is.

use super::accessor::Values;
use super::buffers::{Buffers, no_such};
use super::model::{Document, Index, Mesh};
use super::scene::{Streams, TRIANGLES, triangle_count};
use super::{Outcome, fail};
use crate::import::assembly::Assembly;

/// Vertices, and triangles, that a file of any size may make: a grove of trees.
const FREE_ELEMENTS: u64 = 10_000_000;
/// And for each byte of its data. Without sharing, a triangle takes three bytes at least, so this is sharing twelvefold.
const ELEMENTS_A_BYTE: u64 = 4;

#[derive(Clone, Copy, Default)]
struct Size {
    vertices: u64,
    triangles: u64,
}

/// Refuses scenes of more vertices or triangles than the options allow, or than the file's data warrants.
pub(super) fn check(
    document: &Document,
    buffers: &Buffers,
    meshes: impl Iterator<Item = Index>,
    assembly: &Assembly,
) -> Outcome<()> {
    let mut known: Vec<Option<Size>> = vec![None; document.meshes.len()];
    let mut total = Size::default();
    for index in meshes {
        let mesh = document.meshes.get(index as usize).ok_or_else(|| no_such("meshes", index, document.meshes.len()))?;
        let size = match known[index as usize] {
            Some(size) => size,
            None => *known[index as usize].insert(measure(document, buffers, mesh)?),
        };
        total.vertices = total.vertices.saturating_add(size.vertices);
        total.triangles = total.triangles.saturating_add(size.triangles);
    }
    let (bytes, most) = (buffers.bytes_held(), warranted(buffers));
    for (count, what) in [(total.vertices, "vertices"), (total.triangles, "triangles")] {
        assembly.check_count(count, what).map_err(|error| super::Failure::new("scene", error.problem(), error.remedy()))?;
        if count > most {
            let problem =
                format!("makes {count} {what} of {bytes} bytes by using them again and again; at most {most} are read");
            return fail("scene", problem, "have its instances written out one by one, or leave some out");
        }
    }
    Ok(())
}

/// How many elements of one kind the data that was opened so far may make.
pub(super) fn warranted(buffers: &Buffers) -> u64 {
    FREE_ELEMENTS.saturating_add(buffers.bytes_held().saturating_mul(ELEMENTS_A_BYTE))
}

/// The most that a mesh can bring; what is wrong with it otherwise is told when it is built.
fn measure(document: &Document, buffers: &Buffers, mesh: &Mesh) -> Outcome<Size> {
    let mut size = Size::default();
    // as the builder shares them
    let mut shared: Vec<Streams> = Vec::new();
    for primitive in &mesh.primitives {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        let Some(&position) = primitive.attributes.get("POSITION").filter(|_| mode >= TRIANGLES) else { continue };
        primitive.check()?;
        let vertices = Values::open(document, buffers, position, &[3])?.count;
        let corners = match primitive.indices {
            Some(indices) => Values::open(document, buffers, indices, &[1])?.count,
            None => vertices,
        };
        let streams = Streams::of(document, primitive, position)?;
        if !shared.contains(&streams) {
            shared.push(streams);
            size.vertices += vertices as u64;
        }
        size.triangles += triangle_count(mode, corners) as u64;
    }
    Ok(size)
}
