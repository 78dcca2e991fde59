//! Wavefront MTL: the diffuse colour and map of each material.
//!
//! Ramey, Rose, Tyerman: "MTL material format (Lightwave, OBJ)", 1995. `Kd` is taken as sRGB, as all colours in OBJ; the map is
//! multiplied with it. Shifts and scales of maps are told and not applied.

use crate::import::error::{ImportError, ImportReport};
use crate::import::number::parse_f64;
use crate::import::source::Source;
use glam::Vec3;
use heliodon_math::color::linear_from_srgb;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Definition {
    /// Where the library lies: its maps are looked for there first.
    pub folder: PathBuf,
    pub diffuse_linear: Option<Vec3>,
    pub map: Option<Map>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub file: String,
    pub clamp: bool,
}

pub(super) fn read(path: &Path, report: &mut ImportReport) -> Result<Vec<(String, Definition)>, ImportError> {
    let mut source = Source::open(path)?;
    source.skip_byte_order_mark()?;
    let mut materials: Vec<(String, Definition)> = Vec::new();
    loop {
        let number = source.line();
        let Some(line) = source.next_joined_line()? else { return Ok(materials) };
        let line = String::from_utf8_lossy(line).into_owned();
        let line = line.trim();
        let (keyword, rest) = line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((line, ""));
        let rest = rest.trim();
        if keyword == "newmtl" {
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            materials.push((rest.to_owned(), Definition { folder, ..Definition::default() }));
            continue;
        }
        let Some((_, definition)) = materials.last_mut() else { continue };
        match keyword {
            "Kd" => match diffuse(rest) {
                Some(color) => definition.diffuse_linear = Some(color),
                None => {
                    report.warn(path, format_args!("line {number}: the colour \"Kd {rest}\" is not read; write three numbers"))
                }
            },
            "map_Kd" | "map_kd" => {
                let (map, shifted) = map(rest);
                if shifted {
                    report.warn(path, format_args!("line {number}: the map's shift, scale or turbulence is not applied"));
                }
                definition.map = map.or(definition.map.take());
            }
            "d" | "map_d" if keyword == "map_d" || rest.trim() != "1" => {
                let opaque =
                    rest.split_ascii_whitespace().last().and_then(|w| parse_f64(w.as_bytes())).is_some_and(|d| d >= 0.999);
                if !opaque {
                    let (name, _) = &materials[materials.len() - 1];
                    report.warn(path, format_args!("line {number}: \"{name}\" is transparent there and is taken as opaque"));
                }
            }
            _ => {}
        }
    }
}

/// Three numbers, or one for all; `spectral` and `xyz` are nothing that we read.
fn diffuse(rest: &str) -> Option<Vec3> {
    let numbers: Vec<f32> =
        rest.split_ascii_whitespace().take(3).map(|w| parse_f64(w.as_bytes()).map(|x| x as f32)).collect::<Option<_>>()?;
    let srgb = match numbers.as_slice() {
        [grey] => Vec3::splat(*grey),
        [r, g, b] => Vec3::new(*r, *g, *b),
        _ => return None,
    };
    let srgb = if srgb.is_finite() { srgb.clamp(Vec3::ZERO, Vec3::ONE) } else { return None };
    Some(Vec3::from(srgb.to_array().map(linear_from_srgb)))
}

/// The file behind a map's options, and whether an option moves it.
fn map(rest: &str) -> (Option<Map>, bool) {
    let (mut clamp, mut shifted) = (false, false);
    let mut left = rest;
    while let Some(option) = left.split_ascii_whitespace().next().filter(|w| w.starts_with('-')) {
        let most = match option {
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-boost" | "-texres" | "-bm" | "-imfchan" | "-type" | "-colorspace" => 1,
            "-mm" => 2,
            "-o" | "-s" | "-t" => 3,
            _ => break,
        };
        left = left.trim_start()[option.len()..].trim_start();
        for k in 0..most {
            let Some(word) = left.split_ascii_whitespace().next() else { break };
            let number = parse_f64(word.as_bytes());
            // -o, -s and -t take one to three numbers
            if most == 3 && k > 0 && number.is_none() {
                break;
            }
            let neutral = if option == "-s" { 1.0 } else { 0.0 };
            shifted |= most == 3 && number.is_some_and(|x| x != neutral);
            clamp |= option == "-clamp" && word == "on";
            left = left[word.len()..].trim_start();
        }
    }
    let file = left.trim().trim_matches('"');
    ((!file.is_empty()).then(|| Map { file: file.to_owned(), clamp }), shifted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_s_options_are_told_from_its_name() {
        let file = |text| map(text).0.map(|m| m.file);
        assert_eq!(file("stone wall.png").as_deref(), Some("stone wall.png"));
        assert_eq!(file("-s 1 1 1 -o 0 0 0 -mm 0 1 a b.jpg").as_deref(), Some("a b.jpg"));
        assert_eq!(file("-s 2 2.png").as_deref(), Some("2.png"));
        assert!(map("-s 2 x.png").1 && !map("-s 1 1 1 x.png").1 && map("-o 0 0.5 x.png").1);
        assert_eq!(map("-clamp on x.png").0, Some(Map { file: "x.png".into(), clamp: true }));
        assert_eq!(file("-clamp on"), None);
    }

    #[test]
    fn colours_are_srgb_and_clamped() {
        assert_eq!(diffuse("1 0 2"), Some(Vec3::new(1.0, 0.0, 1.0)));
        assert!((diffuse("0.5").unwrap().x - 0.214).abs() < 1e-3);
        assert_eq!(diffuse("spectral x.rfl"), None);
        assert_eq!(diffuse("nan 0 0"), None);
    }
}
