//! STL, text and binary. Its triangles share nothing; corners at the same position to the bit become one vertex.
//!
//! The facets' own normals are not read: they say no more than the corners do, and exporters leave them zero.

use super::assembly::{Assembly, Imported, rounded};
use super::error::{ImportError, ImportReport};
use super::number::parse_f64;
use super::source::{BYTE_ORDER_MARK, DAMAGED, Source};
use super::{ImportOptions, STL_CREASE_DEG};
use crate::weld::Welder;
use glam::{DVec3, Vec3};

const HEADER: u64 = 80;
const FACET: u64 = 50;

pub(super) fn read(source: &mut Source, options: &ImportOptions, report: &mut ImportReport) -> Result<Imported, ImportError> {
    let mut assembly = Assembly::new(source.file(), options, report)?;
    assembly.own_crease_deg = Some(STL_CREASE_DEG);
    let mut facets = Facets { assembly, welder: Welder::default(), bad: None };
    if is_text(source)? {
        source.skip_byte_order_mark()?;
        read_text(source, &mut facets)?
    } else {
        read_binary(source, &mut facets)?
    }
    // its table is as large as a vertex and not needed any more
    facets.welder = Welder::default();
    facets.assembly.finish()
}

struct Facets<'a> {
    assembly: Assembly<'a>,
    welder: Welder,
    /// The one vertex for all corners that are not finite.
    bad: Option<u32>,
}

impl Facets<'_> {
    #[inline]
    fn vertex(&mut self, p_file: DVec3) -> u32 {
        let positions = &mut self.assembly.mesh.positions;
        let p = rounded(self.assembly.site_from_file.position(p_file));
        let next = positions.len() as u32;
        if p.is_nan() {
            // NaN equals nothing, so the welder would not find it again. Its place in the table is never met.
            return *self.bad.get_or_insert_with(|| {
                self.welder.find_or_note(positions, Vec3::NAN);
                positions.push(p);
                next
            });
        }
        self.welder.find_or_note(positions, p).unwrap_or_else(|| {
            positions.push(p);
            next
        })
    }

    fn facet(&mut self, corners: [DVec3; 3]) -> Result<(), ImportError> {
        let corners = corners.map(|p| self.vertex(p));
        if self.bad.is_some() && corners.iter().filter(|&&i| Some(i) == self.bad).count() > 1 {
            // more than one bad corner: dropped for that, not for being collapsed
            self.assembly.report.dropped_triangles += 1;
            return Ok(());
        }
        self.assembly.push_triangle(corners, None);
        Ok(())
    }
}

/// Files that begin with "solid" may be binary all the same: the length that a binary file's count asks for decides, then
/// whether the beginning is text with a facet in it.
fn is_text(source: &mut Source) -> Result<bool, ImportError> {
    let length = source.length();
    let start = source.peek(1024)?;
    if start.len() >= 84 {
        let count = u64::from(u32::from_le_bytes([start[80], start[81], start[82], start[83]]));
        if length == HEADER + 4 + count * FACET {
            return Ok(false);
        }
    }
    let begin = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start).trim_ascii_start();
    let solid = begin.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    Ok(solid && !start.contains(&0))
}

fn read_binary(source: &mut Source, facets: &mut Facets) -> Result<(), ImportError> {
    if source.length() < HEADER + 4 {
        let problem = format!("has {} bytes, fewer than an STL file's header", source.length());
        return Err(source.fail(problem, DAMAGED));
    }
    source.skip(HEADER)?;
    let promised = u64::from(u32::from_le_bytes(source.take(4)?.try_into().unwrap_or_default()));
    let (held, rest) = (source.remaining() / FACET, source.remaining() % FACET);
    let count = if promised <= held {
        if promised < held && rest == 0 && promised == 0 {
            // programs that stream leave the count at zero
            facets.assembly.warn(format_args!("its header counts no triangles; the {held} that the file holds are read"));
            held
        } else {
            if source.remaining() > promised * FACET {
                let extra = source.remaining() - promised * FACET;
                facets.assembly.warn(format_args!("{extra} bytes behind its {promised} triangles are not read"));
            }
            promised
        }
    } else if rest == 0 && promised == u64::from(u32::MAX) {
        facets.assembly.warn(format_args!("its header has no count; the {held} triangles that the file holds are read"));
        held
    } else {
        let problem = format!("the header promises {promised} triangles, but the file's {} bytes hold {held}", source.length());
        return Err(source.fail(problem, "the file may be cut off, or is no STL file; copy or export it again"));
    };
    facets.assembly.check_count(count, "triangles")?;
    facets.assembly.mesh.triangles.reserve_exact(count as usize);
    // closed surfaces have half as many vertices as triangles
    facets.welder = Welder::with_room_for(count as usize / 2);
    for _ in 0..count {
        let facet = source.take(FACET as usize)?;
        let number = |k: usize| f64::from(f32::from_le_bytes([facet[k], facet[k + 1], facet[k + 2], facet[k + 3]]));
        facets.facet([12, 24, 36].map(|k| DVec3::new(number(k), number(k + 4), number(k + 8))))?;
    }
    Ok(())
}

/// Words, whatever the line ends and capitals; names of solids may hold any words and end with their line.
fn read_text(source: &mut Source, facets: &mut Facets) -> Result<(), ImportError> {
    let mut corners = [DVec3::ZERO; 3];
    let mut count = 0;
    while let Some(word) = source.next_word()? {
        if word.eq_ignore_ascii_case(b"vertex") {
            let mut p = [0.0; 3];
            for coordinate in &mut p {
                *coordinate = coordinate_word(source)?;
            }
            if count == 3 {
                let line = source.line();
                return Err(source.fail_at_line(line, "a facet has more than three vertices", DAMAGED));
            }
            corners[count] = DVec3::from(p);
            count += 1;
        } else if word.eq_ignore_ascii_case(b"endfacet") {
            if count != 3 {
                let line = source.line();
                return Err(source.fail_at_line(line, format!("a facet ends with {count} vertices where 3 belong"), DAMAGED));
            }
            facets.facet(corners)?;
            count = 0;
        } else if word.eq_ignore_ascii_case(b"solid") || word.eq_ignore_ascii_case(b"endsolid") {
            source.next_line()?;
        } else if !is_known(word) {
            let problem = format!("\"{}\" is no word of an STL file", String::from_utf8_lossy(&word[..word.len().min(24)]));
            let line = source.line();
            return Err(source.fail_at_line(line, problem, DAMAGED));
        }
    }
    if count > 0 {
        let line = source.line();
        return Err(source.fail_at_line(line, "the file ends in the middle of a facet", DAMAGED));
    }
    Ok(())
}

/// Words that carry nothing here, the numbers of the facet's normal among them.
fn is_known(word: &[u8]) -> bool {
    [&b"facet"[..], b"normal", b"outer", b"loop", b"endloop"].iter().any(|known| word.eq_ignore_ascii_case(known))
        || parse_f64(word).is_some()
}

fn coordinate_word(source: &mut Source) -> Result<f64, ImportError> {
    let word = source.next_word()?.unwrap_or_default();
    if let Some(number) = parse_f64(word) {
        return Ok(number);
    }
    let problem = format!("has \"{}\" where a number belongs", String::from_utf8_lossy(&word[..word.len().min(24)]));
    let line = source.line();
    Err(source.fail_at_line(line, problem, DAMAGED))
}
