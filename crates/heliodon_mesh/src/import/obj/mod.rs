//! Wavefront OBJ with its material libraries.
//!
//! "Appendix B1. Object Files (.obj)", Alias|Wavefront, 1995. Read here: `v` (also with colours behind the position), `vt`, `vn`,
//! `f` with polygons and indices counted from the end, `usemtl`, `mtllib`, continued lines. Groups, lines, points and smoothing
//! groups are passed over; free-form surfaces are told and left out.

mod materials;
mod mtl;

use super::assembly::{Assembly, Imported};
use super::corners::{Corners, MOST};
use super::error::{ImportError, ImportReport};
use super::number::{parse_f64, parse_integer};
use super::polygon::triangulate;
use super::source::{DAMAGED, Source};
use super::wedges::repeat;
use super::{ImportOptions, material};
use glam::{DVec3, Vec2, Vec3};
use materials::Materials;
use std::path::Path;

/// "v 0 0 0" and a line end: no vertex is written shorter.
const SHORTEST_VERTEX: u64 = 8;

/// Stands in a key for what a corner does not say.
const UNSAID: u32 = u32::MAX;

pub(super) fn read(
    source: &mut Source,
    folder: Option<&Path>,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<Imported, ImportError> {
    source.skip_byte_order_mark()?;
    let assembly = Assembly::new(source.file(), options, report)?;
    let most = (source.length() / SHORTEST_VERTEX + 1).min(u64::from(MOST.min(options.most_elements))) as u32;
    let mut reader = Reader {
        assembly,
        most_vertices: most,
        uvs: Vec::new(),
        normals: Vec::new(),
        srgb: Vec::new(),
        corners: Corners::default(),
        uses_corners: false,
        highest: [(0, 0); 3],
        materials: Materials::default(),
        face: Face::default(),
        left_out: LeftOut::default(),
    };
    loop {
        let number = source.line();
        let Some(line) = source.next_joined_line()? else { break };
        let result = reader.line(line);
        if let Err((problem, remedy)) = result {
            return Err(source.fail_at_line(number, problem, remedy));
        }
        reader.note_highest(number);
    }
    reader.finish(source, folder)
}

/// What a line says that cannot be: the problem and the remedy; the caller knows the line.
type LineResult = Result<(), (String, &'static str)>;

struct Reader<'a> {
    assembly: Assembly<'a>,
    most_vertices: u32,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Colours behind positions, where there are any: as many as positions, NaN where one has none.
    srgb: Vec<Vec3>,
    corners: Corners,
    /// Whether any corner said more than its position.
    uses_corners: bool,
    /// The highest position, texture coordinate and normal that faces name (counted from 1), and on which line.
    highest: [(u32, u64); 3],
    materials: Materials,
    face: Face,
    left_out: LeftOut,
}

/// One face's corners: positions (or their variants), bases, and how it is cut.
#[derive(Default)]
struct Face {
    corners: Vec<u32>,
    bases: Vec<u32>,
    cut: Vec<[usize; 3]>,
    highest: [u32; 3],
}

#[derive(Default)]
struct LeftOut {
    free_form: u64,
    short_faces: u64,
}

impl Reader<'_> {
    fn line(&mut self, line: &[u8]) -> LineResult {
        let mut words = line.split(|b| matches!(b, b' ' | b'\t' | 0x0b | 0x0c | 0)).filter(|word| !word.is_empty());
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            b"v" => self.position(words),
            b"vt" => self.uv(words),
            b"vn" => self.normal(words),
            b"f" | b"fo" => self.face(words),
            b"usemtl" => {
                self.materials.choose(rest(line, keyword));
                Ok(())
            }
            b"mtllib" => {
                self.materials.add_library(rest(line, keyword));
                Ok(())
            }
            b"curv" | b"curv2" | b"surf" => {
                self.left_out.free_form += 1;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn position<'w>(&mut self, words: impl Iterator<Item = &'w [u8]>) -> LineResult {
        let mut values = [0.0; 7];
        let count = numbers(words, &mut values)?;
        if count < 3 {
            return Err((format!("a vertex has {count} coordinates where 3 belong"), DAMAGED));
        }
        let positions = &mut self.assembly.mesh.positions;
        if positions.len() as u64 >= u64::from(self.most_vertices) {
            return Err((format!("more than {} vertices", self.most_vertices), "split it into several files"));
        }
        // x y z, x y z w, x y z r g b, x y z r g b a (or w r g b, which nobody writes)
        if count >= 6 {
            self.srgb.resize(positions.len(), Vec3::NAN);
            self.srgb.push(Vec3::new(values[3] as f32, values[4] as f32, values[5] as f32));
        }
        self.assembly.push_position(DVec3::new(values[0], values[1], values[2]));
        Ok(())
    }

    fn uv<'w>(&mut self, words: impl Iterator<Item = &'w [u8]>) -> LineResult {
        let mut values = [0.0; 3];
        numbers(words, &mut values)?;
        self.uvs.push(Vec2::new(values[0] as f32, (1.0 - values[1]) as f32));
        Ok(())
    }

    fn normal<'w>(&mut self, words: impl Iterator<Item = &'w [u8]>) -> LineResult {
        let mut values = [0.0; 3];
        numbers(words, &mut values)?;
        self.normals.push(self.assembly.site_from_file.normal(DVec3::from(values)));
        Ok(())
    }

    fn face<'w>(&mut self, words: impl Iterator<Item = &'w [u8]>) -> LineResult {
        self.face.corners.clear();
        self.face.bases.clear();
        for word in words {
            if word[0] == b'#' {
                break;
            }
            self.corner(word)?;
        }
        let count = self.face.bases.len();
        if count < 3 {
            self.left_out.short_faces += 1;
            return Ok(());
        }
        let material = self.materials.current(self.assembly.mesh.triangles.len());
        if count == 3 {
            let corners = [self.face.corners[0], self.face.corners[1], self.face.corners[2]];
            self.triangle(corners, [0, 1, 2], material);
        } else {
            let (positions, bases) = (&self.assembly.mesh.positions, &self.face.bases);
            let position = |i: usize| positions.get(bases[i] as usize).map_or(DVec3::ZERO, |p| p.as_dvec3());
            triangulate(count, position, &mut self.face.cut);
            for k in 0..self.face.cut.len() {
                let cut = self.face.cut[k];
                self.triangle(cut.map(|i| self.face.corners[i]), cut, material);
            }
        }
        if self.assembly.mesh.triangles.len() as u64 > u64::from(self.assembly.options.most_elements) {
            return Err((
                format!("more than {} triangles", self.assembly.options.most_elements),
                "split it into several files",
            ));
        }
        Ok(())
    }

    #[inline]
    fn triangle(&mut self, corners: [u32; 3], at: [usize; 3], material: Option<u16>) {
        let [a, b, c] = at.map(|i| self.face.bases[i]);
        if a == b || b == c || c == a {
            self.assembly.report.collapsed_triangles += 1;
            return;
        }
        self.assembly.push_triangle(corners, material);
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    #[inline]
    fn corner(&mut self, word: &[u8]) -> LineResult {
        let mut parts = word.split(|b| *b == b'/');
        let position = self.index(parts.next().unwrap_or_default(), 0)?;
        let Some(position) = position else {
            return Err((format!("a corner \"{}\" names no vertex", show(word)), DAMAGED));
        };
        let key = [self.index(parts.next().unwrap_or_default(), 1)?, self.index(parts.next().unwrap_or_default(), 2)?];
        let corner = if key == [None; 2] && !self.uses_corners {
            position
        } else {
            self.uses_corners = true;
            let vertex = self.corners.vertex(position, key.map(|k| k.unwrap_or(UNSAID)));
            vertex.ok_or_else(|| ("more texture seams than indices can count".to_owned(), "split it into several files"))?
        };
        self.face.corners.push(corner);
        self.face.bases.push(position);
        Ok(())
    }

    /// An index counted from 1, or from the end if negative, as one counted from 0; none for an empty word.
    #[inline]
    fn index(&mut self, word: &[u8], what: usize) -> Result<Option<u32>, (String, &'static str)> {
        if word.is_empty() {
            return Ok(None);
        }
        let Some(number) = parse_integer(word) else {
            return Err((format!("\"{}\" is no index", show(word)), DAMAGED));
        };
        let (count, name) = match what {
            0 => (self.assembly.mesh.positions.len(), "vertices"),
            1 => (self.uvs.len(), "texture coordinates"),
            _ => (self.normals.len(), "normals"),
        };
        let from_one = if number < 0 { count as i64 + 1 + number } else { number };
        if from_one < 1 {
            // Some exporters write 0 for a texture coordinate or normal that is not there.
            if number == 0 && what > 0 {
                return Ok(None);
            }
            let problem = if number == 0 {
                "a face names vertex 0, but indices are counted from 1".to_owned()
            } else {
                format!("a face names {name} {number} from the end, but there are only {count} so far")
            };
            return Err((problem, DAMAGED));
        }
        if from_one > i64::from(self.most_vertices) {
            return Err((
                format!("a face names number {from_one} of the {name}, but the file has no room for so many"),
                DAMAGED,
            ));
        }
        self.face.highest[what] = self.face.highest[what].max(from_one as u32);
        Ok(Some(from_one as u32 - 1))
    }

    /// Faces may stand before what they name, so that their indices are judged at the end, with the line at hand.
    fn note_highest(&mut self, line: u64) {
        for (highest, face) in self.highest.iter_mut().zip(&mut self.face.highest) {
            if *face > highest.0 {
                *highest = (*face, line);
            }
            *face = 0;
        }
    }

    fn finish(mut self, source: &Source, folder: Option<&Path>) -> Result<Imported, ImportError> {
        let counts = [self.assembly.mesh.positions.len(), self.uvs.len(), self.normals.len()];
        for ((count, (highest, line)), name) in
            counts.into_iter().zip(self.highest).zip(["vertex", "texture coordinate", "normal"])
        {
            if highest as usize > count {
                let problem = format!("a face names {name} {highest}, but there are {count}");
                return Err(source.fail_at_line(line, problem, DAMAGED));
            }
        }
        let LeftOut { free_form, short_faces } = self.left_out;
        if free_form > 0 {
            self.assembly.warn(format_args!("{free_form} free-form curves or surfaces are left out; export polygons"));
        }
        if short_faces > 0 {
            self.assembly.warn(format_args!("{short_faces} faces with fewer than 3 corners are left out"));
        }
        self.spread_corners();
        let folder_or_none = folder;
        std::mem::take(&mut self.materials).finish(folder_or_none, &mut self.assembly);
        self.assembly.finish()
    }

    /// Texture coordinates and normals from corners to vertices, split ones appended.
    fn spread_corners(&mut self) {
        let mesh = &mut self.assembly.mesh;
        let count = mesh.positions.len();
        if !self.srgb.is_empty() {
            self.srgb.resize(count, Vec3::NAN);
            material::push_srgb_colors(&self.srgb, &mut self.assembly);
            self.srgb = Vec::new();
        }
        if !self.uses_corners {
            return;
        }
        self.assembly.file_vertices = Some(count as u64);
        let mesh = &mut self.assembly.mesh;
        Corners::number(&mut mesh.triangles, count as u32);
        repeat(&mut mesh.positions, self.corners.extra_bases());
        self.assembly.appended = self.corners.extra_bases().to_vec();
        let mesh = &mut self.assembly.mesh;
        repeat(&mut mesh.colors_linear, self.corners.extra_bases());
        let said = |what: usize| {
            self.corners.keys(count).map(move |key| key.map(|k| k[what]).filter(|&index| index != UNSAID).map(|i| i as usize))
        };
        if !self.uvs.is_empty() {
            mesh.uvs = said(0).map(|i| i.map_or(Vec2::ZERO, |i| self.uvs[i])).collect();
        }
        self.uvs = Vec::new();
        if !self.normals.is_empty() {
            mesh.normals = said(1).map(|i| i.map_or(Vec3::ZERO, |i| self.normals[i])).collect();
        }
        self.normals = Vec::new();
    }
}

/// Fills `values` from the words up to a comment; answers how many there were.
#[inline]
fn numbers<'w>(words: impl Iterator<Item = &'w [u8]>, values: &mut [f64]) -> Result<usize, (String, &'static str)> {
    let mut count = 0;
    for (value, word) in values.iter_mut().zip(words) {
        if word[0] == b'#' {
            break;
        }
        let Some(number) = parse_f64(word) else {
            return Err((format!("\"{}\" is no number", show(word)), DAMAGED));
        };
        *value = number;
        count += 1;
    }
    Ok(count)
}

/// What follows the keyword, spaces inside kept: names may have them.
fn rest<'l>(line: &'l [u8], keyword: &[u8]) -> &'l [u8] {
    let from = line.windows(keyword.len()).position(|w| w == keyword).unwrap_or(0) + keyword.len();
    line[from..].trim_ascii()
}

fn show(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(24)]).into_owned()
}
