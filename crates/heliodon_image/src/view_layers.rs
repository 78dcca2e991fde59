//! View-dependent colours: what several photographs saw of a surface, each with the directions that it was seen from.
//!
//! Debevec, Yu, Borshukov, "Efficient View-Dependent Image-Based Rendering with Projective Texture-Mapping", EGWR 1998. Beside the image of a surface, which
//! is right from nowhere in particular, there are up to [`MOST_LAYERS`] layers of the same layout: what one photograph saw of each texel, and the direction
//! from the texel to its camera. Where somebody stands near a camera's direction, its photograph counts:
//!
//! ```text
//! color = (PLAIN * image + sum of w * layer) / (PLAIN + sum of w)
//! w     = alpha * exp2(-|direction - toward_eye|^2 / HALF_RAD^2)
//! ```
//!
//! `alpha` is how much the photograph's word counts at that texel, 0 where it did not see it. From a camera's own place its photograph is shown but for a
//! sixty-fourth; from far off all directions the image alone.
//!
//! In files: `views.json`, which names two PNG files for each layer, `{"layers": [{"colors": "a.png", "directions": "b.png"}]}`, relative to itself.

use crate::SrgbImage;
use crate::error::{self, COPY_AGAIN, ImageError};
use glam::{Quat, Vec3};
use heliodon_math::frame::unit_or;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The name that the file has where Heliodon writes it.
pub const VIEWS_FILE: &str = "views.json";

/// The most layers: what a device draws of in one pass at a price that is still small.
pub const MOST_LAYERS: usize = 8;

/// A layer counts half where the eye is so far from the direction of its camera, radians (7.4 degrees).
pub const HALF_RAD: f32 = 0.13;

/// What the surface's own image counts.
pub const PLAIN: f32 = 1.0 / 64.0;

/// What one photograph saw of each texel. Texels that it did not see have alpha 0, and best the colour of a neighbour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewLayer {
    /// Colours, coded as sRGB; alpha is how much they count, 0 to 255.
    pub colors: SrgbImage,
    /// Unit vectors from the surface to the camera as [`direction_code`] writes them; alpha means nothing.
    pub directions: SrgbImage,
}

/// The layers of a surface, all as large as its image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ViewLayers {
    /// Between one and [`MOST_LAYERS`].
    pub layers: Vec<ViewLayer>,
}

/// `views.json`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ViewsFile {
    layers: Vec<LayerFiles>,
}

/// The files of a layer, relative to what names them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayerFiles {
    /// Its colours.
    pub colors: String,
    /// Its directions.
    pub directions: String,
}

/// A texel of one layer, decoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSample {
    /// Linear RGB.
    pub color: Vec3,
    /// How much it counts, 0 to 1.
    pub weight: f32,
    /// Unit vector from the surface to the camera.
    pub direction: Vec3,
}

impl ViewLayer {
    /// The texel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside of the images.
    #[must_use]
    pub fn sample(&self, x: u32, y: u32) -> ViewSample {
        let color = self.colors.linear(x, y);
        ViewSample { color: color.truncate(), weight: color.w, direction: decoded(self.directions.pixel(x, y)) }
    }
}

impl ViewLayers {
    /// Columns and rows; nothing without layers.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.layers.first().map_or([0, 0], |layer| [layer.colors.width, layer.colors.height])
    }

    /// Checks that there are layers, not too many, and all of one size.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn validate(&self) -> Result<(), String> {
        if self.layers.is_empty() || self.layers.len() > MOST_LAYERS {
            return Err(format!("it has {} layers, and needs 1 to {MOST_LAYERS}", self.layers.len()));
        }
        let [width, height] = self.size();
        for (number, ViewLayer { colors, directions }) in self.layers.iter().enumerate() {
            for (what, image) in [("colours", colors), ("directions", directions)] {
                if [image.width, image.height] != [width, height] {
                    let (w, h) = (image.width, image.height);
                    return Err(format!(
                        "the {what} of layer {number} are {w} x {h} texels, the first layer is {width} x {height}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Reads a `views.json` and the images that it names.
    ///
    /// # Errors
    /// Files that cannot be read or are broken, paths that leave the file's folder, layers that do not fit together.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let (bytes, name) = error::read_file(path)?;
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        let layers = layer_files(&bytes, &name)?;
        let image = |file: &str| SrgbImage::read(folder.join(file));
        let read = |files: &LayerFiles| Ok(ViewLayer { colors: image(&files.colors)?, directions: image(&files.directions)? });
        let layers = Self { layers: layers.iter().map(read).collect::<Result<_, ImageError>>()? };
        layers.validate().map_err(|what| ImageError::malformed(&name, "its layers", what, COPY_AGAIN))?;
        Ok(layers)
    }

    /// Writes [`VIEWS_FILE`] and `view-N-colors.png`, `view-N-directions.png` into a folder, and answers with their names.
    ///
    /// # Errors
    /// Where they cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<String>, ImageError> {
        let mut file = ViewsFile { layers: Vec::new() };
        let mut written = vec![VIEWS_FILE.to_owned()];
        for (number, layer) in self.layers.iter().enumerate() {
            let names =
                LayerFiles { colors: format!("view-{number}-colors.png"), directions: format!("view-{number}-directions.png") };
            layer.colors.write_png(folder.join(&names.colors))?;
            layer.directions.write_png(folder.join(&names.directions))?;
            written.extend([names.colors.clone(), names.directions.clone()]);
            file.layers.push(names);
        }
        let path = folder.join(VIEWS_FILE);
        let text = serde_json::to_string_pretty(&file).map_err(|e| ImageError::write(&path, e))?;
        std::fs::write(&path, text + "\n").map_err(|e| ImageError::write(&path, e))?;
        Ok(written)
    }

    /// The same with all directions turned: those of a surface that was turned.
    #[must_use]
    pub fn turned(&self, by: Quat) -> Self {
        let turn = |layer: &ViewLayer| {
            let mut directions = layer.directions.clone();
            for pixel in &mut directions.pixels {
                *pixel = direction_code(by * decoded(*pixel));
            }
            ViewLayer { colors: layer.colors.clone(), directions }
        };
        Self { layers: self.layers.iter().map(turn).collect() }
    }
}

/// What a `views.json` names, whose bytes are these and whose name is for messages.
///
/// # Errors
/// What is no such file, or names files outside of its folder.
pub fn layer_files(bytes: &[u8], name: &str) -> Result<Vec<LayerFiles>, ImageError> {
    let file: ViewsFile = serde_json::from_slice(bytes).map_err(|e| {
        let place = format!("line {}", e.line());
        ImageError::malformed(name, place, e.to_string(), "write it again with `heliodon photo texture --views 4`")
    })?;
    for file in file.layers.iter().flat_map(|layer| [&layer.colors, &layer.directions]) {
        if file.is_empty() || file.contains(['/', '\\', ':']) || file.starts_with('.') {
            return Err(ImageError::malformed(
                name,
                "its layers",
                format!("`{file}` is no file beside it"),
                "name files in its folder",
            ));
        }
    }
    Ok(file.layers)
}

/// A unit vector as three codes, less than half a degree off, and 255.
#[must_use]
pub fn direction_code(direction: Vec3) -> [u8; 4] {
    let code = |x: f32| ((x.clamp(-1.0, 1.0) + 1.0) * 127.5).round_ties_even() as u8;
    [code(direction.x), code(direction.y), code(direction.z), u8::MAX]
}

/// The unit vector of a code; up for one of nothing.
fn decoded([x, y, z, _]: [u8; 4]) -> Vec3 {
    unit_or(Vec3::new(f32::from(x), f32::from(y), f32::from(z)) / 127.5 - 1.0, Vec3::Z)
}

/// The linear colour of a place that is looked at from the unit vector `toward_eye`, with `plain` as the colour of the surface's own image.
#[must_use]
pub fn color(plain: Vec3, layers: &[ViewSample], toward_eye: Vec3) -> Vec3 {
    let (mut sum, mut weights) = (plain * PLAIN, PLAIN);
    for layer in layers {
        let off = (layer.direction - toward_eye).length_squared() / (HALF_RAD * HALF_RAD);
        let weight = layer.weight * libm::exp2f(-off);
        sum += layer.color * weight;
        weights += weight;
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(color: [u8; 4], direction: Vec3) -> ViewLayer {
        ViewLayer { colors: SrgbImage::filled(3, 2, color), directions: SrgbImage::filled(3, 2, direction_code(direction)) }
    }

    #[test]
    fn files_come_back_as_they_were_and_strange_ones_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let layers = ViewLayers { layers: vec![layer([200, 90, 10, 255], Vec3::X), layer([9, 8, 7, 0], Vec3::NEG_Y)] };
        let written = layers.write(folder.path()).unwrap();
        assert_eq!(written.len(), 5);
        assert!(written.iter().all(|name| folder.path().join(name).is_file()));
        let path = folder.path().join(VIEWS_FILE);
        assert_eq!(ViewLayers::read(&path).unwrap(), layers);
        SrgbImage::filled(2, 2, [1; 4]).write_png(folder.path().join("view-1-directions.png")).unwrap();
        let told = ViewLayers::read(&path).unwrap_err().to_string();
        assert!(told.contains("directions of layer 1 are 2 x 2") && told.contains("3 x 2"), "{told}");
        for (text, problem) in [
            ("{\"layers\": []}", "0 layers"),
            ("{\"layers\": [{\"colors\": \"../a.png\", \"directions\": \"b.png\"}]}", "no file beside it"),
            ("{\"layers\": 3}", "line 1"),
        ] {
            std::fs::write(&path, text).unwrap();
            let told = ViewLayers::read(&path).unwrap_err().to_string();
            assert!(told.contains(problem), "{told}");
        }
    }

    #[test]
    fn directions_are_kept_to_half_a_degree_and_turn() {
        let mut worst = 0.0_f32;
        for i in 0..2000 {
            let z = 1.0 - (i as f32 + 0.5) / 1000.0;
            let (sin, cos) = libm::sincosf(i as f32 * 2.399_963);
            let direction = Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
            worst = worst.max(direction.angle_between(decoded(direction_code(direction))));
        }
        assert!(worst.to_degrees() < 0.5, "{}", worst.to_degrees());
        let layers = ViewLayers { layers: vec![layer([1; 4], Vec3::X)] };
        let turned = layers.turned(Quat::from_rotation_z(core::f32::consts::FRAC_PI_2));
        assert!(turned.layers[0].sample(1, 1).direction.abs_diff_eq(Vec3::Y, 0.01));
        assert_eq!(turned.layers[0].colors, layers.layers[0].colors);
    }

    #[test]
    fn from_a_cameras_place_its_photograph_is_seen_and_from_elsewhere_the_image() {
        let red = ViewSample { color: Vec3::X, weight: 1.0, direction: Vec3::Z };
        let green = ViewSample { color: Vec3::Y, weight: 1.0, direction: Vec3::X };
        let seen = |toward: Vec3| color(Vec3::splat(0.5), &[red, green], unit_or(toward, Vec3::Z));
        assert!(seen(Vec3::Z).abs_diff_eq(Vec3::X, 0.02), "{}", seen(Vec3::Z));
        assert!(seen(Vec3::X).abs_diff_eq(Vec3::Y, 0.02));
        assert!(seen(Vec3::NEG_ONE).abs_diff_eq(Vec3::splat(0.5), 1e-3));
        // half as much where it says
        let off = Vec3::Z * libm::cosf(HALF_RAD) + Vec3::X * libm::sinf(HALF_RAD);
        let wanted = (0.5 * PLAIN + 0.5) / (PLAIN + 0.5);
        assert!((seen(off).x - wanted).abs() < 0.01, "{} {wanted}", seen(off).x);
        // what a photograph did not see it does not tell
        assert!(color(Vec3::ONE, &[ViewSample { weight: 0.0, ..red }], Vec3::Z).abs_diff_eq(Vec3::ONE, 1e-6));
    }
}
