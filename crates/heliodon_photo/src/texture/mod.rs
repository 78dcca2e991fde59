//! Textures from photographs: each face of a model from those that see it.
//!
//! Every texel of the atlas is a place of the surface. It is looked up in each photograph that sees it: rays tell what stands in the way, and pixels near the
//! outline of something nearer are left out, for a lens mixes both. What photographs say is made equally bright ([`PhotoGain`]), weighed by how finely and
//! how squarely they see it, and blended; what none saw is filled from what is about it on the surface and marked as guessed ([`Evidence`]).
//!
//! Photographs are asked for one after the other, each once ([`PictureSource`]): memory holds the pixels of one of them and their coarser levels (4 bytes a pixel
//! each), and 24 bytes for each texel and photograph that sees it.

mod around;
mod blend;
mod eye;
mod fill;
mod gains;
mod gaps;
mod layers;
mod layout;
mod lit;
mod membrane;
mod output;
mod pyramid;
mod source;
mod surface;
mod views;

pub use around::Around;
pub use gains::PhotoGain;
pub(crate) use gains::gains as compared;
pub use layers::Sample;
pub use lit::{Sparse, TexelIndex};
pub use output::{Evidence, FaceReport, GUESSED, OUTSIDE, SEEN, Textured};
pub use source::PictureSource;

use crate::camera::Camera;
use crate::model::Part;
use glam::Vec3;
use heliodon_image::ImageError;
use heliodon_math::frame::unit_or;
use heliodon_mesh::Mesh;
use heliodon_mesh::packing::PackError;
use heliodon_rays::BuildError;
use layout::Layout;
use rayon::prelude::*;
use surface::Surface;

/// A photograph with its camera.
#[derive(Clone, Copy)]
pub struct Photograph<'a> {
    /// What messages call it.
    pub name: &'a str,
    /// Who took it.
    pub camera: Camera,
    /// Its pixels, as many as the camera says: a [`heliodon_image::Picture`], or what reads one.
    pub picture: &'a dyn PictureSource,
}

impl Photograph<'_> {
    fn unread(&self, why: ImageError) -> TextureError {
        TextureError::Picture { photograph: self.name.into(), why }
    }

    fn check(&self, pixels: [u32; 2]) -> Result<(), TextureError> {
        let camera = [self.camera.intrinsics.width, self.camera.intrinsics.height];
        if pixels == camera && !pixels.contains(&0) {
            return Ok(());
        }
        Err(TextureError::Size { photograph: self.name.into(), pixels, camera })
    }
}

/// How textures are made.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureParams {
    /// The largest side of the atlas, texels, 64 to 16,384. Where faces do not fit as finely as photographs show them, all get coarser.
    pub most_side: u32,
    /// Texels between charts; more keeps them apart on smaller mip levels.
    pub margin: u32,
    /// Texels for a pixel of the photograph that shows a face most finely. 1 keeps what it shows up to a slight blur, 1.5 all of it for twice the memory.
    pub oversampling: f32,
    /// Texels for a metre at most; infinite for as many as photographs have.
    pub most_per_m: f32,
    /// What is seen under a flatter angle than this to its normal is not used, degrees below 90. Flat angles show little and err much.
    pub grazing_deg: f32,
    /// Over so many pixels a photograph's word fades towards its border and towards outlines. More hides borders better and uses less of each.
    pub feather_px: f32,
    /// So many pixels next to the outline of something nearer are not used: what a camera, or the model's shape, is off.
    pub edge_px: f32,
    /// Texels to each side over which the large patches of light of several photographs are blended.
    pub band_texels: u32,
    /// How far off the surface rays start beside what rounding asks for, metres: more where parts do not quite touch.
    pub offset_m: f32,
}

impl Default for TextureParams {
    fn default() -> Self {
        Self {
            most_side: 4096,
            margin: 4,
            oversampling: 1.2,
            most_per_m: f32::INFINITY,
            grazing_deg: 80.0,
            feather_px: 24.0,
            edge_px: 2.5,
            band_texels: 12,
            offset_m: 0.001,
        }
    }
}

impl TextureParams {
    /// A small atlas, in seconds.
    #[must_use]
    pub fn preview() -> Self {
        Self { most_side: 1024, oversampling: 0.5, ..Self::default() }
    }

    /// All that photographs show.
    #[must_use]
    pub fn archival() -> Self {
        Self { most_side: 16_384, oversampling: 1.5, ..Self::default() }
    }

    /// The cosine of the flattest angle.
    fn least_cosine(&self) -> f32 {
        libm::cosf(self.grazing_deg.to_radians())
    }

    fn check(&self) -> Result<(), TextureError> {
        let wrong = |setting, promise| Err(TextureError::Setting { setting, promise });
        let above_0 = |x: f32| x > 0.0 && x.is_finite();
        if !(64..=16_384).contains(&self.most_side) {
            return wrong("most_side", "64 to 16,384");
        }
        if !above_0(self.oversampling) {
            return wrong("oversampling", "above 0");
        }
        if self.most_per_m.is_nan() || self.most_per_m <= 0.0 {
            return wrong("most_per_m", "above 0");
        }
        if !(self.grazing_deg > 0.0 && self.grazing_deg < 90.0) {
            return wrong("grazing_deg", "above 0 and below 90");
        }
        if !above_0(self.feather_px) {
            return wrong("feather_px", "above 0");
        }
        if !(self.edge_px >= 0.0 && self.edge_px.is_finite()) {
            return wrong("edge_px", "0 or more");
        }
        if !(self.offset_m >= 0.0 && self.offset_m.is_finite()) {
            return wrong("offset_m", "0 or more");
        }
        Ok(())
    }
}

/// Why there is no texture.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// A setting out of range.
    #[error("{setting} is to be {promise}")]
    Setting {
        /// Which.
        setting: &'static str,
        /// What it is to be.
        promise: &'static str,
    },
    /// No triangle.
    #[error("the model has no triangles to be textured")]
    NoModel,
    /// No photograph.
    #[error("there is no photograph with a camera")]
    NoPhotographs,
    /// A part whose arrays contradict one another.
    #[error("part \"{part}\" {why}")]
    Part {
        /// Its name.
        part: String,
        /// What is wrong.
        why: String,
    },
    /// A photograph that cannot be read.
    #[error("photograph \"{photograph}\": {why}")]
    Picture {
        /// The photograph.
        photograph: String,
        /// What is wrong with its file.
        why: ImageError,
    },
    /// A picture of another size than its camera's.
    #[error("photograph \"{photograph}\" has {} x {} pixels and its camera {} x {}: was it scaled after it was calibrated?", .pixels[0], .pixels[1], .camera[0], .camera[1])]
    Size {
        /// The photograph.
        photograph: String,
        /// What the picture has.
        pixels: [u32; 2],
        /// What the camera says.
        camera: [u32; 2],
    },
    /// No face in any photograph.
    #[error("no photograph sees any of the model: are the cameras solved, and do polygons face them?")]
    NothingSeen,
    /// The faces do not fit.
    #[error("the faces do not fit into the atlas: {0}")]
    Pack(#[from] PackError),
    /// Rays cannot be asked.
    #[error(transparent)]
    Rays(#[from] BuildError),
}

/// Textures a model. `occluders` stand in photographs' way too, but get no texture.
///
/// # Errors
/// As [`Survey::new`].
pub fn texture(
    parts: &[Part],
    occluders: &[&Mesh],
    photographs: &[Photograph],
    params: &TextureParams,
) -> Result<Textured, TextureError> {
    let mut survey = Survey::new(parts, occluders, photographs, params)?;
    let gains = survey.equalize();
    let colors = survey.blended();
    Ok(survey.painted(&colors, gains))
}

/// The angle between a wanted and a photograph's direction at which it counts half, radians.
const HALF_RAD: f32 = 0.13;

/// A model's atlas laid out, with what each photograph says of each of its texels.
pub struct Survey<'a> {
    parts: &'a [Part],
    names: Vec<&'a str>,
    cameras: Vec<Camera>,
    surface: Surface,
    layout: Layout,
    samples: Vec<Vec<Sample>>,
    warnings: Vec<String>,
    band_texels: usize,
}

impl<'a> Survey<'a> {
    /// Looks up every texel in every photograph.
    ///
    /// # Errors
    /// Settings out of range, a model without triangles or with contradicting arrays, pictures that cannot be read or have another size than their cameras, and
    /// where no photograph sees the model.
    pub fn new(
        parts: &'a [Part],
        occluders: &[&Mesh],
        photographs: &[Photograph<'a>],
        params: &TextureParams,
    ) -> Result<Self, TextureError> {
        params.check()?;
        if photographs.is_empty() {
            return Err(TextureError::NoPhotographs);
        }
        // what is of the wrong size is told before the work, where its file says so
        for photograph in photographs {
            let size = photograph.picture.size().map_err(|why| photograph.unread(why))?;
            size.map_or(Ok(()), |size| photograph.check(size))?;
        }
        let surface = Surface::new(parts, occluders)?;
        let cameras: Vec<Camera> = photographs.iter().map(|photograph| photograph.camera).collect();
        let layout = Layout::new(&surface, parts, &cameras, params)?;
        let (mut samples, mut warnings) = (Vec::with_capacity(photographs.len()), Vec::new());
        for photograph in photographs {
            samples.push(layers::layer(photograph, &surface, &layout, params, &mut warnings)?);
        }
        let names = photographs.iter().map(|photograph| photograph.name).collect();
        Ok(Self { parts, names, cameras, surface, layout, samples, warnings, band_texels: params.band_texels as usize })
    }

    /// The places that texels show: position in metres, and the unit normal of the surface there.
    pub fn places(&self) -> impl ExactSizeIterator<Item = (Vec3, Vec3)> {
        self.layout.texels.iter().map(|texel| (texel.place, self.surface.triangles[texel.triangle as usize].normal))
    }

    /// What each photograph says, in the order of texels.
    #[must_use]
    pub fn samples(&self) -> &[Vec<Sample>] {
        &self.samples
    }

    /// The photographs' names.
    #[must_use]
    pub fn names(&self) -> &[&'a str] {
        &self.names
    }

    /// What reading photographs changed, in words.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Makes photographs equally bright and white where they show the same, and tells how they differed.
    pub fn equalize(&mut self) -> Vec<PhotoGain> {
        let gains = gains::gains(&self.samples, &self.names);
        for (layer, PhotoGain { gain, .. }) in self.samples.iter_mut().zip(&gains) {
            layer.iter_mut().for_each(|sample| sample.color /= *gain);
        }
        gains
    }

    /// One colour for each texel that any photograph sees.
    #[must_use]
    pub fn blended(&self) -> Vec<Option<Vec3>> {
        self.blend(&self.samples)
    }

    /// One colour for each texel as it is seen from a place, metres: from photographs that were taken in about that direction, as far as they see it. What
    /// stands out from a model of few polygons, or shines, then looks right from there; an atlas for each of a few places makes a texture that depends on
    /// the view (P. Debevec, C. Taylor, J. Malik, "Modeling and Rendering Architecture from Photographs", SIGGRAPH 1996, section 3).
    #[must_use]
    pub fn blended_from(&self, eye: Vec3) -> Vec<Option<Vec3>> {
        let turned = |(photograph, own): (usize, &Vec<Sample>)| {
            let from = |sample: &Sample| {
                let place = self.layout.texels[sample.texel as usize].place;
                let [wanted, is] =
                    [eye, self.cameras[photograph].centre().as_vec3()].map(|eye| unit_or(eye - place, Vec3::ZERO));
                // the square of the angle, nearly: a photograph counts half as much a twelfth of a right angle away
                let square = 2.0 * (1.0 - wanted.dot(is)).max(0.0) / (HALF_RAD * HALF_RAD);
                Sample { weight: sample.weight / (1.0 + square * square * square), ..*sample }
            };
            own.par_iter().map(from).collect::<Vec<Sample>>()
        };
        let turned: Vec<Vec<Sample>> = self.samples.iter().enumerate().map(turned).collect();
        self.blend(&turned)
    }

    fn blend(&self, samples: &[Vec<Sample>]) -> Vec<Option<Vec3>> {
        let of_face = |face: usize| {
            let (begin, end) = (self.layout.starts[face], self.layout.starts[face + 1]);
            let own: Vec<&[Sample]> = samples.iter().map(|layer| layers::within(layer, begin..end)).collect();
            blend::blended(&self.layout.texels[begin..end], begin, &own, self.band_texels)
        };
        (0..self.surface.faces.len()).into_par_iter().flat_map_iter(of_face).collect()
    }

    /// The textured model, of a linear colour for each texel; gaps take the colours about them, or that of their part where none is.
    ///
    /// # Panics
    /// If there are not as many colours as [`Survey::places`].
    #[must_use]
    pub fn painted(&self, colors: &[Option<Vec3>], gains: Vec<PhotoGain>) -> Textured {
        assert_eq!(colors.len(), self.layout.texels.len(), "one colour for each texel");
        output::textured(self.parts, &self.surface, &self.layout, colors, gains, self.warnings.clone())
    }

    /// For each texel others of its face about it: eight at a distance, metres, and eight at half of it, where it has that many.
    #[must_use]
    pub fn around(&self, distance_m: f32) -> Around {
        around::around(&self.layout, distance_m)
    }
}
