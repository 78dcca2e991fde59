//! A panorama of the original ([`heliodon_bundle::panorama`]): what the middle of a site's one room sees of it, for what is drawn of it in fewer triangles.
//!
//! Rays from the middle find what lies first of the original and of what is drawn (`look`); where both are the same surface, as far as preparation has measured
//! that they may be apart, a texel has the original's place, normal and colour there, and its light by the very rays and sums that serve vertices and texels.

mod level;
mod look;

use crate::error::BakeError;
use crate::key::{Digest, TOOL};
use crate::names::TexelNames;
use crate::report::Reporter;
use crate::scene::Scene;
use crate::stages::Work;
use crate::texels::{Asked, BakedTexels, SolvedScene, coarser, mean, most};
use glam::Vec3;
use heliodon_bundle::panorama::{PanoramaInfo, albedo_texture, size_of, surface_texture};
use heliodon_bundle::site::Site;
use heliodon_bundle::texels::{TEXEL_LEVELS, float_texture, sky_level, sun_texture};
use heliodon_bundle::{LightLayout, TexelLight};
use heliodon_rays::{BuildParams, TriangleScene};
use level::{Level, Shown};
use look::Texel;

/// What a room's middle sees of the original.
#[derive(Debug)]
pub struct Panorama {
    side: u32,
    middle: Vec3,
    /// Face by face, each row by row.
    texels: Vec<Texel>,
}

impl Panorama {
    /// Of a scene whose rays were taken; none where the site wants none.
    ///
    /// # Errors
    /// More geometry than the ray engine holds.
    pub fn new(site: &Site, scene: &Scene, rays: &TriangleScene, reporter: &dyn Reporter) -> Result<Option<Self>, BakeError> {
        let side = side_of(site);
        let (Some(side), [room]) = (side, &site.rooms[..]) else { return Ok(None) };
        let corner = |corner: [f64; 3]| glam::DVec3::from(corner);
        let middle = (0.5 * (corner(room.min) + corner(room.max))).as_vec3();
        reporter.stage("panorama", u64::from(side) * 2);
        let drawn: Vec<u32> = scene.parts.iter().flat_map(|part| part.drawn_triangles()).map(|t| t as u32).collect();
        let triangles: Vec<[u32; 3]> = drawn.iter().map(|&t| scene.mesh.triangles[t as usize]).collect();
        let shown = TriangleScene::build(&scene.mesh.positions, &triangles, &BuildParams::default())?;
        let texels = look::look(scene, (rays, &shown, &drawn), (side, middle), &|row| reporter.progress(row));
        reporter.finished();
        Ok(Some(Self { side, middle, texels }))
    }

    /// Texels along a side of its faces.
    #[must_use]
    pub fn side(&self) -> u32 {
        self.side
    }

    /// What a manifest tells.
    #[must_use]
    pub fn info(&self) -> PanoramaInfo {
        PanoramaInfo { side: self.side, middle: self.middle.to_array(), texels: self.texels.len() as u64 }
    }

    /// What decides where the texels lie, for names of blocks.
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        let mut digest = Digest::default();
        digest.run(TOOL.as_bytes());
        digest.run(&[self.side.to_le_bytes(), TEXEL_LEVELS.to_le_bytes()].concat());
        for texel in &self.texels {
            digest.run(&texel.at.map(u16::to_le_bytes).concat());
            digest.run(bytemuck::bytes_of(&texel.place.position));
            digest.run(bytemuck::bytes_of(&texel.place.normal));
        }
        digest.bytes()
    }

    /// Its light.
    ///
    /// # Errors
    /// Input that the solver refuses, a cache that cannot be written.
    pub fn light(&self, solved: &SolvedScene, work: &Work, names: &TexelNames) -> Result<BakedTexels, BakeError> {
        let fine = Level::new(self, 0);
        let masks = solved.masks(&fine, work, &names.masks)?;
        let above = Level::new(self, sky_level(solved.channels()));
        let sky = solved.values(&above, Asked::Sky, work, &names.sky)?;
        // of those that lie inside of something the nearest that do not
        let nearest = fine.nearest(&above.of_finest(&fine, &sky.valid));
        let words = masks.words_per_point();
        let own = |&texel: &u32| &masks.words[texel as usize * words..(texel as usize + 1) * words];
        let mut baked = BakedTexels {
            masks: nearest.iter().flat_map(own).copied().collect(),
            sky: sky.values,
            bounce: Vec::new(),
            samples: [sky.samples, 0],
            gather_rays: sky.rays,
            mask_rays: masks.rays,
        };
        if solved.sun.is_some() {
            let bounce = solved.values(&Level::new(self, TEXEL_LEVELS - 1), Asked::Bounce, work, &names.bounce)?;
            baked.bounce = bounce.values;
            baked.samples[1] = bounce.samples;
            baked.gather_rays += bounce.rays;
        }
        Ok(baked)
    }

    /// The textures of the bundle.
    #[must_use]
    pub fn textures(&self, light: &BakedTexels, layout: LightLayout) -> heliodon_bundle::Panorama {
        let size = size_of(self.side);
        let shown: Vec<Shown> = (0..TEXEL_LEVELS).map(|level| Shown::of(&Level::new(self, level))).collect();
        let means = |from: usize, finest: Vec<f32>, width: usize| {
            let mut levels = vec![finest];
            for pair in shown[from..].windows(2) {
                levels.extend(levels.last().map(|finer| coarser(&pair[1].owners, (&pair[0].owners, finer), width, mean)));
            }
            levels
        };
        let words = layout.mask_words();
        let mut masks = vec![shown[0].spread(&light.masks, words)];
        for pair in shown.windows(2) {
            masks.extend(masks.last().map(|finer| coarser(&pair[1].owners, (&pair[0].owners, finer), words, most)));
        }
        let above = sky_level(layout.channels) as usize;
        let sky = means(above, shown[above].spread(&light.sky, layout.transfer_floats()), layout.transfer_floats());
        let (bounced, coarsest) = (layout.bounce_floats(), shown.len() - 1);
        let bounce = (bounced > 0).then(|| {
            let values = shown[coarsest].spread(&light.bounce, bounced);
            float_texture(size.map(|side| side >> coarsest), bounced, &[values])
        });
        let light = TexelLight {
            sun: sun_texture(layout, size, &masks),
            sky: float_texture(size.map(|side| side >> above), layout.transfer_floats(), &sky),
            bounce,
        };
        let normal =
            |texel: &Texel| ((texel.place.normal * NORMAL_STEPS).round() / NORMAL_STEPS).extend(texel.nearness).to_array();
        let mut surface = shown[0].spread(&self.texels.iter().flat_map(normal).collect::<Vec<f32>>(), 4);
        // what is beside them is filtered, and says nothing itself
        shown[0].beside().for_each(|cell| surface[cell * 4 + 3] = 0.0);
        let albedo: Vec<f32> = self.texels.iter().flat_map(|texel| texel.albedo.to_array()).collect();
        let albedo: Vec<Vec<[f32; 4]>> =
            means(0, shown[0].spread(&albedo, 4), 4).iter().map(|level| level.as_chunks().0.to_vec()).collect();
        let surface = surface_texture(size, &means(0, surface, 4));
        heliodon_bundle::Panorama { light, surface, albedo: albedo_texture(size, &albedo) }
    }
}

/// Steps of a normal's coordinate to each side of 0: fewer than a half float has, so that files pack; a quarter of a degree.
const NORMAL_STEPS: f32 = 256.0;

/// Texels along a side of the faces of a site's panorama, where it wants one.
#[must_use]
pub fn side_of(site: &heliodon_bundle::site::SiteFile) -> Option<u32> {
    site.prepare.as_ref().map(|prepare| prepare.panorama).filter(|&side| side > 0)
}
